"""What an answer is worth: plain functions, for the environments, and compiled, for kernels."""

from __future__ import annotations

from gnm_env.compiled import compiled

MISTAKES = ("", "noise", "too many", "too few")
"""Names of the mistakes that end a stream, by number; 0 is none."""


def reward_for(error: float, tolerance: float, sign_only: bool) -> float:
    """Reward for an error (owed − given): −|error| or the error's sign; 0 within the tolerance."""
    if abs(error) <= tolerance:
        return 0.0
    if sign_only:
        return 1.0 if error > 0.0 else -1.0
    return -abs(error)


def mistake_in_pattern(count: int, owed: int, last_bin: bool) -> int:
    """Number of the mistake after a bin of an occurrence that has had `count` spikes so far."""
    if count > owed:
        return 2
    return 3 if last_bin and count < owed else 0


compiled_reward_for = compiled(reward_for)
compiled_mistake_in_pattern = compiled(mistake_in_pattern)
