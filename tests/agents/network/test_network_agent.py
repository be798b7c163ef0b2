"""NetworkAgent stands where a NeuronAgent does: loops, lanes, scores, checkpoints, predict."""

from __future__ import annotations

import subprocess
import sys
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
    answers,
    load_checkpoint,
    noisy_performance,
    record,
    train,
    train_many,
)
from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Patterns, Task, draw_trial
from tests.agents.worlds import BUSY, BUSY_PATTERNS, trial_env

TRIALS = 150


def busy_network(lane: int = 0, hidden: int | None = 4) -> NetworkAgent:
    """Agents of different lanes differ in weights, network and rule."""
    a = 0.1 + 0.4 * (lane * 0.618 % 1.0)
    network = Network(hidden, alpha=a, inhibition=a / 4, kappa=1 - a, h=3.0 + lane % 3)
    rule = BackPropagation(
        0.02 * a, 0.01, a, noise_error=("above", "spikes")[lane % 2], lift_above=lane % 3 == 0
    )
    return NetworkAgent(network, rule, BUSY.n_inputs, lane, initial_weight=0.8)


def alone(lane: int = 0, hidden: int | None = 4) -> tuple[NetworkAgent, History]:
    agent = busy_network(lane, hidden)
    history = train_many([agent], BUSY, BUSY_PATTERNS, TRIALS, seed=9, block=40)
    return agent, history.of(0)


def assert_same(one: NetworkAgent, other: NetworkAgent) -> None:
    assert np.array_equal(one.weights, other.weights)
    assert np.array_equal(one.velocity, other.velocity)
    assert one.overflowed == other.overflowed


@pytest.mark.parametrize("hidden", [1, 4, 11, None])
@pytest.mark.parametrize("lane", [0, 1, 5])
def test_the_loop_and_train_many_end_with_the_same_bits(lane: int, hidden: int | None) -> None:
    looped = busy_network(lane, hidden)
    before = looped.weights.copy()
    by_loop = train(looped, trial_env(), TRIALS, seed=9, block=40)
    by_lanes, history = alone(lane, hidden)
    assert_same(looped, by_lanes)
    assert np.array_equal(by_loop.error_rate, history.error_rate)
    assert np.array_equal(by_loop.mean_error, history.mean_error)
    assert not np.array_equal(looped.weights, before)


@pytest.mark.parametrize("threads", [1, 2])
def test_networks_and_neurons_are_trained_side_by_side_and_each_ends_as_alone(threads: int) -> None:
    networks = [busy_network(lane) for lane in range(5)] + [busy_network(7, hidden=2)]
    neuron = NeuronAgent(GNM(), AggregateLabel(1e-3), BUSY.n_inputs, 0, 0.6)
    history = train_many(
        [neuron, *networks], BUSY, BUSY_PATTERNS, TRIALS, seed=9, threads=threads, block=40
    )
    for lane, agent in enumerate(networks):
        by_itself, its_history = alone(*((7, 2) if lane == 5 else (lane, 4)))
        assert_same(agent, by_itself)
        assert np.array_equal(history.of(lane + 1).error_rate, its_history.error_rate)


def test_feedback_on_the_way_changes_nothing_and_the_sign_alone_is_refused() -> None:
    agent = busy_network()
    train(agent, trial_env(feedback="dense"), TRIALS, seed=9)
    assert_same(agent, alone()[0])
    with pytest.raises(ValueError, match="BackPropagation needs to know where the presentations"):
        train(agent, trial_env(feedback="sign"), 1, seed=9)


def test_going_on_from_a_checkpoint_ends_where_one_uninterrupted_run_ends(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    first = busy_network()
    train(first, trial_env(), 60, rng)
    first.save(tmp_path / "half", task=BUSY, patterns=BUSY_PATTERNS, rng=rng)
    assert [path.name for path in tmp_path.iterdir()] == ["half"]
    saved = load_checkpoint(tmp_path / "half")
    assert (saved.agent.network, saved.agent.rule) == (first.network, first.rule)
    train_many([saved.agent], saved.task, saved.patterns, TRIALS - 60, saved.rng)
    assert_same(saved.agent, alone()[0])


@pytest.mark.parametrize("hidden", [4, None])
def test_save_and_load_keep_every_bit(hidden: int | None, tmp_path: Path) -> None:
    agent, _ = alone(1, hidden)
    agent.save(tmp_path / "agent")
    assert_same(NetworkAgent.load(tmp_path / "agent"), agent)


def test_load_refuses_other_kinds_and_damaged_files(tmp_path: Path) -> None:
    NeuronAgent(GNM(), AggregateLabel(), 20).save(tmp_path / "neuron")
    with pytest.raises(ValueError, match="holds a NeuronAgent, not a NetworkAgent"):
        NetworkAgent.load(tmp_path / "neuron")
    busy_network().save(tmp_path / "network")
    contents = (tmp_path / "network").read_bytes()
    for size in (0, 100, len(contents) // 2, len(contents) - 10):
        (tmp_path / "network").write_bytes(contents[:size])
        with pytest.raises(ValueError, match="is not a readable checkpoint"):
            NetworkAgent.load(tmp_path / "network")


def test_a_checkpoint_whose_parts_do_not_fit_is_refused(tmp_path: Path) -> None:
    agent = busy_network()
    agent._weights = agent._weights[:1]
    agent.save(tmp_path / "agent")
    with pytest.raises(ValueError, match="weights and velocity must have length 52"):
        NetworkAgent.load(tmp_path / "agent")


# --- scores --------------------------------------------------------------------------------------

# One pattern, in which most channels spike together, as in the tests of the scores of neurons.
EASY = Task(n_inputs=10, pattern_bins=20, rate=0.05, onset_probability=0.02)
COINCIDENCE = np.zeros((1, 20, 10), np.bool_)
COINCIDENCE[0, 2, :8] = True
EASY_PATTERNS = Patterns.from_dense(COINCIDENCE)
CAP, RUNS, SEED = 600, 8, 400


def easy_network(weight: float = 0.18, hidden: int = 3) -> NetworkAgent:
    agent = NetworkAgent(Network(hidden), n_inputs=EASY.n_inputs)
    agent.hidden_weights, agent.output_weights = weight, 0.5
    return agent


@pytest.mark.parametrize("predict", [True, False], ids=["predict", "act"])
def test_noisy_performance_is_the_return_of_the_stream_environment(predict: bool) -> None:
    agent = easy_network()
    env = gym.make("gnm/PatternStream-v0", task=EASY, patterns=EASY_PATTERNS, max_episode_steps=CAP)
    returns = []
    for run in range(RUNS):
        obs, _ = env.reset(seed=SEED + run)
        agent.begin_trial()
        state, total, ended = None, 0.0, False
        while not ended:
            if predict:
                action, state = agent.predict(obs, state)
            else:
                action = agent.act(obs)
            obs, reward, terminated, truncated, _ = env.step(action)
            total += float(reward)
            ended = terminated or truncated
        returns.append(total)
    survived = noisy_performance(agent, EASY, EASY_PATTERNS, RUNS, CAP, SEED)
    assert survived.tolist() == returns
    assert survived.max() == CAP > 50 > survived.min(), "good and bad runs should both occur"


def test_networks_of_a_list_hear_the_same_streams() -> None:
    agents = [easy_network(0.18), easy_network(0.0), easy_network(0.2), easy_network(0.18, 2)]
    table = noisy_performance(agents, EASY, EASY_PATTERNS, RUNS, CAP, SEED)
    for agent, row in zip(agents, table, strict=True):
        alone = noisy_performance(agent, EASY, EASY_PATTERNS, RUNS, CAP, SEED)
        assert row.tolist() == alone.tolist()


def test_answers_are_the_spikes_counted_in_each_trial() -> None:
    agents = [busy_network(0), busy_network(3)]
    found = answers(agents, BUSY, BUSY_PATTERNS, trials=40, seed=3)
    for lane, agent in enumerate(agents):
        table = np.zeros_like(found.table[lane])
        wrong = false_alarms = 0
        rng = np.random.default_rng(3)
        for _ in range(40):
            trial = draw_trial(BUSY, BUSY_PATTERNS, rng)
            spikes = record(agent, trial).spikes
            owner = trial.owner()
            for k, class_ in enumerate(trial.classes):
                table[class_, spikes[owner == k].sum()] += 1
            false_alarms += spikes[owner < 0].sum()
            wrong += spikes.sum() != trial.label
        assert found.table[lane].tolist() == table.tolist()
        assert (found.false_positives[lane], found.wrong[lane]) == (false_alarms, wrong)
        assert false_alarms > 0
        assert (table[:, 1:].sum(axis=1) > 0).all()
    assert (found.noise_bins, found.trials) == (40 * BUSY.background_bins, 40)


def test_an_agent_that_does_not_fit_the_task_is_refused() -> None:
    with pytest.raises(ValueError, match="n_inputs = 10, got 12"):
        noisy_performance(busy_network(), EASY, EASY_PATTERNS)


# --- acting --------------------------------------------------------------------------------------


def test_predict_answers_many_streams_as_act_answers_each_and_changes_nothing() -> None:
    agent, rng = busy_network(), np.random.default_rng(0)
    weights = agent.weights.copy()
    streams = (rng.random((60, 3, BUSY.n_inputs)) < 0.15).astype(np.int8)
    state, actions = None, []
    for t, obs in enumerate(streams):
        starts = np.array([t == 0, t == 0, t in (0, 25)])
        action, state = agent.predict(obs, state, starts)
        actions.append(action)
    expected = np.empty((60, 3), int)
    for n in range(3):
        for t in range(60):
            if t == 0 or (n == 2 and t == 25):
                agent.begin_trial()
            expected[t, n] = agent.act(streams[t, n])
    assert np.array_equal(actions, expected)
    assert 0 < expected.mean() < 1
    assert np.array_equal(agent.weights, weights)
    assert agent.predict(streams[0, 0])[0].shape == ()


def test_long_and_dense_trials_outgrow_no_buffer() -> None:
    task = Task(n_inputs=12, rate=0.9, background_bins=2_000, pattern_bins=5)
    patterns = Patterns.draw(task, 0)
    looped, lane = busy_network(), busy_network()
    env = gym.make("gnm/PatternTrial-v0", task=task, patterns=patterns)
    train(looped, env, 2, seed=1)
    train_many([lane], task, patterns, 2, seed=1)
    assert_same(looped, lane)


@pytest.mark.parametrize("obs", [np.zeros(11, np.int8), np.zeros((2, 12), np.int8)])
def test_observations_of_another_shape_are_refused(obs: Any) -> None:
    with pytest.raises(ValueError, match="an observation must have shape"):
        busy_network().act(obs)


def test_a_copy_with_other_parameters_keeps_the_weights() -> None:
    agent, _ = alone()
    copy = agent.replaced(alpha=0.9)
    assert copy.network.alpha == 0.9
    assert_same(copy, agent)
    copy.weights[:] = 0.0
    assert agent.weights.any()


def test_everything_but_the_module_works_without_torch() -> None:
    code = """
import sys
sys.modules["torch"] = None
from agents.network import *
NetworkAgent(Network(hidden=2), BackPropagation(), 3).predict([0, 1, 0])
try:
    from agents.network import NetworkModule
except ImportError as error:
    print(error)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert (
        'NetworkModule needs torch, and torch is missing: pip install "gnm-env[rl]"' in run.stdout
    )
