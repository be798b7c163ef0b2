"""What the trial and the stream environment share: task, patterns, spaces, pictures."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.base.params import EnvParams, HasParams
from gnm_env.checks import generator, shown, whole
from gnm_env.generators import Generators


class PatternEnv(HasParams, gym.Env[NDArray[np.int8], Any]):
    """Base of the environments. Subclasses say what `reset` and `step` do."""

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 50}

    def __init__(self, params: EnvParams, action_space: spaces.Space[Any]) -> None:
        self._params = params
        self.render_mode = params.render_mode
        self.observation_space = spaces.Box(0, 1, (params.n_inputs,), np.int8)
        self.action_space = action_space
        self._potential = math.nan
        self._held: Generators | None = None
        self._scroll: Any = None
        self._window: Any = None
        self._draw_pictures(params)

    @property
    def np_random(self) -> Generator:
        """The generator that everything is drawn from."""
        return super().np_random

    @np_random.setter
    def np_random(self, value: Generator | None) -> None:
        self._np_random = None if value is None else generator("np_random", value)
        self._np_random_seed = -1
        self._generator_changed()

    def _generator_changed(self) -> None:
        """There is another generator, or the same one was given once more."""

    @property
    def potential(self) -> float:
        """The agent's membrane potential in units of its threshold, NaN where it is not known.

        For pictures only: an agent may set it before `step`, and the picture shows its course.
        """
        return self._potential

    @potential.setter
    def potential(self, value: Any) -> None:
        given = np.asarray(value)
        if given.size != 1 or given.dtype.kind not in "fiu":
            raise ValueError(f"potential must be one number, got {shown(value)}")
        self._potential = float(given.item())

    def _draw_pictures(self, params: EnvParams) -> None:
        """Prepare what `render_mode` asks for; offer only what this installation can show."""
        from gnm_env.window import Window, can_open

        if not can_open():
            self.metadata = {**self.metadata, "render_modes": ["rgb_array"]}
        if params.render_mode is None:
            return
        if params.render_mode == "human":
            self._window = Window(self.metadata["render_fps"])
        from gnm_env.rendering import Scroll

        self._scroll = Scroll(params.n_inputs, params.task, params.patterns)

    def render(self) -> NDArray[np.uint8] | None:
        """The last bins as a picture, (height, width, 3) uint8.

        None without a render mode, and with "human": then `reset` and `step` show the picture in a
        window by themselves.
        """
        return self._scroll.frame() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _clear_picture(self) -> None:
        """Begin an episode's picture."""
        if self._scroll is not None:
            self._scroll.clear()
            self._show_window()

    def _picture(self, bits: NDArray[np.int8], output: float) -> None:
        """Add a bin and the answer to it."""
        self._scroll.push(bits, output, self.potential)
        self._show_window()

    def _show_window(self) -> None:
        if self._window is not None:
            self._window.show(self._scroll.frame())

    def _generators(self) -> Generators:
        """`np_random` for compiled code."""
        if self._held is None or self._held.rngs[0] is not self.np_random:
            self._held = Generators([self.np_random])
        return self._held

    def _seed(self, seed: int | None) -> None:
        """Begin with a generator of that seed; None: the present one goes on."""
        if seed is not None:
            super().reset(seed=whole("seed", seed, low=0))
            self._generator_changed()

    @staticmethod
    def _require_reset() -> None:
        raise ResetNeeded("call reset() before step(): no episode is under way, or it has ended")


def checked_options(options: Any, known: tuple[str, ...]) -> Mapping[str, Any]:
    """The options of `reset`, all of them in `known`; ValueError for anything else."""
    if options is None:
        return {}
    allowed = ", ".join(map(repr, known)) or "none"
    if not isinstance(options, Mapping):
        raise ValueError(f"options must be a dict with keys among {allowed}, got {shown(options)}")
    for name in options:
        if name not in known:
            raise ValueError(f"unknown reset option {shown(name)}; known options: {allowed}")
    return options


def spike_from(action: Any) -> int:
    """0 or 1 from an action of any integer kind; ValueError for anything else."""
    try:
        spike = operator.index(action)
    except TypeError:
        spike = -1
    if spike != 0 and spike != 1:
        raise ValueError(f"action must be 0 (silent) or 1 (spike), got {shown(action)}")
    return spike


def array_of(actions: Any) -> NDArray[Any]:
    """`actions` as an array; an empty one where they are none."""
    try:
        return np.asarray(actions)
    except (TypeError, ValueError):  # ragged lists
        return np.empty(0, object)
