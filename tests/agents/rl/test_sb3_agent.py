"""An SB3 model in a neuron's place: the same streams, the same scores, the same observations."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv

from agents import GNM, AggregateLabel, NeuronAgent, noisy_performance, train_many
from agents.policy import PolicyBatch
from agents.rl import RAW, TRACES, SB3Agent, Senses, make_rl_agent
from agents.training.source import TaskSource
from gnm_env import Patterns, Task
from gnm_env.wrappers import SeededEpisodes

TASK = Task(onset_probability=0.05)
PATTERNS = Patterns.draw(TASK, 3)
STREAM = "gnm/PatternStream-v0"


def stream(seed: int) -> gym.Env:
    return SeededEpisodes(gym.make(STREAM, task=TASK, patterns=PATTERNS), seed)


def trial_env(**arguments: Any) -> gym.Env:
    return gym.make("gnm/PatternTrial-v0", task=TASK, patterns=PATTERNS, **arguments)


def lively_model(kind: str) -> Any:
    """An untrained model whose answers depend on what it hears, and come now and then."""
    model = make_rl_agent(kind, trial_env(), seed=1, spike_probability=0.3)
    gain = 400.0 if kind == "ppo" else 4000.0
    with torch.no_grad():
        model.policy.action_net.weight.mul_(gain)
    return model


class Recorder:
    """Answers 0, 0, 1 in turn and keeps what it is shown."""

    def __init__(self) -> None:
        self.shown: list[np.ndarray] = []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.shown.append(np.array(observation))
        n = 0 if state is None else state
        return np.full(len(observation), int(n % 3 == 2)), n + 1


@pytest.mark.parametrize("kind", ["ppo", "recurrent-ppo"])
def test_evaluate_policy_and_noisy_performance_agree_exactly(kind):
    agent = SB3Agent(lively_model(kind), TASK, TRACES if kind == "ppo" else RAW)
    returns, _ = evaluate_policy(
        agent, DummyVecEnv([lambda: stream(40)]), 12, return_episode_rewards=True, warn=False
    )
    survived = noisy_performance(agent, TASK, PATTERNS, runs=12, seed=40)
    assert survived.tolist() == returns
    assert len(set(returns)) > 5, "streams must differ for the test to mean anything"


def test_a_neuron_scores_the_same_in_evaluate_policy_as_in_noisy_performance():
    neuron = NeuronAgent(GNM(), AggregateLabel(learning_rate=1e-3), TASK.n_inputs, seed=0)
    train_many([neuron], TASK, PATTERNS, trials=2_000, seed=5)
    returns, _ = evaluate_policy(
        neuron, DummyVecEnv([lambda: stream(70)]), 10, return_episode_rewards=True, warn=False
    )
    assert noisy_performance(neuron, TASK, PATTERNS, runs=10, seed=70).tolist() == returns
    assert (
        PolicyBatch(neuron, TaskSource(TASK, PATTERNS)).survive_streams(70, 10, 10_000)[0].tolist()
        == returns
    )


def test_a_model_trained_on_wrapped_environments_is_shown_the_same_by_the_agent():
    senses = Senses(decays=(0.3, 0.1), previous_action=True, own_decay=0.2, rising_edge=True)
    recorder = Recorder()
    agent = SB3Agent(recorder, TASK, senses)
    wrapped, bare = senses.wrap(trial_env()), trial_env()
    observation, _ = wrapped.reset(seed=2)
    bits, _ = bare.reset(seed=2)
    agent.begin_trial()
    shown, over = [observation], False
    while not over:
        action = int((len(shown) - 1) % 3 == 2)
        observation, reward, over, _, _ = wrapped.step(action)
        bits, other_reward, _, _, _ = bare.step(agent.act(bits))
        assert reward == other_reward
        shown.append(observation)
    np.testing.assert_array_equal(np.concatenate(recorder.shown), shown[:-1])


@pytest.mark.parametrize("kind", ["ppo", "recurrent-ppo"])
def test_streams_side_by_side_are_answered_as_each_alone(kind):
    agent = SB3Agent(lively_model(kind), TASK, TRACES if kind == "ppo" else RAW)
    bits = (np.random.default_rng(0).random((60, 3, 100)) < 0.05).astype(np.int8)
    begins = np.random.default_rng(1).random((60, 3)) < 0.05
    together, state = [], None
    for row, begin in zip(bits, begins, strict=True):
        actions, state = agent.predict(row, state, begin)
        together.append(actions)
    for k in range(3):
        alone, state = [], None
        for row, begin in zip(bits[:, k], begins[:, k], strict=True):
            action, state = agent.predict(row, state, begin[None])
            assert action.shape == ()
            alone.append(int(action))
        assert alone == np.array(together)[:, k].tolist()
    assert 0 < np.mean(together) < 1


def test_predict_changes_nothing():
    agent = SB3Agent(lively_model("ppo"), TASK, TRACES)
    bits = (np.random.default_rng(0).random((2, 100)) < 0.05).astype(np.int8)
    _, state = agent.predict(bits)
    before = [np.array(part) for part in state[:2]]
    first = agent.predict(bits, state)
    again = agent.predict(bits, state)
    np.testing.assert_array_equal(first[0], again[0])
    for part, copy in zip(state[:2], before, strict=True):
        np.testing.assert_array_equal(part, copy)


def test_senses_that_a_policy_was_not_trained_with_are_refused():
    model = make_rl_agent("ppo", trial_env())
    with pytest.raises(ValueError, match=r"shape \(102,\), these senses show \(100,\)"):
        SB3Agent(model, TASK, RAW)
    with pytest.raises(ValueError, match="decays is empty"):
        Senses(previous_action=True)


@pytest.mark.parametrize(
    ("shape", "message"),
    [((TASK.n_inputs + 3,), "observations must have shape"), ((2, 4), "observations must have"),
     ((3, TASK.n_inputs), "state is that of 2 streams, and there are observations of 3")],
)  # fmt: skip
def test_observations_of_another_task_and_states_of_other_streams_are_refused(shape, message):
    agent = SB3Agent(make_rl_agent("ppo", trial_env()), TASK, TRACES)
    _, state = agent.predict(np.zeros((2, TASK.n_inputs), np.int8))
    with pytest.raises(ValueError, match=message):
        agent.predict(np.zeros(shape, np.int8), state)
