"""What the trial and the stream environment share: task, patterns, spaces, pictures."""

from __future__ import annotations

import operator
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from gnm_env.generators import Generators
from gnm_env.task import Patterns, Task, task_arrays


class PatternEnv(gym.Env[NDArray[np.int8], Any]):
    """Base of the environments. Subclasses say what `reset` and `step` do."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}

    def __init__(
        self,
        task: Task | None,
        patterns: Patterns | None,
        pattern_seed: int,
        render_mode: str | None,
        task_fields: dict[str, Any],
    ) -> None:
        self.task = Task.from_keywords(task, task_fields)
        self.patterns = Patterns.draw(self.task, pattern_seed) if patterns is None else patterns
        self._task_arrays = task_arrays(self.task, self.patterns)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode must be None or 'rgb_array', got {render_mode!r}")
        self.render_mode = render_mode
        self.observation_space = spaces.Box(0, 1, (self.task.n_inputs,), np.int8)
        self.action_space: spaces.Space[Any] = spaces.Discrete(2)
        self.potential = float("nan")
        """The agent's membrane potential in units of its threshold, for pictures only: an agent may
        set it before `step`."""
        self._held: Generators | None = None
        self._scroll: Any = None
        if render_mode is not None:
            from gnm_env.rendering import Scroll

            self._scroll = Scroll(self.task, self.patterns)

    def render(self) -> NDArray[np.uint8] | None:
        """The last bins as a picture, (height, width, 3) uint8; None without a render mode."""
        return None if self._scroll is None else self._scroll.frame()

    def _generators(self) -> Generators:
        """`np_random` for compiled code."""
        if self._held is None or self._held.rngs[0] is not self.np_random:
            self._held = Generators([self.np_random])
        return self._held

    @staticmethod
    def _require_reset() -> None:
        raise ResetNeeded("call reset() before step(): no episode is under way, or it has ended")

    @staticmethod
    def _refuse_options(options: dict[str, Any] | None, known: tuple[str, ...]) -> dict[str, Any]:
        if not options:
            return {}
        unknown = sorted(set(options) - set(known))
        if unknown:
            allowed = ", ".join(map(repr, known)) or "none"
            raise ValueError(f"unknown reset option {unknown[0]!r}; known options: {allowed}")
        return options


def spike_from(action: Any) -> int:
    """0 or 1 from an action of any integer kind; ValueError for anything else."""
    try:
        spike = operator.index(action)
    except TypeError:
        spike = -1
    if spike != 0 and spike != 1:
        raise ValueError(f"action must be 0 (silent) or 1 (spike), got {action!r}")
    return spike
