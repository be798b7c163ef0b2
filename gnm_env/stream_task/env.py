"""gnm/PatternStream-v0: an endless stream; one reward per bin survived, the end at a mistake."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from gnm_env.base.env import PatternEnv, checked_options, spike_from
from gnm_env.base.params import EnvParams, from_keywords, signature
from gnm_env.compiled import compiled
from gnm_env.rules import MISTAKES, mistake
from gnm_env.sampling import append_piece, new_buffers
from gnm_env.task import Patterns, Task, TaskArrays, dense


class PatternStreamEnv(PatternEnv):
    """An endless stream of noise and patterns that forgives no mistake.

    ## Description
    At every noise bin, the very first and the one right after a pattern included, a pattern of a
    random class starts with probability q (`onset_probability`) and runs for M bins; otherwise the
    bin is noise. The agent owes each presentation of class c exactly `targets[c]` spikes and noise
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
    `reset(seed=s)` begins at bin 0 of the stream of `numpy.random.default_rng(s)`. A later
    `reset()` goes on in that stream, right after the bin shown last or, where that lies in a
    pattern, after the pattern. That is a fresh stream too, since every noise bin is like the first.

    ## Episode End
    `terminated` at the mistake: a spike in noise, one spike too many in a presentation, or too few
    by its last bin. `info` then holds `mistake` ("noise", "too many" or "too few") and `class`
    (−1 in noise). `gym.make` truncates after 10,000 bins, or after `max_episode_steps` of yours.

    ## Arguments
    - `task`: a `Task`; or its fields as keywords, `gym.make(id, n_classes=2)`.
    - `patterns`: `Patterns`; or `pattern_seed` (default 0) to draw them.
    - `render_mode`: None, "rgb_array", or "human" for a window, which needs
      `pip install "gnm-env[rendering]"`.

    ## Pictures
    An agent may set `env.unwrapped.potential` before `step`: its membrane potential in units of
    its threshold. Pictures then show its course; nothing else changes.

    ## Version History
    - v0: first version.
    """

    __signature__ = signature(EnvParams, first=("task", "patterns"))

    def __init__(
        self, task: Task | None = None, patterns: Patterns | None = None, **arguments: Any
    ) -> None:
        (params,) = from_keywords((EnvParams,), {"task": task, "patterns": patterns, **arguments})
        super().__init__(params, spaces.Discrete(2))
        self._task_arrays = params.task_arrays
        self._owed = params.task.owed
        self._source: np.random.Generator | None = None
        self._running = False
        self._buffers = new_buffers()[:2]
        self._ahead: list[NDArray[np.int8]] = []
        """The bins of the present piece that are not yet shown, the next one last."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int8], dict[str, Any]]:
        checked_options(options, ())
        self._seed(seed)
        if self._source is not self.np_random:
            self._begin_stream()
        elif not (self._ahead and self._in_noise()):
            self._next_piece()
        self._count = 0
        self._running = True
        self._clear_picture()
        return self._ahead.pop(), {}

    def _begin_stream(self) -> None:
        """A new generator, which `reset(seed=…)` makes, is a new stream."""
        self._source = self.np_random
        self._noise_left = -1.0
        self._next_piece()

    def _next_piece(self) -> None:
        channels, offsets, n_noise, self._class, self._noise_left = _next_piece(
            self._generators().held, self._task_arrays, self._noise_left, *self._buffers
        )
        self._buffers = channels, offsets
        self._pattern_bins = self._task_arrays.pattern_bins if self._class >= 0 else 0
        n_bins = n_noise + self._pattern_bins
        self._raster = dense(channels, offsets[: n_bins + 1], self._task_arrays.n_inputs)
        self._ahead = list(self._raster[::-1])
        self._count = 0

    @property
    def presented(self) -> int:
        """The class, from 0, of the pattern that the bin shown last belongs to; −1 in noise.

        For pictures only: an agent that looks at it has nothing left to learn.
        """
        return -1 if self._in_noise() else self._class

    def _in_noise(self) -> bool:
        """Whether the bin shown last is noise."""
        return len(self._ahead) >= self._pattern_bins

    def step(self, action: Any) -> tuple[NDArray[np.int8], float, bool, bool, dict[str, Any]]:
        if not self._running:
            self._require_reset()
        # Plain ints, as most loops send them, skip the slower general check.
        if type(action) is not int or not 0 <= action <= 1:
            action = spike_from(action)
        in_noise = len(self._ahead) >= self._pattern_bins
        if self._scroll is not None:
            self._show(action)
        # Silence in noise, the answer to most bins, is right without further questions.
        wrong = self._mistake(action, in_noise) if action or not in_noise else 0
        if wrong:
            info = {"mistake": MISTAKES[wrong], "class": -1 if in_noise else self._class}
            self._running = False
        if not self._ahead:
            self._next_piece()
        if wrong:
            return self._ahead.pop(), 0.0, True, False, info
        return self._ahead.pop(), 1.0, False, False, {}

    def _mistake(self, spike: int, in_noise: bool) -> int:
        """Number of the mistake in answering the bin shown last with `spike`; 0 if none."""
        if in_noise:
            return mistake(spike, 0, True, False)
        self._count += spike
        return mistake(self._count, self._owed[self._class], False, not self._ahead)

    def _show(self, spike: int) -> None:
        """Show the picture the bin shown last and the answer to it."""
        bins_left = len(self._ahead) + 1
        if bins_left == self._pattern_bins:
            self._scroll.present(self._class, self._owed[self._class], bins_left)
        self._picture(self._raster[-bins_left], spike)


@compiled
def _next_piece(
    held: Any,
    task: TaskArrays,
    noise_left: float,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int64], int, int, float]:
    return append_piece(held[0], task, noise_left, channels, offsets, 0)
