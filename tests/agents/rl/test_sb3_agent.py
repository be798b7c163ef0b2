"""An SB3 model in a neuron's place: the same streams, the same scores, the same observations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv

from agents import GNM, AggregateLabel, NeuronAgent, answers, noisy_performance, train_many
from agents.policy import PolicyBatch
from agents.rl import (
    HYPERPARAMETERS,
    RAW,
    TRACES,
    ObservationConfig,
    SB3Agent,
    make_rl_agent,
    training_env,
)
from agents.training.source import TaskSource
from gnm_env import Patterns, Task, Trials
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
    agent = SB3Agent(lively_model(kind), TASK, HYPERPARAMETERS[kind].observation)
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
    config = ObservationConfig(
        decays=(0.3, 0.1), previous_action=True, own_decay=0.2, rising_edge=True
    )
    recorder = Recorder()
    agent = SB3Agent(recorder, TASK, config)
    wrapped, bare = config.wrap(trial_env()), trial_env()
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
    agent = SB3Agent(lively_model(kind), TASK, HYPERPARAMETERS[kind].observation)
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


def test_observations_that_a_policy_was_not_trained_on_are_refused():
    model = make_rl_agent("ppo", trial_env())
    with pytest.raises(ValueError, match="the policy was trained on ObservationConfig"):
        SB3Agent(model, TASK, RAW)
    del model.observation_config  # a model of one's own: its space tells
    with pytest.raises(ValueError, match=r"shape \(102,\), .* shows \(100,\)"):
        SB3Agent(model, TASK, RAW)


@pytest.mark.parametrize("told", [True, False], ids=["by its config", "by its space"])
@pytest.mark.parametrize("other", [{"scale": 1.0}, {"decays": (0.2,)}, {"own_decay": 0.2}], ids=str)
def test_a_policy_trained_at_another_scale_or_decay_is_refused(
    told: bool, other: dict[str, Any]
) -> None:
    """The shapes are the same, and the score would be that of silence."""
    model = make_rl_agent("ppo", trial_env())
    if not told:
        del model.observation_config
    with pytest.raises(ValueError, match="the policy was trained on"):
        SB3Agent(model, TASK, replace(TRACES, **other))
    assert SB3Agent(model, TASK, TRACES).observation == TRACES


def test_a_policy_that_says_what_it_was_trained_on_need_not_be_told() -> None:
    assert SB3Agent(make_rl_agent("ppo", trial_env()), TASK).observation == TRACES
    assert SB3Agent(make_rl_agent("recurrent-ppo", trial_env()), TASK).observation == (
        HYPERPARAMETERS["recurrent-ppo"].observation
    )
    assert SB3Agent(Recorder(), TASK).observation == RAW


def test_a_policy_hears_a_data_set_as_it_heard_it_in_training() -> None:
    trials = Trials.draw(TASK, PATTERNS, 8, seed=3)
    env = training_env(trials, kind="ppo", n_envs=2)
    agent = SB3Agent(make_rl_agent("ppo", env), trials)
    assert agent.rate == trials.rates.mean()
    assert answers(agent, trials).trials == 8
    env.close()
    with pytest.raises(ValueError, match="takes the place of task and patterns"):
        training_env(trials, PATTERNS)


@pytest.mark.parametrize("policy", [None, 3, "x", {}, Recorder], ids=str)
def test_what_cannot_predict_is_no_policy(policy: Any) -> None:
    with pytest.raises(ValueError, match="policy must be an SB3 model, or anything with its"):
        SB3Agent(policy, TASK)


@pytest.mark.parametrize("task", [None, 3, {}, PATTERNS], ids=str)
def test_a_policy_needs_the_task_that_it_was_trained_on(task: Any) -> None:
    with pytest.raises(ValueError, match=r"task must be the gnm_env.Task"):
        SB3Agent(Recorder(), task)


@pytest.mark.parametrize("config", [3, "x", {}, {"decays": (), "bogus": 1}])
def test_what_is_shown_must_be_an_observation_config(config: Any) -> None:
    with pytest.raises(ValueError, match="an observation config must be an ObservationConfig"):
        SB3Agent(Recorder(), TASK, config)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.full(100, 0.5),), "an observation must hold the bits of a bin"),
        ((["a"] * 100,), "an observation must hold the bits of a bin"),
        (([[0], [1, 0]],), "an observation must hold the bits of a bin"),
        ((np.zeros((2, 100), np.int8), 3), "state must be what predict returned, or None"),
        ((np.zeros((2, 100), np.int8), (1, 2, 3)), "state must be what predict returned, or None"),
        ((np.zeros((2, 100), np.int8), None, [True]), "episode_start must have shape"),
        ((np.zeros((2, 100), np.int8), None, "x"), "episode_start must be True or False"),
    ],
)
def test_predict_refuses_what_it_cannot_answer(arguments: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SB3Agent(Recorder(), TASK, TRACES).predict(*arguments)


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
