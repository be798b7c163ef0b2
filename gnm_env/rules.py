"""The rules of the task, each stated once: what a spike is, what a mistake is, what it is worth.

Plain functions for the environments, the same functions compiled for kernels. `rising`, `too_many`
and `too_few` use nothing but comparisons, so that they serve plain numbers, NumPy arrays and the
values of `agents.simd`, which hold one number for each of many neurons, alike.
"""

from __future__ import annotations

from typing import Any

from gnm_env.compiled import inlined, specialise

MAX_EPISODE_BINS = 10_000
"""Cap of the noisy performance, in bins: `max_episode_steps` of `gnm/PatternStream-v0`."""

RUNS = 100
"""Streams over which the noisy performance is averaged."""

MISTAKES = ("", "noise", "too many", "too few")
"""Names of the mistakes that end a stream, by number; 0 is none."""


def rising(threshold: Any, readout: Any, before: Any) -> Any:
    """Whether a spike falls into the bin: the readout rises to the threshold or above it."""
    return (threshold <= readout) & (before < threshold)


def too_many(given: Any, owed: Any) -> Any:
    """Whether a segment has had more output than it is owed: a mistake at once.

    Amounts, which graded neurons give, stand for the nearest whole number, ½ for the upper one.
    """
    return given >= owed + 0.5


def too_few(given: Any, owed: Any) -> Any:
    """Whether a segment, at its last bin, has had less output than it is owed."""
    return given < owed - 0.5


def mistake(given: float, owed: float, in_noise: bool, last_bin: bool) -> int:
    """Number of the mistake (see MISTAKES) after a bin of a segment that has had `given` so far."""
    if too_many(given, owed):
        return 1 if in_noise else 2
    return 3 if last_bin and too_few(given, owed) else 0


def reward_for(error: float, tolerance: float, sign_only: bool) -> float:
    """Reward for an error (owed − given): −|error| or the error's sign; 0 within the tolerance."""
    if abs(error) <= tolerance:
        return 0.0
    if sign_only:
        return 1.0 if error > 0.0 else -1.0
    return -abs(error)


def dense_reward(
    output: float, given: float, owed: float, in_noise: bool, last_bin: bool, tolerance: float
) -> float:
    """Dense feedback for `output` in a bin of a segment that has had `given` so far, this included.

    −1 at once per output in noise; as a presentation ends, the reward for its error; else 0.
    """
    if in_noise:
        return 0.0 - output
    return reward_for(owed - given, tolerance, False) if last_bin else 0.0


compiled_rising = inlined(rising)
compiled_too_many = inlined(too_many)
compiled_too_few = inlined(too_few)
compiled_reward_for = inlined(reward_for)
compiled_dense_reward = specialise(dense_reward, "compiled", reward_for=compiled_reward_for)

compiled_mistake = specialise(
    mistake, "compiled", too_many=compiled_too_many, too_few=compiled_too_few
)
