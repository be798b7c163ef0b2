"""The score of any agent on a level: bins survived on the streams that belong to it.

An agent is whatever answers bins: a neuron of this package, an SB3 model that hears bits, an object
with `act`, or a function. All are scored on the same streams, by the same count.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.evaluation import noisy_performance
from agents.policy import Policy
from gnm_env.checks import shown, whole
from gnm_env.levels import Level, suite
from gnm_env.results import Recorder
from gnm_env.stream_task.env import PatternStreamEnv

BEGINS = ("begin_trial", "begin_episode", "reset")
"""What an agent with `act` may have, to be called without arguments before each stream."""


def score(
    agent: Any,
    level: str | Level,
    pattern_seed: int,
    *,
    recorder: Recorder | None = None,
    heard: int | None = None,
) -> NDArray[np.int64]:
    """Bins survived on each stream of a level and pattern seed, int64 (100,), learning off.

    Args:
        agent: an agent of this package; anything with Stable-Baselines3's `predict` that hears the
            bits; anything with `act(bits) → 0 or 1`, and with `begin_trial()`, `begin_episode()` or
            `reset()` where it has a memory to clear; or such a function alone. Bits are int8 (N,).
        level: name or id, or the level.
        pattern_seed: of the patterns that the agent knows.
        recorder: also entered there.
        heard: bins that it heard in training, where `recorder` did not count them.

    Raises:
        ValueError: for no agent, an unknown level, a recorder of another training, or an answer
            that is no spike.
    """
    on = suite()[level.name if isinstance(level, Level) else level]
    pattern_seed = whole("pattern seed", pattern_seed, low=0)
    if recorder is not None:
        if (recorder.level, recorder.pattern_seed) != (on, pattern_seed):
            raise ValueError(
                f"the recorder is that of level {recorder.level.name}, pattern seed "
                f"{recorder.pattern_seed}, and the score is on {on.name}, {pattern_seed}"
            )
        recorder.pause()
    survived = _survived(agent, on, pattern_seed)
    if recorder is not None:
        recorder.enter(survived, heard=heard)
    return survived


def _survived(agent: Any, level: Level, pattern_seed: int) -> NDArray[np.int64]:
    patterns, seed = level.patterns(pattern_seed), level.evaluation_seed(pattern_seed)
    runs, cap = suite().runs, suite().cap
    if hasattr(agent, "group_key") or isinstance(agent, Policy):
        return noisy_performance(agent, level.task, patterns, runs, cap, seed)
    act, begin = _acting(agent)
    env = PatternStreamEnv(level.task, patterns)
    return np.array([_survive(act, begin, env, seed + k, cap) for k in range(runs)])


def _acting(agent: Any) -> tuple[Callable[[Any], Any], Callable[[], Any]]:
    """What answers one bin, and what is called before a stream."""
    act = getattr(agent, "act", agent)
    if isinstance(agent, type) or not callable(act):
        raise ValueError(
            "an agent must have predict(observation, state, episode_start, deterministic) or "
            f"act(bits), or be a function of the bits, got {shown(agent)}"
        )
    for name in BEGINS:
        if callable(getattr(agent, name, None)):
            return act, getattr(agent, name)
    return act, lambda: None


def _survive(
    act: Callable[[Any], Any], begin: Callable[[], Any], env: PatternStreamEnv, seed: int, cap: int
) -> int:
    """Bins survived on the stream of one seed, answered bin by bin."""
    bits, _ = env.reset(seed=seed)
    begin()
    for survived in range(cap):
        bits, _, mistaken, _, _ = env.step(act(bits))
        if mistaken:
            return survived
    return cap
