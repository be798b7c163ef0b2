"""Hyperparameters: Stable-Baselines3's algorithms, each with the settings that this task needs.

They stand in `hyperparameters.toml` beside this file. Nothing here is an algorithm:
`make_rl_agent` calls SB3's constructor and gives the last layer a start near silence; the result is
a plain SB3 model with its `learn`, `save` and `predict`.
"""

from __future__ import annotations

import copy
import inspect
import math
import os
import tomllib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from agents.rl.memory import LeakyPolicy, LstmPolicy
from agents.rl.observation import ObservationConfig
from agents.rl.spiking import GnmPolicy, SpikingPolicy
from agents.rl.vec_env import PatternVecEnv
from agents.training.source import DataSource, source_of
from gnm_env.checks import choice, real, whole
from gnm_env.task import Patterns, Task
from gnm_env.trials import Trials

FILE = Path(__file__).with_suffix(".toml")
"""Every kind's hyperparameters: none of them stands in code."""

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    algorithm.__name__: algorithm for algorithm in (PPO, A2C, RecurrentPPO, DQN)
}
OWN_POLICIES: dict[str, type[Any]] = {
    policy.__name__: policy for policy in (LstmPolicy, LeakyPolicy, GnmPolicy, SpikingPolicy)
}
"""Policies that SB3 does not know by name."""

_FALLING = "lin_"


@dataclass(frozen=True)
class Hyperparameters:
    """Those of one kind of agent, from `hyperparameters.toml`.

    Attributes:
        algorithm: SB3's class.
        policy: SB3's name of the policy, or a policy of this package.
        observation: what the policy is shown.
        n_envs: environments side by side.
        settings: keywords of the algorithm, for a number of environments.
    """

    algorithm: type[BaseAlgorithm]
    policy: str | type[Any]
    observation: ObservationConfig
    n_envs: int
    settings: Callable[[int], dict[str, Any]]


def read_hyperparameters(path: str | os.PathLike[str] = FILE) -> dict[str, Hyperparameters]:
    """The kinds of agents that a file describes; its own beginning says how.

    Raises ValueError, naming the kind and what is wrong, if the file is missing or damaged, or says
    what no algorithm takes.
    """
    place = Path(path)
    try:
        kinds = tomllib.loads(place.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"cannot read the hyperparameters {place}: {error.strerror}") from None
    except ValueError as error:
        raise ValueError(f"{place} is no TOML file of hyperparameters: {error}") from None
    made = {}
    for kind, table in kinds.items():
        try:
            made[kind] = _from_table(dict(table))
        except KeyError as error:
            raise ValueError(f"{place}, [{kind}]: {error.args[0]} is missing") from None
        except (TypeError, ValueError) as error:
            raise ValueError(f"{place}, [{kind}]: {error}") from None
    return made


def _from_table(table: dict[str, Any]) -> Hyperparameters:
    name = choice("algorithm", table.pop("algorithm"), tuple(ALGORITHMS))
    policy = table.pop("policy")
    observation = ObservationConfig.of(table.pop("observation"))
    n_envs = whole("n_envs", table.pop("n_envs"), low=1)
    known = inspect.signature(ALGORITHMS[name]).parameters
    unknown = sorted(set(table) - set(known) - {"rollout", "minibatches"})
    if unknown:
        raise ValueError(f"{name} takes no {unknown[0]!r}")

    def settings(n_envs: int) -> dict[str, Any]:
        made: dict[str, Any] = copy.deepcopy(table)
        if "rollout" in made:
            made |= _rollout(n_envs, made.pop("rollout"), made.pop("minibatches", None))
        rate = made["learning_rate"]
        if isinstance(rate, str):
            if not rate.startswith(_FALLING):
                raise ValueError(f'learning_rate must be a number or "lin_0.003", got {rate!r}')
            made["learning_rate"] = LinearSchedule(float(rate.removeprefix(_FALLING)), 0.0, 1.0)
        return made

    settings(n_envs)  # refuses now, not later
    return Hyperparameters(
        ALGORITHMS[name], OWN_POLICIES.get(policy, policy), observation, n_envs, settings
    )


def _rollout(n_envs: int, bins: int, minibatches: int | None) -> dict[str, Any]:
    """Steps per environment for about `bins` bins, and the size of a minibatch if they are cut."""
    if minibatches is None:
        return {"n_steps": max(bins // n_envs, 1)}
    n_steps = minibatches * max(bins // (minibatches * n_envs), 1)
    return {"n_steps": n_steps, "batch_size": n_steps * n_envs // minibatches}


HYPERPARAMETERS: dict[str, Hyperparameters] = read_hyperparameters()


def _chosen(kind: str, observation: ObservationConfig | None) -> Hyperparameters:
    chosen = HYPERPARAMETERS[choice("kind", kind, tuple(HYPERPARAMETERS))]
    return chosen if observation is None else replace(chosen, observation=observation)


def training_env(
    task: Task | Trials,
    patterns: Patterns | None = None,
    kind: str = "ppo",
    *,
    feedback: str = "cost",
    n_envs: int | None = None,
    observation: ObservationConfig | None = None,
) -> VecEnv:
    """PatternTrial environments side by side, as SB3 takes them, seen as `kind` needs it.

    Args:
        task, patterns: the world; or a data set of trials in place of both.
        kind: a key of `HYPERPARAMETERS`.
        feedback: "cost" or "dense", see `PatternTrialEnv`.
        n_envs: their number; None: the kind's.
        observation: what is shown; None: the kind's. `make_rl_agent` has to be told the same.
    """
    chosen = _chosen(kind, observation)
    choice("feedback", feedback, ("cost", "dense"))
    source = source_of(task, patterns)  # refuses what does not belong together
    heard = (
        {"trials": source.data}
        if isinstance(source, DataSource)
        else {"task": task, "patterns": patterns}
    )
    n_envs = chosen.n_envs if n_envs is None else whole("n_envs", n_envs, low=1)
    envs = gym.make_vec(
        "gnm/PatternTrial-v0",
        num_envs=n_envs,
        vectorization_mode="vector_entry_point",
        **heard,
        feedback=feedback,
        autoreset_mode=gym.vector.AutoresetMode.SAME_STEP,
    )
    made: Any = VecMonitor(PatternVecEnv(chosen.observation.wrap(envs)))
    made.observation_config = chosen.observation  # make_rl_agent compares it
    return made


def make_rl_agent(
    kind: str,
    env: gym.Env[Any, Any] | VecEnv,
    seed: int = 0,
    *,
    spike_probability: float = 0.01,
    observation: ObservationConfig | None = None,
    **settings: Any,
) -> BaseAlgorithm:
    """An SB3 model, ready to `learn`, with the settings that this task needs.

    What every kind shares:

    - *A start near silence.* The last layer begins with weights × 0.1 and a bias by which the
      policy spikes with `spike_probability` per bin. A fresh policy spikes in every other bin, a
      hundred times too often: it would first have to unlearn that, from one number per trial.
    - *Synaptic traces*, except for policies with a memory: single bins do not tell a pattern.
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
    - "a2c": the perceptron of "ppo", with one step of the gradient for each 4,096 bins heard and
      none repeated: three times as fast as PPO.
    - "recurrent-ppo": an LSTM on the bits of the present bin and the last action, which has to find
      its own traces; see `agents.rl.memory` for its start.
    - "leaky-ppo": leaky integrators whose decays are learned in the LSTM's place, below a layer of
      64 units: a state-space model, and the traces of "ppo" inside of the policy.
    - "gnm-ppo": a GNM that is the whole policy, by its N weights; see `agents.rl.spiking`.
    - "spiking-ppo": 64 GNMs below a layer of 64 units.
    - "dqn": learns from dense feedback only. Under "cost" the return depends on the number of
      spikes so far, which no trace tells: the values of an observation then are not defined.

    Args:
        kind: a key of `HYPERPARAMETERS`.
        env: `training_env(…)`, or a `gnm/PatternTrial-v0` from `gym.make`, which is wrapped here.
        seed: of the initial weights, of exploration and of the stream.
        spike_probability: at the start, per bin, between 0 and 1. Not for DQN, which begins with
            10,000 random answers to fill its buffer and then prefers silence.
        observation: what it is shown; None: the kind's.
        settings: keywords of SB3's class, which override the kind's.

    Raises:
        ValueError: an unknown kind, a probability outside (0, 1), or an environment that does not
            show what this kind needs or takes amounts for actions.
    """
    chosen = _chosen(kind, observation)
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
    shown = getattr(env, "observation_config", observation)
    floats = np.issubdtype(env.observation_space.dtype, np.floating)
    if shown != observation or observation.raw_bits == floats:
        got = shown if shown != observation else env.observation_space
        raise ValueError(
            f"{kind} needs {observation} as observations, got {got}; "
            f"training_env(task, patterns, {kind!r}) gives them"
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
    if getattr(policy, "starts_near_silence", False):
        return
    is_q = isinstance(model, DQN)
    last = policy.q_net.q_net[-1] if is_q else policy.action_net
    with torch.no_grad():
        last.weight.mul_(0.1)
        last.bias[0] = 0.0
        last.bias[1] = -1.0 if is_q else math.log(probability / (1.0 - probability))
        if is_q:
            policy.q_net_target.load_state_dict(policy.q_net.state_dict())
