"""The standard loop: which environments it takes, and the history that it keeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from agents import (
    GNM,
    AggregateLabel,
    History,
    NeuronAgent,
    WeightOverflow,
    record,
    train,
    train_many,
)
from agents.continuous import ContinuousAgent, ContinuousGNM
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


def test_the_curves_of_many_are_written_with_a_column_for_each(tmp_path: Path) -> None:
    history = train_many([busy_agent(), busy_agent(0.0)], BUSY, BUSY_PATTERNS, 20, seed=1, block=10)
    history.save(tmp_path / "curves.csv")
    lines = (tmp_path / "curves.csv").read_text().splitlines()
    assert lines[0] == "trials,error_rate_0,error_rate_1,mean_error_0,mean_error_1"
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert np.array_equal(rows[:, 1:3], history.error_rate)
    assert np.array_equal(rows[:, 3:], history.mean_error)


@pytest.mark.parametrize("k", [2, -3, "x", None, 0.5, 2**70])
def test_the_curve_of_an_agent_that_is_not_there_is_refused(k: Any) -> None:
    history = History(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2)), np.array([-1, 7]))
    with pytest.raises(ValueError, match="the number of the agent must be"):
        history.of(k)
    with pytest.raises(ValueError, match="the learning curve of one agent already"):
        History().of(k)


@pytest.mark.parametrize(
    "block", [("x", 0, 0), (-1, 0, 0), (1, "x", 0), (1, -1, 0), (1, [1, 2], 0)]
)
def test_what_is_no_block_of_trials_is_not_added_to_a_history(block: Any) -> None:
    history = History(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)), np.full(3, -1))
    with pytest.raises(ValueError, match="must be"):
        history.append(*block)
    assert len(history) == 0


# --- what is refused before anything is changed ---------------------------------------------------


@pytest.mark.parametrize("agent", [None, 3, "x", GNM(), [busy_agent()], NeuronAgent], ids=str)
def test_what_cannot_learn_is_refused_by_name(agent: Any) -> None:
    with pytest.raises(ValueError, match="agent must be one agent with begin_trial"):
        train(agent, trial_env(), 2, seed=1)


@pytest.mark.parametrize("env", [None, 3, "x", "vector"])
def test_what_is_no_environment_is_refused_by_name(env: Any) -> None:
    if env == "vector":
        env = gym.make_vec("gnm/PatternTrial-v0", num_envs=2, task=BUSY, patterns=BUSY_PATTERNS)
    with pytest.raises(ValueError, match="env must be a gymnasium Env"):
        train(busy_agent(), env, 2, seed=1)


def test_spikes_and_amounts_do_not_mix() -> None:
    with pytest.raises(ValueError, match=r'answers with spikes.*make it with output="spikes"'):
        train(busy_agent(), trial_env(output="graded"), 2, seed=1)
    amounts = ContinuousAgent(ContinuousGNM(), AggregateLabel(fraction=0.5), BUSY.n_inputs)
    with pytest.raises(ValueError, match=r'answers with amounts.*make it with output="graded"'):
        train(amounts, trial_env(), 2, seed=1)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"trials": 10**13}, "trials must be at most 1,000,000,000,000"),
        ({"callback": 3}, "callback must be a function of the trials done and the history"),
        ({"block": 0}, "block must be >= 1"),
    ],
)
def test_bad_arguments_are_refused_in_either_loop(keywords: dict[str, Any], message: str) -> None:
    keywords = {"trials": 2, **keywords}
    with pytest.raises(ValueError, match=message):
        train(busy_agent(), trial_env(), seed=1, **keywords)
    with pytest.raises(ValueError, match=message):
        train_many([busy_agent()], BUSY, BUSY_PATTERNS, seed=1, **keywords)


@pytest.mark.parametrize("learning_rate", [0.0, 1e-3])
def test_a_potential_that_is_not_finite_ends_learning_in_either_loop(learning_rate: float) -> None:
    """Weights that are finite, but whose sum is not: else the neuron is silent without a word."""

    def huge() -> NeuronAgent:
        agent = busy_agent(learning_rate)
        agent = NeuronAgent(agent.neuron, agent.rule, BUSY.n_inputs, weight_bounds=None)
        agent.weights = 1e308
        return agent

    alone, among, other = huge(), huge(), busy_agent()
    with pytest.warns(WeightOverflow, match="a potential of the agent would have overflowed"):
        by_loop = train(alone, trial_env(), 20, seed=1, block=10)
    with pytest.warns(WeightOverflow, match="a potential of agent 1 would have overflowed"):
        by_lanes = train_many([other, among], BUSY, BUSY_PATTERNS, 20, seed=1, block=10)
    assert by_loop.overflowed == by_lanes.overflowed[1] >= 0
    assert alone.overflowed and among.overflowed and not other.overflowed
    assert (alone.weights == 1e308).all() and (among.weights == 1e308).all()
