"""A word in speech: controls, scores and the timing of spikes are what they say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents import NeuronAgent
from agents.experiments import speech
from agents.experiments.speech import Timing, latency_of, score, timing
from agents.network import Network
from gnm_env import Trial, Trials
from gnm_env.speech import digits, part


def phrases_of(rng: Any, n: int) -> Trials:
    """Made phrases: channel 0 spikes once for each "seven"."""
    trials, words = [], []
    for _ in range(n):
        said = rng.integers(5, 9, 4).tolist()
        raster = rng.random((100, 6)) < 0.02
        raster[:, 0] = False
        raster[[20 * k + 10 for k, word in enumerate(said) if word == 7], 0] = True
        trials.append(Trial.from_dense(raster, label=said.count(7)))
        words.append(said)
    places: dict[str, Any] = {
        "voice": [k % 10 for k in range(n)],
        "onsets": [[0, 20, 40, 60]] * n,
        "ends": [[15, 35, 55, 75]] * n,
    }
    return Trials(trials, columns={"words": words, **places}, metadata={"word": "seven"})


MADE = phrases_of(np.random.default_rng(0), 200)


def test_a_score_is_the_share_of_exact_counts_and_the_mean_error() -> None:
    assert score(np.array([0, 1, 2, 5]), np.array([0, 1, 3, 3])) == (0.5, 0.75)


def test_the_constant_is_the_commonest_label_of_training() -> None:
    commonest = np.bincount(MADE.labels).argmax()
    assert speech.constant(MADE, MADE[:3]).tolist() == [commonest] * 3
    assert speech.silent(MADE, MADE[:3]).tolist() == [0, 0, 0]


def test_ridge_counts_where_a_channel_counts() -> None:
    guess = speech.ridge(MADE[:150], MADE[150:])
    assert score(guess, MADE[150:].labels).exact > 0.95


def test_channel_counts_are_sums_of_the_raster_with_the_duration() -> None:
    counts = speech.channel_counts(MADE[:5])
    for row, trial in zip(counts, MADE[:5], strict=True):
        assert row.tolist() == [*trial.dense().sum(axis=0), trial.n_bins]


def one_phrase(words: list[int], onsets: list[int], ends: list[int]) -> Trials:
    columns: dict[str, Any] = {"words": [words], "onsets": [onsets], "ends": [ends]}
    trial = Trial.from_dense(np.zeros((200, 2), bool), label=words.count(7))
    return Trials([trial], columns=columns, metadata={"word": "seven"})


@pytest.mark.parametrize(
    ("spikes", "expected"),
    [
        ([], (0.0, 0.0)),
        ([30, 130], (1.0, 1.0)),
        ([20, 139], (1.0, 1.0)),
        ([19, 140], (0.0, 0.0)),
        ([30, 31], (0.5, 0.5)),
        ([30, 90, 130], (1.0, 2 / 3)),
    ],
)
def test_each_word_gets_one_spike_at_most_from_its_first_bin_on(
    spikes: list[int], expected: Timing
) -> None:
    phrase = one_phrase([7, 1, 7], [20, 85, 120], [40, 95, 140])
    assert timing([np.array(spikes, np.int64)], phrase) == expected


def test_mirrored_spikes_are_counted_from_the_end() -> None:
    phrase = one_phrase([7, 1], [0, 100], [20, 120])
    late = [np.array([100])]
    assert timing(late, phrase) == (0.0, 0.0)
    assert timing(late, phrase, mirrored=True) == (1.0, 1.0)


def test_latency_is_taken_off_and_found_in_training() -> None:
    phrase = one_phrase([7, 1, 7], [20, 85, 120], [40, 95, 140])
    late = [np.array([68, 168])]
    assert timing(late, phrase) == (0.0, 0.0)
    assert timing(late, phrase, latency=30) == (1.0, 1.0)
    assert latency_of(late, phrase) == 30


def test_a_perfect_neuron_has_perfect_scores() -> None:
    """One channel alone, strong enough for one spike each time."""
    agent = speech.LEARNERS["GNM, ALL"].agent(6, 0, 100)
    agent.weights[:] = 0.0
    agent.weights[0] = 1.2
    phrases = Trials([t for t in MADE if t.n_bins], columns=MADE.columns, metadata=MADE.metadata)
    assert speech.exact(agent, phrases) == (1.0, 0.0)
    spikes = speech.spike_bins(agent, phrases)
    assert timing(spikes, phrases) == (1.0, 1.0)


def test_the_best_in_training_comes_first() -> None:
    learner = replace(
        speech.LEARNERS["GNM, ALL"], settings={"learning_rate": 1e-2, "momentum": 0.0}
    )
    agents = speech.train(learner, MADE, restarts=3, epochs=3)
    scores = [speech.exact(agent, MADE).exact for agent in agents]
    assert scores == sorted(scores, reverse=True) and isinstance(agents[0], NeuronAgent)


def test_a_phrase_is_drawn_with_its_words_named() -> None:
    pytest.importorskip("matplotlib")
    phrases = part(digits(), "test")
    number = speech.shown_phrase(phrases)
    agent = speech.LEARNERS["GNM, ALL"].agent(96 * len(speech.DELAYS), 0, 100)
    figure = speech.draw(agent, phrases, number)
    named = [text.get_text() for text in figure.axes[0].texts]
    assert named == [speech.DIGITS[word] for word in phrases.columns["words"][number]]
    assert named.count("seven") == 2
    raster = figure.axes[0].lines[0]
    assert len(raster.get_xdata()) == phrases.n_spikes[number]


def test_a_network_learns_where_the_word_is_and_is_scored_on_the_label() -> None:
    learner = speech.NetworkLearner(Network(hidden=2), 1e-2, 0.3)
    agents = speech.train(learner, MADE, restarts=2, epochs=5)
    scores = [speech.exact(agent, MADE).exact for agent in agents]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] > score(speech.constant(MADE, MADE), MADE.labels).exact
    assert agents[0].weights.shape == (6 * 2 + 2,)


def test_ppo_hears_the_phrases_and_is_scored_like_the_others() -> None:
    pytest.importorskip("stable_baselines3")
    row = speech.ppo_row({"train": MADE, "test": MADE[:50]}, bins=16_384)
    assert row.name == speech.PPO and set(row.scores) == {"test"}
    assert 0 <= row.train <= 1 and 0 <= row.scores["test"].exact <= 1
    assert row.timing is None and speech.text_table([row]).splitlines()[-1].startswith("PPO")
