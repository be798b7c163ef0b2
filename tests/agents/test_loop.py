"""The standard loop: which environments it takes, and the history that it keeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents import GNM, AggregateLabel, History, NeuronAgent, record, train
from gnm_env import draw_trial
from tests.agents.worlds import BUSY, BUSY_PATTERNS, trial_env


def busy_agent(learning_rate: float = 1e-3) -> NeuronAgent:
    return NeuronAgent(GNM(), AggregateLabel(learning_rate), BUSY.n_inputs, 0, 0.6)


@pytest.mark.parametrize("feedback", ["sign", "dense"])
def test_however_feedback_is_given_aggregate_labels_teach_the_same(feedback: str) -> None:
    usual, other = busy_agent(), busy_agent()
    train(usual, trial_env(), 50, seed=4)
    train(other, trial_env(feedback=feedback), 50, seed=4)
    assert np.array_equal(usual.weights, other.weights)
    assert np.array_equal(usual.velocity, other.velocity)


def test_environments_may_be_wrapped() -> None:
    usual, other = busy_agent(), busy_agent()
    train(usual, trial_env(), 50, seed=4)
    wrapped = gym.wrappers.RecordEpisodeStatistics(gym.wrappers.TimeLimit(trial_env(), 10_000))
    train(other, wrapped, 50, seed=np.random.default_rng(4))
    assert np.array_equal(usual.weights, other.weights)


@pytest.mark.parametrize(
    "env",
    [
        gym.make("gnm/PatternStream-v0", task=BUSY, patterns=BUSY_PATTERNS),
        gym.make("gnm/PatternTrial-v0", task=BUSY, patterns=BUSY_PATTERNS, max_episode_steps=9),
    ],
    ids=["stream", "truncated"],
)
def test_an_environment_that_tells_no_label_is_refused(env: gym.Env[Any, Any]) -> None:
    with pytest.raises(ValueError, match="env must tell the aggregate label at the end"):
        train(busy_agent(), env, 5, seed=0)


def test_the_history_counts_wrong_trials_and_spikes_too_many_or_too_few() -> None:
    agent = busy_agent(learning_rate=0.0)
    history = train(agent, trial_env(), 25, seed=4, block=10)
    rng = np.random.default_rng(4)
    trials = [draw_trial(BUSY, BUSY_PATTERNS, rng) for _ in range(25)]
    errors = np.array([abs(t.label - int(record(agent, t).spikes.sum())) for t in trials])
    blocks = [errors[:10], errors[10:20], errors[20:]]
    assert history.trials.tolist() == [10, 20, 25]
    assert history.error_rate.tolist() == [np.mean(block > 0) for block in blocks]
    assert history.mean_error.tolist() == [np.mean(block) for block in blocks]
    assert int(history.overflowed) == -1
    assert 0 < errors.min() + errors.max()


def test_a_history_of_many_is_a_history_for_each() -> None:
    history = History(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.array([-1, 7]))
    history.append(10, [1, 5], [2.0, 9.0])
    history.append(0, [1, 5], [2.0, 9.0])  # no trials, no entry
    history.append(4, [4, 0], [4.0, 0.0])
    assert len(history) == 2
    second = history.of(1)
    assert second.trials.tolist() == [10, 14]
    assert second.error_rate.tolist() == [0.5, 0.0]
    assert second.mean_error.tolist() == [0.9, 0.0]
    assert int(second.overflowed) == 7


def test_a_learning_curve_is_written_as_csv_with_all_its_digits(tmp_path: Path) -> None:
    history = History()
    history.append(3, 1, 2)
    history.append(3, 3, 1e6)
    history.save(tmp_path / "curve.csv")
    lines = (tmp_path / "curve.csv").read_text().splitlines()
    assert lines[0] == "trials,error_rate,mean_error"
    rows = [[float(cell) for cell in line.split(",")] for line in lines[1:]]
    assert rows == [[3, 1 / 3, 2 / 3], [6, 1.0, 1e6 / 3]]
    with pytest.raises(ValueError, match="cannot write"):
        history.save(tmp_path / "missing" / "curve.csv")
