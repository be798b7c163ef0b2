"""gnm/PatternTrial-v0 as a native vector environment: many copies, one compiled call a step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.base.env import array_of
from gnm_env.base.kernels import COST, DENSE, SIGN, Config, Episodes, Growing, growing_of
from gnm_env.base.params import VectorParams, from_keywords, signature
from gnm_env.base.vector import PatternVectorEnv, Step, read_only
from gnm_env.checks import require_memory
from gnm_env.reused import ReusedRows
from gnm_env.task import Patterns, Task
from gnm_env.trial_task.info import masked, terminal_info
from gnm_env.trial_task.kernels import (
    TRIAL_STATE,
    Recorded,
    TrialResults,
    begin_drawn,
    begin_recorded,
    step_drawn,
    step_recorded,
)
from gnm_env.trial_task.params import HasTrialParams, TrialEnvParams

FEEDBACK_NUMBER = {"cost": COST, "sign": SIGN, "dense": DENSE}


class PatternTrialVectorEnv(HasTrialParams, PatternVectorEnv):
    """`gnm/PatternTrial-v0` many times over; see `PatternTrialEnv` for the task itself.

    Made by `gymnasium.make_vec("gnm/PatternTrial-v0", num_envs)`. Takes the arguments of the single
    environment but for `render_mode`, and `autoreset_mode`, `copy` and `max_episode_steps`. See
    `PatternVectorEnv` for seeding, autoreset, observations and `info`.
    """

    __signature__ = signature(
        TrialEnvParams,
        VectorParams,
        first=("num_envs", "task", "patterns", "feedback"),
        without=("render_mode",),
    )

    def __init__(
        self,
        num_envs: int = 1,
        task: Task | None = None,
        patterns: Patterns | None = None,
        feedback: str = "cost",
        **arguments: Any,
    ) -> None:
        whole_task = {"task": task, "patterns": patterns}
        given = {"num_envs": num_envs, "feedback": feedback, **whole_task, **arguments}
        params, vector = from_keywords((TrialEnvParams, VectorParams), given)
        self._graded = params.graded
        super().__init__(params, vector, params.action_space)
        n = self.num_envs
        records = np.zeros(n, TRIAL_STATE)
        records["anew"] = 1
        self._episodes = Episodes(records=records, emitted=np.zeros(n, self._amount_type()))
        self._source = params.task_arrays if self.trials is None else self._recorded()
        self._tells_ends = self.trials is not None and self.trials.pattern_bins is None
        self._report = np.zeros(0, np.int64)
        self._lists = ReusedRows(3, n)

    def _recorded(self) -> Recorded:
        """The data set as the source of trials; its arrays are shared, not copied."""
        assert self.trials is not None
        n_trials = len(self.trials)
        require_memory(
            f"the order of {n_trials:,} trials for each of {self.num_envs:,} environments",
            4.0 * self.num_envs * n_trials,
            "lower num_envs",
        )
        return Recorded(
            trials=self.trials.arrays,
            pattern_bins=self.trials.pattern_bins or 0,
            orders=np.zeros((self.num_envs, n_trials), np.uint32),
        )

    def _amount_type(self) -> type[np.generic]:
        return np.float64 if self._graded else np.int64

    def _new_results(self) -> TrialResults:
        n = self.num_envs
        return TrialResults(
            rewards=np.zeros(n),
            terminated=np.zeros(n, np.bool_),
            truncated=np.zeros(n, np.bool_),
            labels=np.zeros(n, np.int64),
            outputs=np.zeros(n, self._amount_type()),
            pattern_bins=np.zeros(n, np.int64),
            label_only=np.zeros(n, np.bool_),
        )

    def _most_bins(self) -> float:
        if self.trials is not None:
            return float(self.trials.n_bins.max())
        # A Poisson number exceeds this with a probability below 1e-80.
        assert self.task is not None
        mean = self.task.n_classes * self.task.mean_occurrences
        most_presentations = mean + 20.0 * math.sqrt(mean) + 60.0
        return self.task.background_bins + self.task.pattern_bins * most_presentations

    def _config(self) -> Config:
        same = super()._config()
        return same._replace(
            most=self.max_output if self._graded else 1.0,
            feedback=FEEDBACK_NUMBER[self.feedback],
            tolerance=self.tolerance,
            tells_ends=self._tells_ends,
        )

    def _new_state(self, growing: Growing) -> Any:
        state = super()._new_state(growing)
        self._report = growing_of(state).report
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        if state["_params"].trials is not None:  # one data set, not two equal ones
            state["_source"] = state["_source"]._replace(trials=state["_params"].trials.arrays)
        super().__setstate__(state)

    def _reseeded(self, i: int) -> None:
        self._episodes.records[i]["anew"] = 1

    def _begin(self, which: NDArray[np.int64]) -> None:
        (begin_drawn if self.trials is None else begin_recorded)(self._state, which)

    def _step(self, actions: NDArray[Any]) -> Step:
        answers = self._amounts(actions) if self._graded else self._spikes(actions)
        step = step_drawn if self.trials is None else step_recorded
        bad, self._n_done, n_told, is_new = step(self._state, answers)
        if bad >= 0:
            raise self._no_amount(actions, bad) if self._graded else self._no_spike(actions, bad)
        if is_new:
            self._report = growing_of(self._state).report
        return self._stepped(self._info(self._terminal_info(n_told)) if self._n_done else {})

    def _amounts(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        """Actions as float64 (n,); whether each is in range the compiled step finds out."""
        checked = array_of(actions)
        if checked.shape != (self._n, 1) or checked.dtype.kind not in "fiub":
            raise ValueError(
                f"actions must be numbers of shape ({self._n}, 1), one per environment, "
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
        heads = self._outcome.heads[:n_told].tolist()
        numbers = (
            self._report.tolist() if self._tells_ends else self._report[: heads[-1][-1]].tolist()
        )
        onsets, classes, targets = self._lists.rows([head[0] for head in heads])
        for i, first, second, third, end in heads:
            onsets[i] = numbers[first:second]
            classes[i] = numbers[second:third]
            targets[i] = numbers[third:end]
        onsets, classes, targets = self._lists.lent()
        results = self._results
        info = terminal_info(
            results.labels.copy(),
            results.outputs.copy(),
            onsets,
            classes,
            targets,
            results.pattern_bins.copy(),
        )
        masked(info, read_only(results.terminated))
        if self.trials is not None:
            self._add_extras(info, heads, numbers)
        return info

    def _add_extras(self, info: dict[str, Any], heads: list[Any], numbers: list[int]) -> None:
        """What only trials of a data set tell: see `info_of`."""
        results = self._results
        if results.label_only.any():
            info["label_only"] = results.label_only.copy()
            info["_label_only"] = results.label_only.copy()
        ends, mask = np.full(self._n, None, object), np.zeros(self._n, np.bool_)
        for i, first, second, _, end in heads:
            if second > first and results.pattern_bins[i] == 0:
                ends[i], mask[i] = numbers[end : end + second - first], True
        if mask.any():
            info["ends"], info["_ends"] = ends, mask
