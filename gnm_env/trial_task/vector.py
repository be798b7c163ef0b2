"""gnm/PatternTrial-v0 as a native vector environment: many copies, one compiled call a step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from gnm_env.base.kernels import COST, DENSE, SIGN
from gnm_env.base.vector import PatternVectorEnv, Step, read_only
from gnm_env.checks import choice, real
from gnm_env.reused import ReusedRows
from gnm_env.task import Patterns, Task
from gnm_env.trial_task.kernels import (
    TRIAL_STATE,
    TrialResults,
    begin_trials,
    report_of,
    step_trials,
)
from gnm_env.trial_task.params import FEEDBACK, OUTPUT

FEEDBACK_NUMBER = {"cost": COST, "sign": SIGN, "dense": DENSE}


class PatternTrialVectorEnv(PatternVectorEnv):
    """`gnm/PatternTrial-v0` many times over; see `PatternTrialEnv` for the task itself.

    Made by `gymnasium.make_vec("gnm/PatternTrial-v0", num_envs)`. Takes the arguments of the single
    environment but for `render_mode`, and `autoreset_mode`, `copy` and `max_episode_steps`. See
    `PatternVectorEnv` for seeding, autoreset, observations and `info`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | None = None,
        patterns: Patterns | None = None,
        feedback: str = "cost",
        *,
        pattern_seed: int = 0,
        output: str = "spikes",
        max_output: float = 100.0,
        tolerance: float = 0.0,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        **task_fields: Any,
    ) -> None:
        self.feedback = choice("feedback", feedback, FEEDBACK)
        self.output = choice("output", output, OUTPUT)
        self.max_output = real("max_output", max_output, above=0.0)
        self.tolerance = real("tolerance", tolerance, low=0.0)
        self._graded = self.output == "graded"
        amounts = spaces.Box(0.0, self.max_output, (1,), np.float64)
        super().__init__(
            num_envs,
            Task.from_keywords(task, task_fields),
            patterns,
            pattern_seed,
            amounts if self._graded else spaces.Discrete(2),
            max_episode_steps,
            autoreset_mode,
            copy,
            render_mode,
        )
        n, amount = self.num_envs, np.float64 if self._graded else np.int64
        self._emitted = np.zeros(n, amount)
        self._results = TrialResults(
            rewards=np.zeros(n),
            terminated=np.zeros(n, np.bool_),
            truncated=np.zeros(n, np.bool_),
            labels=np.zeros(n, np.int64),
            outputs=np.zeros(n, amount),
            pattern_bins=np.zeros(n, np.int64),
        )
        self._report = np.zeros(0, np.int64)
        self._lists = ReusedRows(3, n)

    def _most_bins(self) -> float:
        # A Poisson number exceeds this with a probability below 1e-80.
        mean = self.task.n_classes * self.task.mean_occurrences
        most_occurrences = mean + 20.0 * math.sqrt(mean) + 60.0
        return self.task.background_bins + self.task.pattern_bins * most_occurrences

    def _begin(self, which: NDArray[np.int64]) -> None:
        if self._crowd is None:
            self._crowd = self._new_crowd(
                np.zeros(self.num_envs, TRIAL_STATE),
                self._emitted,
                self.max_output if self._graded else 1.0,
                FEEDBACK_NUMBER[self.feedback],
                self.tolerance,
            )
            self._report = report_of(self._crowd)
        begin_trials(self._crowd, which)

    def step(self, actions: NDArray[Any]) -> Step:
        self._require_reset()
        answers = self._amounts(actions) if self._graded else self._spikes(actions)
        bad, self._n_over, n_told, is_new = step_trials(self._crowd, answers)
        if bad >= 0:
            raise self._no_amount(actions, bad) if self._graded else self._no_spike(actions, bad)
        if is_new:
            self._report = report_of(self._crowd)
        info: dict[str, Any] = {}
        if self._n_over:
            info = self._info(self._terminal_info(n_told))
        return self._stepped(info)

    def _amounts(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        """Actions as float64 (n,); whether each is in range the compiled step finds out."""
        checked = np.asarray(actions)
        if checked.shape != (self.num_envs, 1) or checked.dtype.kind not in "fiub":
            raise ValueError(
                f"actions must be numbers of shape ({self.num_envs}, 1), one per environment, "
                f"got {checked.dtype} of shape {checked.shape}"
            )
        return np.ascontiguousarray(checked[:, 0], np.float64)

    def _no_amount(self, actions: NDArray[Any], bad: int) -> ValueError:
        return ValueError(
            f"action must be one amount in 0 … {self.max_output:g} (max_output), "
            f"got {np.asarray(actions)[bad, 0]!r} for environment {bad}"
        )

    def _terminal_info(self, n_told: int) -> dict[str, Any]:
        """The info of `n_told` trials at their end, from the results and the report."""
        if n_told == 0:  # truncated only
            return {}
        heads = self._heads[:n_told].tolist()
        numbers = self._report[: heads[-1][-1]].tolist()
        onsets, classes, targets = self._lists.rows([head[0] for head in heads])
        for i, first, second, third, end in heads:
            onsets[i] = numbers[first:second]
            classes[i] = numbers[second:third]
            targets[i] = numbers[third:end]
        onsets, classes, targets = self._lists.lent()
        results, mask = self._results, read_only(self._results.terminated)
        return {
            "label": results.labels.copy(),
            "_label": mask,
            "emitted": results.outputs.copy(),
            "_emitted": mask,
            "onsets": onsets,
            "_onsets": mask,
            "classes": classes,
            "_classes": mask,
            "targets": targets,
            "_targets": mask,
            "pattern_bins": results.pattern_bins.copy(),
            "_pattern_bins": mask,
        }
