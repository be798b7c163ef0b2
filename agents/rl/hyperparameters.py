"""Hyperparameters: Stable-Baselines3's algorithms, each with the settings that this task needs.

Nothing here is an algorithm. `make_rl_agent` calls SB3's constructor and gives the last layer a
start near silence; the result is a plain SB3 model with its `learn`, `save` and `predict`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from sb3_contrib import RecurrentPPO
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from agents.rl.observation import RAW, TRACES, ObservationConfig
from agents.rl.vec_env import PatternVecEnv
from gnm_env.checks import choice, real, whole
from gnm_env.task import Patterns, Task, task_arrays


@dataclass(frozen=True)
class Hyperparameters:
    """Those of one kind of agent.

    Attributes:
        algorithm: SB3's class.
        policy: SB3's name of the policy.
        observation: what the policy is shown.
        n_envs: environments side by side.
        settings: keywords of the algorithm, for a number of environments.
    """

    algorithm: type[BaseAlgorithm]
    policy: str
    observation: ObservationConfig
    n_envs: int
    settings: Callable[[int], dict[str, Any]]


ROLLOUT = 16_384
"""Bins that PPO hears between two updates: 55 to 80 trials, each with one number to learn from."""

MINIBATCHES = 8
"""Parts into which a rollout is cut for stochastic gradient steps."""


def _rollout(n_envs: int, bins: int, minibatches: int) -> dict[str, Any]:
    """Steps per environment and size of a minibatch, for about `bins` bins in equal parts."""
    n_steps = minibatches * max(bins // (minibatches * n_envs), 1)
    return {"n_steps": n_steps, "batch_size": n_steps * n_envs // minibatches}


def _ppo(n_envs: int) -> dict[str, Any]:
    return {
        **_rollout(n_envs, ROLLOUT, MINIBATCHES),
        "n_epochs": 3,
        "learning_rate": LinearSchedule(3e-3, 0.0, 1.0),
        "gamma": 1.0,
        "gae_lambda": 1.0,
        "ent_coef": 0.01,
        "policy_kwargs": {"net_arch": {"pi": [64, 64], "vf": []}},
    }


def _linear(n_envs: int) -> dict[str, Any]:
    return {
        **_ppo(n_envs),
        **_rollout(n_envs, ROLLOUT, MINIBATCHES // 2),
        "learning_rate": LinearSchedule(1e-2, 0.0, 1.0),
        "policy_kwargs": {"net_arch": []},
    }


def _recurrent(n_envs: int) -> dict[str, Any]:
    return {
        **_ppo(n_envs),
        **_rollout(n_envs, 2 * ROLLOUT, 4),
        "n_epochs": 4,
        "learning_rate": LinearSchedule(2e-3, 0.0, 1.0),
        "policy_kwargs": {
            "net_arch": [],
            "lstm_hidden_size": 32,
            "shared_lstm": True,
            "enable_critic_lstm": False,
        },
    }


def _dqn(n_envs: int) -> dict[str, Any]:
    return {
        "learning_rate": LinearSchedule(1e-3, 0.0, 1.0),
        "buffer_size": 200_000,
        "learning_starts": 10_000,
        "batch_size": 256,
        "gamma": 0.99,
        "train_freq": 4,
        "gradient_steps": 4,
        "target_update_interval": 2_000,
        "exploration_initial_eps": 0.02,
        "exploration_final_eps": 0.002,
        "exploration_fraction": 0.5,
        "policy_kwargs": {"net_arch": [64, 64]},
    }


HYPERPARAMETERS: dict[str, Hyperparameters] = {
    "ppo": Hyperparameters(PPO, "MlpPolicy", TRACES, 64, _ppo),
    "ppo-linear": Hyperparameters(PPO, "MlpPolicy", TRACES, 64, _linear),
    "recurrent-ppo": Hyperparameters(RecurrentPPO, "MlpLstmPolicy", RAW, 256, _recurrent),
    "dqn": Hyperparameters(DQN, "MlpPolicy", TRACES, 16, _dqn),
}


def training_env(
    task: Task,
    patterns: Patterns,
    kind: str = "ppo",
    *,
    feedback: str = "cost",
    n_envs: int | None = None,
) -> VecEnv:
    """PatternTrial environments side by side, as SB3 takes them, seen as `kind` needs it.

    Args:
        task, patterns: the world.
        kind: a key of `HYPERPARAMETERS`.
        feedback: "cost" or "dense", see `PatternTrialEnv`.
        n_envs: their number; None: the kind's.
    """
    chosen = HYPERPARAMETERS[choice("kind", kind, tuple(HYPERPARAMETERS))]
    choice("feedback", feedback, ("cost", "dense"))
    task_arrays(task, patterns)  # refuses what does not belong together
    n_envs = chosen.n_envs if n_envs is None else whole("n_envs", n_envs, low=1)
    envs = gym.make_vec(
        "gnm/PatternTrial-v0",
        num_envs=n_envs,
        vectorization_mode="vector_entry_point",
        task=task,
        patterns=patterns,
        feedback=feedback,
        autoreset_mode=gym.vector.AutoresetMode.SAME_STEP,
    )
    return VecMonitor(PatternVecEnv(chosen.observation.wrap(envs)))


def make_rl_agent(
    kind: str,
    env: gym.Env[Any, Any] | VecEnv,
    seed: int = 0,
    *,
    spike_probability: float = 0.01,
    **settings: Any,
) -> BaseAlgorithm:
    """An SB3 model, ready to `learn`, with the settings that this task needs.

    What every kind shares:

    - *A start near silence.* The last layer begins with weights × 0.1 and a bias by which the
      policy spikes with `spike_probability` per bin. A fresh policy spikes in every other bin, a
      hundred times too often: it would first have to unlearn that, from one number per trial.
    - *Synaptic traces*, except for the LSTM: a pattern cannot be told from single bins.
    - *The last action and a trace of the own spikes*: what is owed depends on what was given.
    - *A learning rate that falls to 0*: the score forgives no mistake in 10,000 bins, so the last
      noise of the gradient has to go.

    The kinds:

    - "ppo": a perceptron of 64 × 64 units. γ = 1 and λ = 1: under feedback "cost" the only reward
      comes some hundred bins after the spike that earned it, and of it γ = 0.99 would leave a part
      and λ = 0.95 only what the critic guesses. 16,384 bins per update, since a trial teaches one
      number only. The critic is linear: with λ = 1 it is a mere baseline, no better for hidden
      layers, which would take half of the time. A reward of 0.01 per nat of entropy keeps it from
      settling too early: without it most patterns of two classes are never told apart.
    - "ppo-linear": the same without hidden layers: spikes where a weighted sum of traces is high,
      the nearest relative of the neurons here. With so few weights larger steps are safe.
    - "recurrent-ppo": an LSTM on the raw bits, which has to find its own traces. More environments
      and larger batches, since SB3 walks through its sequences bin by bin.
    - "dqn": learns from dense feedback only. Under "cost" the return depends on the number of
      spikes so far, which no trace tells: the values of an observation then are not defined.

    Args:
        kind: a key of `HYPERPARAMETERS`.
        env: `training_env(…)`, or a `gnm/PatternTrial-v0` from `gym.make`, which is wrapped here.
        seed: of the initial weights, of exploration and of the stream.
        spike_probability: at the start, per bin, between 0 and 1. Not for DQN, which begins with
            10,000 random answers to fill its buffer and then prefers silence.
        settings: keywords of SB3's class, which override the kind's.

    Raises:
        ValueError: an unknown kind, a probability outside (0, 1), or an environment that does not
            show what this kind needs or takes amounts for actions.
    """
    chosen = HYPERPARAMETERS[choice("kind", kind, tuple(HYPERPARAMETERS))]
    p = real("spike_probability", spike_probability, 0.0, 1.0, above=0.0)
    if p == 1.0:
        raise ValueError("spike_probability must be < 1, got 1.0")
    if isinstance(env, gym.Env):
        if env.observation_space.dtype != np.int8:
            raise ValueError(
                f"{kind} shows its own observations of an environment of raw bits, and this one "
                f"gives {env.observation_space}: give it unwrapped"
            )
        _require_spikes(env.action_space)
        env = chosen.observation.wrap(env)
    else:
        _require_observation(env, chosen.observation, kind)
        _require_spikes(env.action_space)
    unknown = sorted(set(settings) - set(inspect.signature(chosen.algorithm).parameters))
    if unknown:
        raise ValueError(f"{chosen.algorithm.__name__} has no setting {unknown[0]!r}")
    n_envs = env.num_envs if isinstance(env, VecEnv) else 1
    keywords = {**chosen.settings(n_envs), "device": "cpu", **settings}
    model = chosen.algorithm(chosen.policy, env, seed=whole("seed", seed, low=0), **keywords)
    _begin_near_silence(model, p)
    # SB3 keeps it in the model's zip; SB3Agent compares it.
    model.observation_config = asdict(chosen.observation)  # type: ignore[attr-defined]
    return model


def n_parameters(model: BaseAlgorithm) -> int:
    """Number of trainable parameters: the critic's are among them, DQN's target network is not."""
    policy: Any = model.policy
    trained = policy.q_net if isinstance(model, DQN) else policy
    return sum(p.numel() for p in trained.parameters() if p.requires_grad)


def _require_observation(env: Any, observation: ObservationConfig, kind: str) -> None:
    if not isinstance(env, VecEnv):
        hint = "; training_env makes one" if isinstance(env, VectorEnv) else ""
        raise ValueError(
            f"env must be a Gymnasium Env or an SB3 VecEnv, got {type(env).__name__}{hint}"
        )
    if observation.raw_bits == np.issubdtype(env.observation_space.dtype, np.floating):
        raise ValueError(
            f"{kind} needs {'the raw bits' if observation.raw_bits else 'traces'} as observations, "
            f"got {env.observation_space}; training_env(task, patterns, {kind!r}) gives them"
        )


def _require_spikes(action_space: gym.Space[Any]) -> None:
    if action_space != gym.spaces.Discrete(2):
        raise ValueError(
            f"agents answer with spikes, so the actions must be Discrete(2), got {action_space}; "
            'make the environment with output="spikes"'
        )


def _begin_near_silence(model: BaseAlgorithm, probability: float) -> None:
    """Last layer × 0.1, its bias by the wanted probability, or by the price of a spike in noise."""
    policy: Any = model.policy
    is_q = isinstance(model, DQN)
    last = policy.q_net.q_net[-1] if is_q else policy.action_net
    with torch.no_grad():
        last.weight.mul_(0.1)
        last.bias[0] = 0.0
        last.bias[1] = -1.0 if is_q else math.log(probability / (1.0 - probability))
        if is_q:
            policy.q_net_target.load_state_dict(policy.q_net.state_dict())
