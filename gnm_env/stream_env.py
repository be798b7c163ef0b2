"""gnm/PatternStream-v0: an endless stream; one reward per bin survived, the end at a mistake."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.pattern_env import PatternEnv, spike_from
from gnm_env.sampling import append_piece
from gnm_env.task import Patterns, Task, dense

MAX_EPISODE_BINS = 10_000
"""Cap of the noisy performance, in bins: `max_episode_steps` of the registered environment."""


class PatternStreamEnv(PatternEnv):
    """An endless stream of noise and patterns that forgives no mistake.

    ## Description
    At every noise bin, the very first and the one right after a pattern included, a pattern of a
    random class starts with probability q (`onset_probability`) and runs for M bins; otherwise the
    bin is noise. The agent owes each occurrence of class c exactly `targets[c]` spikes and noise
    none. The first mistake ends the episode, so that the mean episode return *is* the noisy
    performance of Fil & Chu, "Minimal spiking neuron for solving multi-label classification tasks".

    ## Observation Space
    `Box(0, 1, (N,), int8)`: the input spikes of the present bin, also in the observation that comes
    with the end of an episode. An observation once handed out is never altered.

    ## Action Space
    `Discrete(2)`: the answer for the bin just seen, 0 silent, 1 spike.

    ## Rewards
    1.0 for each bin survived; 0.0 for the bin of the mistake.

    ## Starting State
    Bin 0 of a fresh stream. The stream is drawn from the environment's generator in pieces of noise
    with a pattern at their end; `reset` goes on to the next piece, so that `reset(seed=s)` hears
    the stream of `numpy.random.default_rng(s)` and a later `reset()` one that continues it.

    ## Episode End
    `terminated` at the mistake: a spike in noise, one spike too many in an occurrence, or too few
    by its last bin. `info` then holds `mistake` ("noise", "too many" or "too few") and `class`
    (−1 in noise). `gym.make` truncates after 10,000 bins (`max_episode_steps`).

    ## Arguments
    - `task`: a `Task`; or its fields as keywords, `gym.make(id, n_classes=2)`.
    - `patterns`: `Patterns`; or `pattern_seed` (default 0) to draw them.
    - `render_mode`: None or "rgb_array".

    ## Version History
    - v0: first version.
    """

    def __init__(
        self,
        task: Task | None = None,
        patterns: Patterns | None = None,
        *,
        pattern_seed: int = 0,
        render_mode: str | None = None,
        **task_fields: Any,
    ) -> None:
        super().__init__(task, patterns, pattern_seed, render_mode, task_fields)
        self._noise_left = -1.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int8], dict[str, Any]]:
        super().reset(seed=seed)
        self._refuse_options(options, ())
        if seed is not None:
            self._noise_left = -1.0
        self._next_piece()
        self._running = True
        if self._scroll is not None:
            self._scroll.clear()
        return self._rows[0], {}

    def _next_piece(self) -> None:
        channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
        channels, offsets, self._n_noise, self._class, self._noise_left = append_piece(
            self.np_random, self._world, self._noise_left, channels, offsets, 0
        )
        self._n_bins = self._n_noise + (self.task.pattern_bins if self._class >= 0 else 0)
        bins = offsets[: self._n_bins + 1]
        self._rows = list(dense(channels[: bins[-1]], bins, self.task.n_inputs).view(np.int8))
        self._bin = 0
        self._count = 0

    def step(self, action: Any) -> tuple[NDArray[np.int8], float, bool, bool, dict[str, Any]]:
        if not self._running:
            self._require_running()
        # Plain ints, as most loops send them, skip the slower general check.
        if type(action) is not int or action not in (0, 1):
            action = spike_from(action)
        t = self._bin
        class_ = -1 if t < self._n_noise else self._class
        if self._scroll is not None:
            self._scroll.push(self._rows[t], class_, action, self.potential)
        self._bin = t + 1
        mistake = self._mistake(class_, action) if action or class_ >= 0 else ""
        if self._bin == self._n_bins:
            self._next_piece()
        if mistake:
            self._running = False
            return self._rows[self._bin], 0.0, True, False, {"mistake": mistake, "class": class_}
        return self._rows[self._bin], 1.0, False, False, {}

    def _mistake(self, class_: int, spike: int) -> str:
        """What is wrong with the answer to the bin just heard; empty if nothing is."""
        if class_ < 0:
            return "noise" if spike else ""
        self._count += spike
        owed = self.task.owed[class_]
        if self._count > owed:
            return "too many"
        return "too few" if self._bin == self._n_bins and self._count < owed else ""
