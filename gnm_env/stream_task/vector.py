"""gnm/PatternStream-v0 as a native vector environment: many copies, one compiled call a step."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from gnm_env.base.vector import PatternVectorEnv, Step, read_only
from gnm_env.rules import MISTAKES
from gnm_env.sampling import PIECE_BINS
from gnm_env.stream_task.kernels import STREAM_STATE, StreamResults, begin_streams, step_streams
from gnm_env.task import Patterns, Task

NAMES = np.array([None, *MISTAKES[1:]], object)
"""Mistakes by number, as `info` names them."""


class PatternStreamVectorEnv(PatternVectorEnv):
    """`gnm/PatternStream-v0` many times over; see `PatternStreamEnv` for the task itself.

    Made by `gymnasium.make_vec("gnm/PatternStream-v0", num_envs)`. Takes the arguments of the
    single environment but for `render_mode`, and `autoreset_mode`, `copy` and `max_episode_steps`
    (`make_vec` sets it to 10,000). See `PatternVectorEnv` for seeding, autoreset, observations and
    `info`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | None = None,
        patterns: Patterns | None = None,
        *,
        pattern_seed: int = 0,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        **task_fields: Any,
    ) -> None:
        super().__init__(
            num_envs,
            Task.from_keywords(task, task_fields),
            patterns,
            pattern_seed,
            spaces.Discrete(2),
            max_episode_steps,
            autoreset_mode,
            copy,
            render_mode,
        )
        n = self.num_envs
        self._state = np.zeros(n, STREAM_STATE)
        self._state["anew"] = 1
        self._results = StreamResults(
            rewards=np.zeros(n),
            terminated=np.zeros(n, np.bool_),
            truncated=np.zeros(n, np.bool_),
            mistakes=np.zeros(n, np.int64),
            classes=np.zeros(n, np.int64),
        )

    def _most_bins(self) -> float:
        return PIECE_BINS + self.task.pattern_bins

    def _reseeded(self, i: int) -> None:
        self._state[i]["anew"] = 1

    def _begin(self, which: NDArray[np.int64]) -> None:
        if self._crowd is None:
            self._crowd = self._new_crowd(self._state, np.zeros(0, np.int64), most=1.0)
        begin_streams(self._crowd, which)

    def step(self, actions: NDArray[Any]) -> Step:
        self._require_reset()
        bad, self._n_over = step_streams(self._crowd, self._spikes(actions))
        if bad >= 0:
            raise self._no_spike(actions, bad)
        info: dict[str, Any] = {}
        if self._n_over:
            info = self._info(self._terminal_info())
        return self._stepped(info)

    def _terminal_info(self) -> dict[str, Any]:
        """The info of streams that a mistake has ended, from the results."""
        results = self._results
        if not results.terminated.any():  # truncated only
            return {}
        mask = read_only(results.terminated)
        names, classes = NAMES[results.mistakes], results.classes.copy()
        return {"mistake": names, "_mistake": mask, "class": classes, "_class": mask}
