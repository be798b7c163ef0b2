"""Score anything that has Stable-Baselines3's `predict` on the streams that score the neurons."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gnm_env.task import Patterns, Task
from gnm_env.vector_env import PatternStreamVectorEnv


class Policy(Protocol):
    """What answers bins: a neuron agent, an SB3 model, or a class of your own."""

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Actions (n,) for the bins (n, N) of n streams, and the state to hand in with the next.

        `episode_start` (n,) says where a stream begins anew; `state` is None in the first call.
        """


def survive_streams(
    policy: Policy, task: Task, patterns: Patterns, runs: int, cap: int, seed: int
) -> NDArray[np.int64]:
    """Bins survived before the first mistake, int64 (runs,), at most `cap` each.

    Run k hears the stream of `gnm/PatternStream-v0` after `reset(seed=seed + k)`. The streams run
    side by side, with one `predict` for a bin of all of them.
    """
    streams = PatternStreamVectorEnv(runs, task, patterns)
    bits, _ = streams.reset(seed=seed)
    survived, alive = np.zeros(runs, np.int64), np.ones(runs, np.bool_)
    state, begins = None, np.ones(runs, np.bool_)
    for _ in range(cap):
        actions, state = policy.predict(bits, state, begins, True)
        bits, _, mistaken, _, _ = streams.step(actions)
        begins = np.zeros(runs, np.bool_)
        # A stream that is lost goes on, unheeded: the batch keeps its shape, and `state` with it.
        alive &= ~mistaken
        survived += alive
        if not alive.any():
            break
    return survived
