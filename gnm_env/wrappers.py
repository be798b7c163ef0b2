"""Wrappers: synaptic traces as observations, spikes as rising edges, seeds for every episode.

A raw observation is the input of one bin, and the task cannot be solved from single bins: an agent
without a memory of its own needs one in its observation. Each wrapper has a twin for vector
environments, which does the same, environment by environment and bit by bit.
"""

from __future__ import annotations

import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from gnm_env.base.env import array_of, spike_from
from gnm_env.checks import real, require_memory, shown, whole
from gnm_env.compiled import compiled

__all__ = [
    "RisingEdge",
    "SeededEpisodes",
    "SynapticTrace",
    "VectorRisingEdge",
    "VectorSynapticTrace",
]


TRACE_SCALE = 1 / 3
"""Standard deviation of a trace under noise, unless told otherwise: the one that Adam learns at."""

MAX_DECAYS = 1_000
"""Most traces of one channel."""


@dataclass(frozen=True)
class TraceParams:
    """What synaptic traces are made from: the arguments of `SynapticTrace`; checks itself."""

    decays: ArrayLike
    scale: float
    previous_action: bool
    own_decay: float | None
    rate: float | None

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("decays", _checked_decays(self.decays))
        put("scale", real("scale", self.scale, above=0.0))
        if not isinstance(self.previous_action, (bool, np.bool_)):
            raise ValueError(
                f"previous_action must be True or False, got {shown(self.previous_action)}"
            )
        if self.own_decay is not None:
            put("own_decay", real("own_decay", self.own_decay, 0.0, 1.0, above=0.0))
        if self.rate is not None:
            put("rate", real("rate", self.rate, low=0.0, high=1.0))

    @property
    def own(self) -> list[float]:
        """Decays of the traces of the agent's own spikes; the previous action has decay 1."""
        own = [1.0] if self.previous_action else []
        return own if self.own_decay is None else [*own, self.own_decay]


def _checked_decays(decays: Any) -> tuple[float, ...]:
    """One decay or a row of them as floats in (0, 1], or ValueError."""
    if isinstance(decays, np.ndarray):
        decays = decays.tolist()
    if isinstance(decays, numbers.Real):
        decays = [decays]
    if not isinstance(decays, Sequence) or isinstance(decays, (str, bytes)):
        raise ValueError(f"decays must be a number or a row of numbers, got {shown(decays)}")
    whole("the number of decays, at least one decay,", len(decays), low=1, high=MAX_DECAYS)
    return tuple(real("decays", decay, 0.0, 1.0, above=0.0) for decay in decays)


class Traces:
    """Synaptic traces of n environments side by side; what `SynapticTrace` and its twin share.

    Attributes:
        values: float32 (n, k·N + extras), the traces after the last bin. Rewritten in place.
        space: the space of one row.
    """

    def __init__(
        self, n_envs: int, input_space: spaces.Space[Any], rate: float, params: TraceParams
    ) -> None:
        if not isinstance(input_space, spaces.Box) or len(input_space.shape) != 1:
            raise ValueError(f"SynapticTrace needs a Box of shape (N,) to trace, got {input_space}")
        alphas = np.array(params.decays)
        own = np.array(params.own, np.float64)
        # x is a sum of independent bits, each weighted by its age: Var x = p(1−p) / (1 − (1−α)²).
        # Where every bit is sure (p = 0 or 1) there is no variance to go by.
        bit = np.sqrt(rate * (1.0 - rate)) or 1.0
        with np.errstate(over="ignore", under="ignore"):
            jumps = params.scale * np.sqrt(1.0 - (1.0 - alphas) ** 2) / bit
            # The geometric sum of a spike in every bin; a little more, for the rounding of long
            # sums.
            highest = np.concatenate(
                [np.repeat(jumps / alphas, input_space.shape[0]), 1.0 / own]
            ) * np.float64(1.001)
            self._jump = jumps.astype(np.float32)
            bound = highest.astype(np.float32)
        if not (np.isfinite(bound).all() and (self._jump >= np.finfo(np.float32).tiny).all()):
            raise ValueError(
                "traces must fit into float32, got up to "
                f"{highest.max():.3g} at scale = {params.scale:g} and rate = {rate:g}: "
                "choose a scale nearer to 1, or decays and a rate further from 0"
            )
        self._keep = (1.0 - alphas).astype(np.float32)
        self._own_keep = np.float32(1.0) - own.astype(np.float32)
        width = alphas.size * input_space.shape[0] + len(own)
        require_memory(
            f"{n_envs:,} rows of {width:,} traces", 8.0 * n_envs * width, "use fewer decays"
        )
        self.values = np.zeros((n_envs, width), np.float32)
        self.space = spaces.Box(np.float32(0.0), bound, dtype=np.float32)

    def taken(self, actions: Any) -> NDArray[np.int64]:
        """The actions (n,) as spikes; where they are not traced they may be amounts of any size."""
        if len(self._own_keep) == 0:
            return np.zeros(len(self.values), np.int64)
        return np.asarray(actions, np.int64).reshape(len(self.values))

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


def _traces_of(env: Any, n_envs: int, params: TraceParams) -> Traces:
    """Traces for `env`, single or vector; ValueError if it has nothing to be traced."""
    single = isinstance(env, gym.Env)
    actions = env.action_space if single else env.single_action_space
    if params.own and actions != spaces.Discrete(2):
        raise ValueError(
            "previous_action and own_decay trace spikes, so the actions must be Discrete(2), "
            f"got {actions}; leave both out"
        )
    rate = _rate(env) if params.rate is None else params.rate
    inputs = env.observation_space if single else env.single_observation_space
    return Traces(n_envs, inputs, rate, params)


def _require(env: Any, kind: type) -> None:
    """ValueError unless `env` is an environment of that kind."""
    if not isinstance(env, kind):
        raise ValueError(
            f"env must be a gymnasium {kind.__name__}, got {shown(env)}; "
            "use gymnasium.make, or make_vec for the Vector wrappers"
        )


def _rate(env: Any) -> float:
    """Spike probability of the inputs, as the environment's task or data set says."""
    source: Any = env.unwrapped
    if isinstance(source, VectorEnv) and getattr(source, "envs", None):
        # Gymnasium's own vector environments keep their parts to themselves.
        source = source.envs[0].unwrapped  # type: ignore[attr-defined]
    task, trials = getattr(source, "task", None), getattr(source, "trials", None)
    if task is not None:
        return float(task.rate)
    if trials is None:
        raise ValueError(
            f"SynapticTrace needs the rate of the inputs, and {env.unwrapped} has no task to tell "
            "it: give rate=<spike probability per channel and bin>"
        )
    return float(trials.rates.mean())


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
        scale: standard deviation of a trace under noise; ⅓ unless told otherwise.
        previous_action: append the action of the bin before (0 in the first bin).
        own_decay: if given, append the trace y(t) = (1−own_decay) y(t−1) + action(t−1) of the
            agent's own spikes, unscaled.
        rate: spike probability p per channel and bin. None: that of the environment's task, or the
            mean of its data set.

    Raises:
        ValueError: a decay outside (0, 1], more than MAX_DECAYS of them, scale <= 0, traces that
            float32 cannot hold, observations that are not a row, a rate that nobody knows, or own
            spikes to be traced where actions are amounts.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        decays: ArrayLike = (0.3,),
        scale: float = TRACE_SCALE,
        previous_action: bool = False,
        own_decay: float | None = None,
        rate: float | None = None,
    ) -> None:
        _require(env, gym.Env)
        params = TraceParams(decays, scale, previous_action, own_decay, rate)
        RecordConstructorArgs.__init__(
            self,
            decays=decays,
            scale=scale,
            previous_action=previous_action,
            own_decay=own_decay,
            rate=rate,
        )
        gym.Wrapper.__init__(self, env)
        self._traces = _traces_of(env, 1, params)
        self.observation_space = self._traces.space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        bits, info = self.env.reset(seed=seed, options=options)
        self._traces.start(np.atleast_2d(bits))
        return self._traces.values[0].copy(), info

    def step(self, action: Any) -> tuple[NDArray[np.float32], Any, bool, bool, dict[str, Any]]:
        bits, reward, terminated, truncated, info = self.env.step(action)
        self._traces.follow(np.atleast_2d(bits), self._traces.taken(action))
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
        scale: float = TRACE_SCALE,
        previous_action: bool = False,
        own_decay: float | None = None,
        rate: float | None = None,
    ) -> None:
        _require(env, VectorEnv)
        params = TraceParams(decays, scale, previous_action, own_decay, rate)
        RecordConstructorArgs.__init__(
            self,
            decays=decays,
            scale=scale,
            previous_action=previous_action,
            own_decay=own_decay,
            rate=rate,
        )
        VectorWrapper.__init__(self, env)
        self._traces = _traces_of(env, env.num_envs, params)
        self.single_observation_space = self._traces.space
        self.observation_space = batch_space(self._traces.space, env.num_envs)
        self._mode = _autoreset_mode(env)
        self._done = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        which = _reset_mask(options)
        bits, infos = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        self._traces.start(bits, which)
        self._done[slice(None) if which is None else which] = False
        return self._traces.values.copy(), infos

    def step(self, actions: Any) -> tuple[NDArray[np.float32], Any, Any, Any, dict[str, Any]]:
        bits, rewards, terminated, truncated, infos = self.env.step(actions)
        taken = self._traces.taken(actions)
        over = terminated | truncated
        if self._mode == AutoresetMode.SAME_STEP and over.any():
            infos = self._finish(bits, taken, over, infos)
        else:
            self._traces.follow(bits, taken)
        if self._mode == AutoresetMode.NEXT_STEP:
            if self._done.any():
                self._traces.start(bits, self._done)
            self._done = over
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
    """The environments that a partial reset begins anew; None means all.

    A copy, taken before the environment looks at the options: Gymnasium's takes the mask out of
    them. What is no mask the environment refuses.
    """
    mask = options.get("reset_mask") if isinstance(options, Mapping) else None
    return mask.astype(np.bool_) if isinstance(mask, np.ndarray) else None


class RisingEdge(gym.Wrapper[Any, int, Any, Any], RecordConstructorArgs):
    """The action is a level, 0 or 1; a spike is its rise from 0 to 1, the level before being 0.

    A policy that stays "on" while it sees a pattern so spikes once, as does a neuron whose
    potential stays above its threshold. Put it around `SynapticTrace` and the traces are of the
    spikes, inside it and they are of the levels.

    Raises ValueError unless the action space is Discrete(2).
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        _require(env, gym.Env)
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
        level, before = spike_from(action), self._level
        self._level = level
        return self.env.step(int(level > before))


class VectorRisingEdge(VectorWrapper[Any, NDArray[Any], Any, Any, Any], RecordConstructorArgs):
    """`RisingEdge` for vector environments."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        _require(env, VectorEnv)
        RecordConstructorArgs.__init__(self)
        VectorWrapper.__init__(self, env)
        _require_two_actions(env.single_action_space)
        self._mode = _autoreset_mode(env)
        self._levels = np.zeros(env.num_envs, np.int64)
        self._done = np.zeros(env.num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        which = _reset_mask(options)
        begun = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        self._levels[slice(None) if which is None else which] = 0
        self._done[slice(None) if which is None else which] = False
        return begun

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        levels = array_of(actions)
        if (
            levels.dtype.kind not in "iub"
            or levels.shape != (self.num_envs,)
            or ((levels != 0) & (levels != 1)).any()
        ):
            raise ValueError(
                f"actions must be {self.num_envs} levels of 0 or 1, got {shown(actions)}"
            )
        levels = levels.astype(np.int64)
        observations, rewards, terminated, truncated, infos = self.env.step(
            np.where(levels > self._levels, 1, 0)
        )
        over = terminated | truncated
        # A new episode begins with level 0: at once, or at the step after, whose action is ignored.
        begun = over if self._mode == AutoresetMode.SAME_STEP else self._done
        self._levels = np.where(begun, 0, levels)
        self._done = over
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
        _require(env, gym.Env)
        self._next_seed = whole("seed", seed, low=0)
        RecordConstructorArgs.__init__(self, seed=seed)
        gym.Wrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        self._next_seed += 1
        return self.env.reset(seed=self._next_seed - 1, options=options)
