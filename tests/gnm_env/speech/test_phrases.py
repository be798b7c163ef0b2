"""Phrases of digits: labels count one word, voices stay apart, and what is known goes along."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gnm_env import Trials
from gnm_env.speech import DIGITS, counting, digits, located, make, part
from gnm_env.speech.phrases import SHIPPED, STREAM_WORDS, balanced, draw_phrase, word_bins
from gnm_env.speech.voices import clusters, distances, split_voices
from gnm_env.trial import Trial


@pytest.fixture(scope="module")
def shipped() -> Trials:
    return digits()


class TestThePhrasesThatShip:
    def test_are_small_and_tell_labels_alone(self, shipped: Trials) -> None:
        assert SHIPPED.stat().st_size <= 6_000_000
        assert shipped.label_only.all() and shipped.n_inputs == 96
        assert shipped.metadata["word"] == "seven"

    def test_have_labels_that_count_the_word(self, shipped: Trials) -> None:
        said = [words.count(7) for words in shipped.columns["words"]]
        assert shipped.labels.tolist() == said

    def test_have_as_many_words_as_they_should(self, shipped: Trials) -> None:
        for split, words in zip(shipped.columns["split"], shipped.columns["words"], strict=True):
            assert len(words) == STREAM_WORDS if split == "stream" else 3 <= len(words) <= 6

    def test_know_where_their_words_are(self, shipped: Trials) -> None:
        places = (shipped.columns[name] for name in ("words", "onsets", "ends"))
        for words, onsets, ends, n_bins in zip(*places, shipped.n_bins, strict=True):
            assert len(words) == len(onsets) == len(ends)
            assert (np.diff(onsets) > 0).all()
            assert all(a < b for a, b in zip(onsets, ends, strict=True)) and ends[-1] <= n_bins
            assert all(b <= a for a, b in zip(onsets[1:], ends, strict=False))

    def test_come_in_voices_that_are_held_out_and_distant(self, shipped: Trials) -> None:
        heard = {s: set(part(shipped, s).columns["voice"]) for s in ("train", "test", "near")}
        assert not heard["train"] & (heard["test"] | heard["near"])
        speakers = {s: {v.partition("+")[2] for v in voices} for s, voices in heard.items()}
        assert not speakers["train"] & speakers["test"]
        assert set(part(shipped, "stream").columns["voice"]) <= heard["test"]
        known = shipped.metadata
        assert min(known["nearest"]["test"]) >= known["bound"]
        assert np.mean(known["nearest"]["near"]) < 0.7 * np.mean(known["nearest"]["test"])

    def test_have_some_150_spikes_a_word(self, shipped: Trials) -> None:
        words = sum(map(len, shipped.columns["words"]))
        assert 120 < shipped.n_spikes.sum() / words < 180

    def test_can_count_another_word(self, shipped: Trials) -> None:
        three = counting(shipped, 3)
        assert three.labels.tolist() == [w.count(3) for w in shipped.columns["words"]]
        assert three.metadata["word"] == "three"
        assert three[5].channels.tolist() == shipped[5].channels.tolist()
        fewer = balanced(three)
        for split in ("train", "test"):
            counts = np.bincount(part(fewer, split).labels)
            assert counts[0] <= counts[1]
        assert (fewer.labels > 0).sum() == (three.labels > 0).sum()


def test_there_is_no_such_split_or_word() -> None:
    with pytest.raises(ValueError, match=r"split must be one of .*'test'.*, got 'exam'"):
        part(digits(), "exam")
    with pytest.raises(ValueError, match="word must be in 0 … 9, got 10"):
        counting(digits(), 10)


def test_a_word_is_as_frequent_as_it_should_be() -> None:
    rng = np.random.default_rng(0)
    phrases = [draw_phrase(rng, word=4) for _ in range(2_000)]
    words = np.concatenate([phrase.words for phrase in phrases])
    assert np.mean(words == 4) == pytest.approx(0.28, abs=0.02)
    assert np.mean([phrase.pause_after is None for phrase in phrases]) > 0.6
    for phrase in phrases[:100]:
        said = phrase.text.replace(",", "").split(" ")
        assert said == [DIGITS[word] for word in phrase.words]
        assert phrase.text.count(",") == (phrase.pause_after is not None)
        assert not phrase.text.endswith(",")


def test_a_word_ends_with_its_last_spike() -> None:
    raster = np.zeros((40, 96), bool)
    raster[[2, 9, 20, 31], 5] = True
    first, last = word_bins(Trial.from_dense(raster, label=0), [0.005, 0.09])
    assert first.tolist() == [1, 18] and last.tolist() == [10, 32]


# --- voices --------------------------------------------------------------------------------------


def made_distances(seed: int = 0) -> Any:
    """Forty voices, in groups of four that are near to each other."""
    rng = np.random.default_rng(seed)
    centre = np.repeat(rng.normal(size=(10, 50)), 4, axis=0)
    return distances(centre + 0.1 * rng.normal(size=centre.shape))


def test_distance_is_the_root_mean_square_difference() -> None:
    portraits = np.random.default_rng(0).random((5, 30))
    found = distances(portraits)
    for i in range(5):
        for j in range(5):
            wanted = np.sqrt(np.mean((portraits[i] - portraits[j]) ** 2))
            assert found[i, j] == pytest.approx(wanted, abs=1e-6)


def test_no_cluster_is_wider_than_the_bound() -> None:
    distance = made_distances()
    found = clusters(distance, 0.5)
    assert len(set(found.tolist())) == 10
    for cluster in range(10):
        inside = found == cluster
        assert distance[np.ix_(inside, inside)].max() <= 0.5


@pytest.mark.parametrize("seed", range(5))
def test_no_training_voice_is_near_a_test_voice_but_the_control_is(seed: int) -> None:
    distance = made_distances()
    split = split_voices(distance, n_test=3, n_near=5, bound=0.5, seed=seed)
    voices = np.concatenate(split)
    assert sorted(voices.tolist()) == list(range(40))
    assert (len(split.test), len(split.near), len(split.dropped)) == (3, 5, 9)
    assert distance[np.ix_(split.test, split.train)].min() >= 0.5
    assert distance[np.ix_(split.near, split.train)].min(axis=1).mean() < 0.5


def test_too_many_test_voices_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"below the number of clusters, 10 at bound = 0\.5, got 10"
    ):
        split_voices(made_distances(), n_test=10, n_near=1, bound=0.5, seed=0)
    with pytest.raises(ValueError, match=r"only 4 voices are 0\.5 away from all test voices"):
        split_voices(made_distances(), n_test=9, n_near=4, bound=0.5, seed=0)


def test_located_phrases_owe_one_spike_where_each_counted_word_is() -> None:
    phrases = part(digits(), "test")[:20]
    where = located(phrases)
    assert where.labels.tolist() == phrases.labels.tolist() and where.columns == phrases.columns
    assert not where.label_only.any()
    for trial, words, onsets, ends in zip(
        where, *(phrases.columns[name] for name in ("words", "onsets", "ends")), strict=True
    ):
        sevens = [k for k, word in enumerate(words) if word == 7]
        assert trial.onsets.tolist() == [onsets[k] for k in sevens]
        assert trial.ends.tolist() == [ends[k] for k in sevens]


def test_phrases_without_the_word_owe_nothing_anywhere() -> None:
    phrases = part(digits(), "test")
    silent = phrases[np.flatnonzero(phrases.labels == 0)[:3]]
    assert located(silent).labels.tolist() == [0, 0, 0]
    assert not located(silent).label_only.any()


# --- synthesis -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def synthesiser() -> Any:
    pytest.importorskip("espeakng_loader")
    from gnm_env.speech.espeak import espeak

    return espeak()


def test_words_begin_one_after_the_other(synthesiser: Any) -> None:
    said = synthesiser.say("three seven, one", "en-us+f2")
    assert len(said.onsets) == 3 and (np.diff(said.onsets) > 0.1).all()
    assert 0.5 < len(said.sound) / said.rate < 4 and 0.1 < np.abs(said.sound).max() <= 1


def test_an_unknown_voice_is_refused(synthesiser: Any) -> None:
    with pytest.raises(ValueError, match="voice must be one that eSpeak knows"):
        synthesiser.say("one", "no-such-voice")


def test_phrases_are_made_for_each_split_and_survive_a_file(
    synthesiser: Any, tmp_path: Any
) -> None:
    voices = {"train": ["en-us", "en"], "test": ["en-us+f2"]}
    phrases = make(voices, {"train": 3, "test": 1}, word=2, seed=4, metadata={"more": 1})
    phrases.save(tmp_path / "phrases.npz")
    loaded = Trials.load(tmp_path / "phrases.npz")
    assert loaded.columns["split"] == ("train", "train", "train", "test")
    assert set(part(loaded, "train").columns["voice"]) == {"en-us", "en"}
    assert loaded.labels.tolist() == [words.count(2) for words in loaded.columns["words"]]
    assert loaded.metadata == {"word": "two", "bin_seconds": 0.005, "more": 1}
