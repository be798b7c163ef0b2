"""gnm/PatternStream-v0 as a native vector environment: many copies, one compiled call a step."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from gnm_env.base.kernels import Episodes
from gnm_env.base.params import EnvParams, VectorParams, from_keywords, signature
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

    __signature__ = signature(
        EnvParams, VectorParams, first=("num_envs", "task", "patterns"), without=("render_mode",)
    )

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | None = None,
        patterns: Patterns | None = None,
        **arguments: Any,
    ) -> None:
        given = {"num_envs": num_envs, "task": task, "patterns": patterns, **arguments}
        params, vector = from_keywords((EnvParams, VectorParams), given)
        super().__init__(params, vector, spaces.Discrete(2))
        self._source = params.task_arrays
        records = np.zeros(self.num_envs, STREAM_STATE)
        records["anew"] = 1
        self._episodes = Episodes(records=records, emitted=np.zeros(0, np.int64))

    def _new_results(self) -> StreamResults:
        n = self.num_envs
        return StreamResults(
            rewards=np.zeros(n),
            terminated=np.zeros(n, np.bool_),
            truncated=np.zeros(n, np.bool_),
            mistakes=np.zeros(n, np.int64),
            classes=np.zeros(n, np.int64),
        )

    def _most_bins(self) -> float:
        return PIECE_BINS + int(self._source.pattern_bins)

    def _reseeded(self, i: int) -> None:
        self._episodes.records[i]["anew"] = 1

    def _begin(self, which: NDArray[np.int64]) -> None:
        begin_streams(self._state, which)

    def _step(self, actions: NDArray[Any]) -> Step:
        bad, self._n_done = step_streams(self._state, self._spikes(actions))
        if bad >= 0:
            raise self._no_spike(actions, bad)
        return self._stepped(self._info(self._terminal_info()) if self._n_done else {})

    def _terminal_info(self) -> dict[str, Any]:
        """The info of streams that a mistake has ended, from the results."""
        results = self._results
        if not results.terminated.any():  # truncated only
            return {}
        mask = read_only(results.terminated)
        names, classes = NAMES[results.mistakes], results.classes.copy()
        return {"mistake": names, "_mistake": mask, "class": classes, "_class": mask}
