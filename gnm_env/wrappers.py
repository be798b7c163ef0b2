"""Wrappers: synaptic traces as observations, spikes as rising edges, seeds for every episode.

A raw observation is the input of one bin, and the task cannot be solved from single bins: an agent
without a memory of its own needs one in its observation. Each wrapper has a twin for vector
environments, which does the same, environment by environment and bit by bit.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import real, whole
from gnm_env.compiled import compiled

__all__ = [
    "RisingEdge",
    "SeededEpisodes",
    "SynapticTrace",
    "VectorRisingEdge",
    "VectorSynapticTrace",
]


class Traces:
    """Synaptic traces of n environments side by side; what `SynapticTrace` and its twin share.

    Attributes:
        values: float32 (n, k·N + extras), the traces after the last bin. Rewritten in place.
        space: the space of one row.
    """

    def __init__(
        self,
        n_envs: int,
        input_space: spaces.Space[Any],
        rate: float,
        decays: ArrayLike,
        scale: float,
        previous_action: bool,
        own_decay: float | None,
    ) -> None:
        if not isinstance(input_space, spaces.Box) or len(input_space.shape) != 1:
            raise ValueError(f"SynapticTrace needs a Box of shape (N,) to trace, got {input_space}")
        alphas = np.array(
            [real("decays", float(d), 0.0, 1.0, above=0.0) for d in np.atleast_1d(decays)]
        )
        if alphas.size == 0:
            raise ValueError("decays must hold at least one decay, got none")
        scale = real("scale", scale, above=0.0)
        own = [1.0] if previous_action else []
        if own_decay is not None:
            own.append(real("own_decay", own_decay, 0.0, 1.0, above=0.0))
        # x is a sum of independent bits, each weighted by its age: Var x = p(1−p) / (1 − (1−α)²).
        # Where every bit is sure (p = 0 or 1) there is no variance to go by.
        bit = np.sqrt(rate * (1.0 - rate)) or 1.0
        jumps = scale * np.sqrt(1.0 - (1.0 - alphas) ** 2) / bit
        self._keep = (1.0 - alphas).astype(np.float32)
        self._jump = jumps.astype(np.float32)
        self._own_keep = np.float32(1.0) - np.array(own, np.float32)
        n_inputs = input_space.shape[0]
        self.values = np.zeros((n_envs, alphas.size * n_inputs + len(own)), np.float32)
        # The geometric sum of a spike in every bin; a little more, for the rounding of long sums.
        highest = np.concatenate(
            [np.repeat(jumps / alphas, n_inputs), 1.0 / np.array(own, np.float64)]
        )
        self.space = spaces.Box(
            np.float32(0.0), (1.001 * highest).astype(np.float32), dtype=np.float32
        )

    def start(self, bits: NDArray[Any], which: NDArray[np.bool_] | None = None) -> None:
        """Begin episodes with the inputs `bits` (n, N) where `which` (n,) is set; None: all."""
        self.values[slice(None) if which is None else which] = 0.0
        self.follow(bits, np.zeros(len(bits), np.int64), which)

    def follow(
        self,
        bits: NDArray[Any],
        actions: NDArray[np.int64],
        which: NDArray[np.bool_] | None = None,
    ) -> None:
        """One bin on: the `actions` (n,) just taken, then the inputs `bits` (n, N)."""
        mask = np.ones(len(bits), np.bool_) if which is None else which
        _follow(self.values, mask, self._keep, self._jump, self._own_keep, bits, actions)


@compiled
def _follow(
    values: NDArray[np.float32],
    which: NDArray[np.bool_],
    keep: NDArray[np.float32],
    jump: NDArray[np.float32],
    own_keep: NDArray[np.float32],
    bits: NDArray[Any],
    actions: NDArray[np.int64],
) -> None:
    """x <- (1−α) x + s for every trace, scaled; the own spikes' y <- (1−α) y + action."""
    n_inputs = bits.shape[1]
    for env in range(values.shape[0]):
        if not which[env]:
            continue
        for k in range(keep.size):
            row = values[env, k * n_inputs : (k + 1) * n_inputs]
            for i in range(n_inputs):
                row[i] = keep[k] * row[i] + jump[k] * np.float32(bits[env, i])
        for k in range(own_keep.size):
            own = keep.size * n_inputs + k
            values[env, own] = own_keep[k] * values[env, own] + np.float32(actions[env])


def _require_spikes(
    action_space: spaces.Space[Any], previous_action: bool, own_decay: float | None
) -> None:
    """ValueError if own spikes are to be shown and the actions are not spikes."""
    if (previous_action or own_decay is not None) and action_space != spaces.Discrete(2):
        raise ValueError(
            "previous_action and own_decay trace spikes, so the actions must be Discrete(2), "
            f"got {action_space}; leave both out"
        )


def _rate(env: Any) -> float:
    """Spike probability of the inputs, as the environment's task says."""
    task = getattr(env.unwrapped, "task", None)
    if task is None and isinstance(env, VectorEnv):
        # Gymnasium's own vector environments keep their parts to themselves.
        parts = getattr(env.unwrapped, "envs", None)
        task = getattr(parts[0].unwrapped, "task", None) if parts else None
    if task is None:
        raise ValueError(
            f"SynapticTrace needs the rate of the inputs, and {env.unwrapped} has no task to tell "
            "it: give rate=<spike probability per channel and bin>"
        )
    return float(task.rate)


class SynapticTrace(gym.Wrapper[NDArray[np.float32], Any, Any, Any], RecordConstructorArgs):
    """Observe synaptic traces instead of bits: x(t) = (1−α) x(t−1) + s(t), per channel.

    Traces start at 0 in every episode and are scaled to standard deviation `scale` under noise:
    x·scale / sqrt(p(1−p) / (1−(1−α)²)). The observation is float32 (k·N + extras,): the N traces of
    the first decay, of the second, …, then the previous action, then the own-spike trace.

    What the agent may know stays what the environment tells it: the past of its inputs and its own
    past answers.

    Args:
        env: an environment with binary observations of shape (N,).
        decays: α of each trace, in (0, 1]; 1 gives the bits themselves, scaled.
        scale: standard deviation of a trace under noise.
        previous_action: append the action of the bin before (0 in the first bin).
        own_decay: if given, append the trace y(t) = (1−own_decay) y(t−1) + action(t−1) of the
            agent's own spikes, unscaled.
        rate: spike probability p per channel and bin. None: that of the environment's task.

    Raises:
        ValueError: a decay outside (0, 1], scale <= 0, observations that are not a row, a rate
            that nobody knows, or own spikes to be traced where actions are amounts.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        decays: ArrayLike = (0.3,),
        scale: float = 1.0,
        previous_action: bool = False,
        own_decay: float | None = None,
        rate: float | None = None,
    ) -> None:
        RecordConstructorArgs.__init__(
            self,
            decays=decays,
            scale=scale,
            previous_action=previous_action,
            own_decay=own_decay,
            rate=rate,
        )
        gym.Wrapper.__init__(self, env)
        _require_spikes(env.action_space, previous_action, own_decay)
        p = _rate(env) if rate is None else real("rate", rate, low=0.0, high=1.0)
        self._traces = Traces(
            1, env.observation_space, p, decays, scale, previous_action, own_decay
        )
        self.observation_space = self._traces.space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        bits, info = self.env.reset(seed=seed, options=options)
        self._traces.start(np.atleast_2d(bits))
        return self._traces.values[0].copy(), info

    def step(self, action: Any) -> tuple[NDArray[np.float32], Any, bool, bool, dict[str, Any]]:
        bits, reward, terminated, truncated, info = self.env.step(action)
        self._traces.follow(np.atleast_2d(bits), np.asarray(action, np.int64).reshape(1))
        return self._traces.values[0].copy(), reward, terminated, truncated, info


class VectorSynapticTrace(
    VectorWrapper[NDArray[np.float32], Any, Any, Any, Any], RecordConstructorArgs
):
    """`SynapticTrace` for vector environments: same arguments, in each environment the same bits.

    Observations are float32 (n, k·N + extras), a new array at each step. Follows every autoreset
    mode; under SAME_STEP the `final_obs` in `infos` are traces too.
    """

    def __init__(
        self,
        env: VectorEnv[Any, Any, Any],
        decays: ArrayLike = (0.3,),
        scale: float = 1.0,
        previous_action: bool = False,
        own_decay: float | None = None,
        rate: float | None = None,
    ) -> None:
        RecordConstructorArgs.__init__(
            self,
            decays=decays,
            scale=scale,
            previous_action=previous_action,
            own_decay=own_decay,
            rate=rate,
        )
        VectorWrapper.__init__(self, env)
        _require_spikes(env.single_action_space, previous_action, own_decay)
        p = _rate(env) if rate is None else real("rate", rate, low=0.0, high=1.0)
        self._traces = Traces(
            env.num_envs,
            env.single_observation_space,
            p,
            decays,
            scale,
            previous_action,
            own_decay,
        )
        self.single_observation_space = self._traces.space
        self.observation_space = batch_space(self._traces.space, env.num_envs)
        self._mode = _autoreset_mode(env)
        self._over = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        which = _reset_mask(options)
        bits, infos = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        self._traces.start(bits, which)
        self._over[slice(None) if which is None else which] = False
        return self._traces.values.copy(), infos

    def step(self, actions: Any) -> tuple[NDArray[np.float32], Any, Any, Any, dict[str, Any]]:
        bits, rewards, terminated, truncated, infos = self.env.step(actions)
        taken = np.asarray(actions, np.int64).ravel()
        over = terminated | truncated
        if self._mode == AutoresetMode.SAME_STEP and over.any():
            infos = self._finish(bits, taken, over, infos)
        else:
            self._traces.follow(bits, taken)
        if self._mode == AutoresetMode.NEXT_STEP:
            if self._over.any():
                self._traces.start(bits, self._over)
            self._over = over
        return self._traces.values.copy(), rewards, terminated, truncated, infos

    def _finish(
        self,
        bits: NDArray[Any],
        taken: NDArray[np.int64],
        over: NDArray[np.bool_],
        infos: dict[str, Any],
    ) -> dict[str, Any]:
        """Follow the last bin of the episodes that are over, then start the new ones."""
        last = np.array(bits)
        for env in np.flatnonzero(over):
            last[env] = infos["final_obs"][env]
        self._traces.follow(last, taken)
        final = np.full(len(bits), None, dtype=object)
        for env in np.flatnonzero(over):
            final[env] = self._traces.values[env].copy()
        self._traces.start(bits, over)
        return {**infos, "final_obs": final}


def _autoreset_mode(env: VectorEnv[Any, Any, Any]) -> AutoresetMode:
    mode = env.metadata.get("autoreset_mode")
    if not isinstance(mode, AutoresetMode):
        raise ValueError(
            "the vector environment's metadata['autoreset_mode'] must be a "
            f"gymnasium.vector.AutoresetMode, got {mode!r}"
        )
    return mode


def _reset_mask(options: dict[str, Any] | None) -> NDArray[np.bool_] | None:
    """The environments that a partial reset begins anew; None means all."""
    mask = (options or {}).get("reset_mask")
    return None if mask is None else np.array(mask, np.bool_)


class RisingEdge(gym.Wrapper[Any, int, Any, Any], RecordConstructorArgs):
    """The action is a level, 0 or 1; a spike is its rise from 0 to 1, the level before being 0.

    A policy that stays "on" while it sees a pattern so spikes once, as does a neuron whose
    potential stays above its threshold. Put it around `SynapticTrace` and the traces are of the
    spikes, inside it and they are of the levels.

    Raises ValueError unless the action space is Discrete(2).
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        _require_two_actions(env.action_space)
        self._level = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        self._level = 0
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        if not self.action_space.contains(np.int64(action)):
            raise ValueError(f"action must be 0 or 1, got {action!r}")
        level, before = int(action), self._level
        self._level = level
        return self.env.step(int(level > before))


class VectorRisingEdge(VectorWrapper[Any, NDArray[Any], Any, Any, Any], RecordConstructorArgs):
    """`RisingEdge` for vector environments."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        VectorWrapper.__init__(self, env)
        _require_two_actions(env.single_action_space)
        self._mode = _autoreset_mode(env)
        self._levels = np.zeros(env.num_envs, np.int64)
        self._over = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        which = _reset_mask(options)
        self._levels[slice(None) if which is None else which] = 0
        self._over[slice(None) if which is None else which] = False
        return self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        levels = np.array(actions, np.int64).ravel()
        if not self.action_space.contains(levels):
            raise ValueError(f"actions must be {self.num_envs} levels of 0 or 1, got {actions!r}")
        observations, rewards, terminated, truncated, infos = self.env.step(
            np.where(levels > self._levels, 1, 0)
        )
        over = terminated | truncated
        # A new episode begins with level 0: at once, or at the step after, whose action is ignored.
        begun = over if self._mode == AutoresetMode.SAME_STEP else self._over
        self._levels = np.where(begun, 0, levels)
        self._over = over
        return observations, rewards, terminated, truncated, infos


def _require_two_actions(space: spaces.Space[Any]) -> None:
    if not (isinstance(space, spaces.Discrete) and space.n == 2 and space.start == 0):
        raise ValueError(f"RisingEdge needs the action space Discrete(2), got {space}")


class SeededEpisodes(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Seed the k-th reset (from 0) with `seed` + k, whatever seed it is called with.

    Loops that seed the first episode only, like Stable-Baselines3's `evaluate_policy`, so hear the
    very streams that `agents.noisy_performance(…, seed=seed)` counts.
    """

    def __init__(self, env: gym.Env[Any, Any], seed: int) -> None:
        RecordConstructorArgs.__init__(self, seed=seed)
        gym.Wrapper.__init__(self, env)
        self._next_seed = whole("seed", seed, low=0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        self._next_seed += 1
        return self.env.reset(seed=self._next_seed - 1, options=options)
