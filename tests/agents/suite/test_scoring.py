"""Scores on levels: any agent, the same streams, the same count."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import GNM, ErrorTrace, NeuronAgent, noisy_performance
from agents.suite import score
from gnm_env import suite
from gnm_env.results import Recorder, read_results

LEVEL = suite()["1class"]


class Predicts:
    """Spikes where the bits of two channels differ; with SB3's predict."""

    def predict(self, bits: Any, state: Any = None, start: Any = None, best: bool = True) -> Any:
        return (bits[:, 0] > bits[:, 1]).astype(np.int64), None


class Acts:
    """The same, with act; counts how often a stream begins."""

    begun = 0

    def begin_trial(self) -> None:
        self.begun += 1

    def act(self, bits: Any) -> int:
        return int(bits[0] > bits[1])


def test_predict_act_and_a_function_are_scored_alike() -> None:
    acts = Acts()
    scores = [score(agent, "1class", 103) for agent in (Predicts(), acts, Acts().act)]
    assert acts.begun == suite().runs
    assert scores[0].tolist() == scores[1].tolist() == scores[2].tolist()
    assert scores[0].min() < scores[0].max()


def test_the_score_is_the_noisy_performance_on_the_leagues_streams() -> None:
    agent = NeuronAgent(GNM(), ErrorTrace(), n_inputs=100, seed=0)
    expected = noisy_performance(agent, LEVEL.task, LEVEL.patterns(104), seed=10_104_000)
    assert score(agent, LEVEL, 104).tolist() == expected.tolist()


def test_silence_survives_as_long_as_is_promised() -> None:
    survived = score(lambda bits: 0, "2class", 100)
    assert survived.mean() == pytest.approx(suite()["2class"].task.silent_score, rel=0.25)


def test_a_recorder_gets_the_score(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, "1class", 103, "mine")
    survived = score(Predicts(), "1class", 103, recorder=recorder, heard=5)
    (result,) = read_results(tmp_path)
    assert result.last.survived == tuple(survived)
    assert result.last.heard == 5


def test_a_recorder_of_another_training_is_refused(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, "1class", 103, "mine")
    with pytest.raises(ValueError, match="recorder is that of level 1class, pattern seed 103, and"):
        score(Predicts(), "1class", 104, recorder=recorder)


@pytest.mark.parametrize("agent", [None, 3, Acts, object()])
def test_what_is_no_agent_is_refused(agent: Any) -> None:
    with pytest.raises(ValueError, match="an agent must have predict"):
        score(agent, "1class", 100)


def test_an_answer_that_is_no_spike_is_refused() -> None:
    with pytest.raises(ValueError, match="0"):
        score(lambda bits: 2, "1class", 100)
