"""`gnm speech`: trains on phrases, prints a table, draws a picture; makes phrases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agents.commands import speech
from agents.commands.terminal import parse
from gnm_env import Trials
from gnm_env.speech import digits
from gnm_env.speech.phrases import part


@pytest.fixture
def few(tmp_path: Path) -> Path:
    """A file with a few of the phrases of each split."""
    phrases = digits()
    splits = np.array(phrases.columns["split"])
    sizes = {"train": 300, "test": 60, "near": 20, "stream": 2}
    kept = np.concatenate([np.flatnonzero(splits == s)[:n] for s, n in sizes.items()])
    phrases[kept].save(tmp_path / "few.npz")
    return tmp_path / "few.npz"


def test_it_scores_controls_and_neurons_and_draws(few: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    words = ["--phrases", few, "--epochs", 2, "--restarts", 3, "--runs", 2, "--out", tmp_path]
    result = speech.main(parse(speech, words))
    names = [row["name"] for row in result["rows"]]
    assert names == ["silent", "constant", "ridge", "MST, CriticalThreshold"]
    labels = part(Trials.load(few), "test").labels
    silent, constant = result["rows"][:2]
    assert silent["scores"]["test"][0] == pytest.approx(np.mean(labels == 0))
    assert silent["scores"]["test"][1] == pytest.approx(np.mean(labels))
    assert constant["scores"]["test"][0] >= silent["scores"]["test"][0]
    assert len(result["selections"]) == 2 and len(result["rows"][-1]["restarts"]) == 3
    assert Path(result["picture"]).stat().st_size > 10_000


def test_an_unknown_learner_is_refused(few: Path) -> None:
    with pytest.raises(ValueError, match="learner must be one of MST, CriticalThreshold"):
        speech.main(parse(speech, ["--phrases", few, "--learner", "PPO"]))


@pytest.mark.slow
def test_a_neuron_understands_distant_voices_far_better_than_the_controls(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = speech.main(parse(speech, ["--out", tmp_path, "--runs", 3]))
    ridge, neuron = result["rows"][2:]
    assert ridge["scores"]["test"][0] < 0.55
    assert np.median(result["selections"]) > 0.87
    assert min(neuron["timing"]) > 0.9 and max(neuron["mirrored"]) < 0.6


@pytest.mark.slow
def test_phrases_are_made_anew(tmp_path: Path) -> None:
    pytest.importorskip("espeakng_loader")
    words = ["make", "--train", 4, "--test", 3, "--near", 2, "--stream", 1, "--word", "two"]
    result = speech.main(parse(speech, [*words, "--out", tmp_path / "new.npz"]))
    phrases = Trials.load(result["phrases"])
    assert len(phrases) == result["trials"] == 10
    assert min(phrases.metadata["nearest"]["test"]) >= phrases.metadata["bound"]
