"""gnm/PatternTrial-v0: one trial an episode, one bin a step, feedback at the end."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from gnm_env.base.env import PatternEnv, spike_from
from gnm_env.checks import choice, real
from gnm_env.rules import reward_for
from gnm_env.task import Patterns, Task, dense
from gnm_env.trial import Trial, draw_next

FEEDBACK = ("cost", "sign", "dense")
OUTPUT = ("spikes", "graded")


class PatternTrialEnv(PatternEnv):
    """A trial of noise in which fixed spatio-temporal patterns hide.

    ## Description
    N input channels spike at random, each with probability p per time bin. Into this noise fixed
    patterns of M bins are inserted, a Poisson number of each class per trial, at random times.
    Noise and patterns have the same statistics. The agent answers each bin with a spike or silence.
    It owes each occurrence of class c exactly `targets[c]` spikes, and noise none; but all that it
    is told, by default, is at the end, and only about the sum: the *aggregate label*
    Σ_c k_c·targets[c]. From Fil & Chu, "Minimal spiking neuron for solving multi-label
    classification tasks".

    ## Observation Space
    `Box(0, 1, (N,), int8)`: the input spikes of the present bin. All zeros after the last bin. An
    observation once handed out is never altered.

    ## Action Space
    `Discrete(2)`: the answer for the bin just seen, 0 silent, 1 spike. With `output="graded"`
    `Box(0, max_output, (1,), float64)`: the amount of output in that bin.

    ## Rewards
    - `feedback="cost"` (default): −|label − emitted| at the end, 0 before.
    - `feedback="sign"`: sign(label − emitted) at the end, 0 before: all that aggregate-label
      learning may use. +1 asks for more output, −1 for less.
    - `feedback="dense"`: −1 at once per spike in noise, −|target − count| as each occurrence ends.

    With graded output, amounts take the place of counts, and an error of at most `tolerance` counts
    as zero.

    ## Starting State
    The first bin of a new trial, drawn from the environment's generator as `gnm_env.draw_trial`
    draws it: `reset(seed=s)` hears the trials of `numpy.random.default_rng(s)`. `reset` draws the
    whole trial, `step` draws nothing. `reset(options={"trial": trial})` plays a `Trial` of yours.

    ## Episode End
    `terminated` after the answer for the last bin; never truncated. The terminal `info`, and no
    other, holds `label`, `emitted`, `onsets` (first bin of each occurrence in the trial), `classes`
    (from 0), `targets` (owed by each occurrence) and `pattern_bins`. The three of one entry per
    occurrence are lists: vector environments of any kind can then hold trials side by side.

    ## Arguments
    - `task`: a `Task`; or its fields as keywords, `gym.make(id, n_classes=2, rate=0.01)`.
    - `patterns`: `Patterns`; or `pattern_seed` (default 0) to draw them.
    - `feedback`: "cost", "sign" or "dense".
    - `output`: "spikes" or "graded"; `max_output` (default 100) per bin and `tolerance` (default 0)
      belong to "graded".
    - `render_mode`: None or "rgb_array".

    ## Version History
    - v0: first version.
    """

    def __init__(
        self,
        task: Task | None = None,
        patterns: Patterns | None = None,
        feedback: str = "cost",
        *,
        pattern_seed: int = 0,
        output: str = "spikes",
        max_output: float = 100.0,
        tolerance: float = 0.0,
        render_mode: str | None = None,
        **task_fields: Any,
    ) -> None:
        super().__init__(task, patterns, pattern_seed, render_mode, task_fields)
        self.feedback = choice("feedback", feedback, FEEDBACK)
        self.output = choice("output", output, OUTPUT)
        self.max_output = real("max_output", max_output, above=0.0)
        self.tolerance = real("tolerance", tolerance, low=0.0)
        self._graded = self.output == "graded"
        self._ahead: list[NDArray[np.int8]] = []
        """The bins not yet shown, the next one last; empty while no trial is under way."""
        if self._graded:
            self.action_space = spaces.Box(0.0, self.max_output, (1,), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int8], dict[str, Any]]:
        super().reset(seed=seed)
        trial = self._refuse_options(options, ("trial",)).get("trial")
        if trial is None:
            trial = draw_next(self.task, self._task_arrays, self._generators())
        self._begin(trial)
        return self._ahead.pop(), {}

    def _begin(self, trial: Trial) -> None:
        expected = (self.task.n_inputs, self.task.pattern_bins)
        if not isinstance(trial, Trial):
            raise ValueError(
                f"options['trial'] must be a gnm_env.Trial, got {type(trial).__name__}; "
                "use Trial.from_dense or Trial.from_times"
            )
        if (trial.n_inputs, trial.pattern_bins) != expected:
            raise ValueError(
                f"the trial must have (n_inputs, pattern_bins) = {expected} as the task says, "
                f"got {(trial.n_inputs, trial.pattern_bins)}"
            )
        self.trial = trial
        # One row more than bins: the zeros that follow the last answer. A new array every trial, so
        # that rows handed out earlier stay as they were.
        self._raster = dense(trial.channels, trial.offsets, trial.n_inputs, silent_bins=1)
        self._ahead = list(self._raster[::-1])
        self._emitted: float = 0.0 if self._graded else 0
        # Who owns each bin is needed bin by bin only for dense feedback and for pictures.
        track = self.feedback == "dense" or self._scroll is not None
        self._owner = trial.owner() if track else None
        self._in_occurrence: float = 0
        if self._scroll is not None:
            self._scroll.clear()

    def step(self, action: Any) -> tuple[NDArray[np.int8], float, bool, bool, dict[str, Any]]:
        ahead = self._ahead
        if not ahead:
            self._require_reset()
        # Plain ints, as most loops send them, skip the slower general check.
        if type(action) is not int or not 0 <= action <= 1 or self._graded:
            action = self._amount_from(action) if self._graded else spike_from(action)
        reward = 0.0 if self._owner is None else self._account(action)
        self._emitted += action
        row = ahead.pop()
        if ahead:
            return row, reward, False, False, {}
        if self.feedback != "dense":
            error = float(self.trial.label - self._emitted)
            reward = reward_for(error, self.tolerance, self.feedback == "sign")
        return row, reward, True, False, self._terminal_info()

    def _amount_from(self, action: Any) -> float:
        try:
            amount = float(np.asarray(action, np.float64).item())
        except (TypeError, ValueError):
            amount = math.nan
        if not 0.0 <= amount <= self.max_output:
            raise ValueError(
                f"action must be one amount in 0 … {self.max_output:g} (max_output), got {action!r}"
            )
        return amount

    def _account(self, output: float) -> float:
        """Dense feedback for the bin shown last; also shows that bin to the picture."""
        assert self._owner is not None
        t = self.trial.n_bins - len(self._ahead)
        owner = self._owner[t]
        if self._scroll is not None:
            class_ = int(self.trial.classes[owner]) if owner >= 0 else -1
            self._scroll.push(self._raster[t], class_, output, self.potential)
        if self.feedback != "dense":
            return 0.0
        if owner < 0:
            return 0.0 - output
        self._in_occurrence += output
        if t + 1 < self.trial.onsets[owner] + self.trial.pattern_bins:
            return 0.0
        error = float(self.trial.targets[owner]) - self._in_occurrence
        self._in_occurrence = 0
        return reward_for(error, self.tolerance, sign_only=False)

    def _terminal_info(self) -> dict[str, Any]:
        trial = self.trial
        return {
            "label": trial.label,
            "emitted": self._emitted,
            "onsets": trial.onsets.tolist(),
            "classes": trial.classes.tolist(),
            "targets": trial.targets.tolist(),
            "pattern_bins": trial.pattern_bins,
        }
