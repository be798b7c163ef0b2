"""gnm/PatternTrial-v0: one trial an episode, one bin a step, feedback at the end."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.base.env import PatternEnv, checked_options, spike_from
from gnm_env.base.params import from_keywords, signature
from gnm_env.checks import shown
from gnm_env.rules import dense_reward, reward_for
from gnm_env.segments import segment_at
from gnm_env.task import Patterns, Task, dense
from gnm_env.trial import Trial, draw_next
from gnm_env.trial_task.info import info_of
from gnm_env.trial_task.params import HasTrialParams, TrialEnvParams, require_presentations


class PatternTrialEnv(HasTrialParams, PatternEnv):
    """A trial of noise in which fixed spatio-temporal patterns hide.

    ## Description
    N input channels spike at random, each with probability p per time bin. Into this noise fixed
    patterns of M bins are inserted, a Poisson number of each class per trial, at random times.
    Noise and patterns have the same statistics. The agent answers each bin with a spike or silence.
    It owes each presentation of class c exactly `targets[c]` spikes, and noise none; but all that
    it is told, by default, is at the end, and only about the sum: the *aggregate label*
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
    - `feedback="dense"`: −1 at once per spike in noise, −|target − count| as each presentation
      ends.

    With graded output, amounts take the place of counts, and an error of at most `tolerance` counts
    as zero.

    ## Starting State
    The first bin of a new trial, drawn from the environment's generator as `gnm_env.draw_trial`
    draws it: `reset(seed=s)` hears the trials of `numpy.random.default_rng(s)`. `reset` draws the
    whole trial, `step` draws nothing. `reset(options={"trial": trial})` plays a `Trial` of yours.

    With `trials=` each `reset` hears the next trial of an epoch, whose order is
    `rng.permutation(len(trials))` from the environment's generator `rng`. An epoch begins when the
    generator changes, by `reset(seed=…)` or by assignment to `np_random`, and when all of its
    trials have been heard.

    ## Episode End
    `terminated` after the answer for the last bin; truncated only where
    `gym.make(…, max_episode_steps=n)` asks for it. The terminal `info`, and no other, holds
    `label`, `emitted`, `onsets` (first bin of each presentation in the trial), `classes` (from 0),
    `targets` (owed by each presentation), `ends` (the bin after its last) and `pattern_bins` (0
    where presentations differ in length). What has one entry per presentation is a list: vector
    environments of any kind can then hold trials side by side. Where only the label of a trial is
    known, these lists are empty and `info` has `label_only`, True, as well.

    ## Arguments
    - `task`: a `Task`; or its fields as keywords, `gym.make(id, n_classes=2, rate=0.01)`.
    - `patterns`: `Patterns`; or `pattern_seed` (default 0) to draw them.
    - `trials`: `Trials`, a data set of your own, in place of task and patterns; `env.task` and
      `env.patterns` are then None, and `env.trials` is the data set.
    - `feedback`: "cost", "sign" or "dense".
    - `output`: "spikes" or "graded"; `max_output` (default 100) per bin and `tolerance` (default 0)
      belong to "graded".
    - `render_mode`: None, "rgb_array", or "human" for a window, which needs
      `pip install "gnm-env[rendering]"`.

    ## Pictures
    An agent may set `env.unwrapped.potential` before `step`: its membrane potential in units of
    its threshold. Pictures then show its course; nothing else changes.

    ## Version History
    - v0: first version.
    """

    __signature__ = signature(TrialEnvParams, first=("task", "patterns", "feedback"))

    def __init__(
        self,
        task: Task | None = None,
        patterns: Patterns | None = None,
        feedback: str = "cost",
        **arguments: Any,
    ) -> None:
        given = {"task": task, "patterns": patterns, "feedback": feedback, **arguments}
        (params,) = from_keywords((TrialEnvParams,), given)
        super().__init__(params, params.action_space)
        self._graded = params.graded
        self._n_inputs = params.n_inputs
        if self.trials is None:
            self._task_arrays = params.task_arrays
        self._order: NDArray[np.int64] | None = None
        """Numbers of the trials of this epoch, in their order; None: an epoch is to begin."""
        self._n_heard = 0
        self._n_bins = 0
        self._ahead: list[NDArray[np.int8]] = []
        """The bins not yet shown, the next one last; empty while no trial is under way."""

    def _generator_changed(self) -> None:
        self._order = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int8], dict[str, Any]]:
        given = checked_options(options, ("trial",))
        if "trial" in given:
            self._check(given["trial"])
        self._seed(seed)
        self._begin(given["trial"] if "trial" in given else self._next_trial())
        return self._ahead.pop(), {}

    @property
    def n_answered(self) -> int:
        """Bins of this trial that have been answered; 0 before the first."""
        return self._n_bins - len(self._ahead)

    def _next_trial(self) -> Trial:
        """The next trial of the epoch, or one that is drawn."""
        if self.trials is None:
            assert self.task is not None
            return draw_next(self.task, self._task_arrays, self._generators())
        if self._order is None or self._n_heard == len(self._order):
            self._order = self.np_random.permutation(len(self.trials))
            self._n_heard = 0
        self._n_heard += 1
        return self.trials[int(self._order[self._n_heard - 1])]

    def _check(self, trial: Any) -> None:
        """ValueError if `trial`, given by the user, cannot be played here."""
        if not isinstance(trial, Trial):
            raise ValueError(
                f"options['trial'] must be a gnm_env.Trial, got {type(trial).__name__}; "
                "use Trial.from_dense or Trial.from_times"
            )
        if self.task is None:
            fits, expected = trial.n_inputs == self._n_inputs, f"n_inputs = {self._n_inputs}"
        else:
            # Presentations may differ in length; one length that is not the task's is a mistake.
            both = (self.task.n_inputs, self.task.pattern_bins)
            fits = (trial.n_inputs, trial.pattern_bins or both[1]) == both
            expected = f"(n_inputs, pattern_bins) = {both} as the task says"
        if not fits:
            raise ValueError(
                f"the trial must have {expected}, got {(trial.n_inputs, trial.pattern_bins)}"
            )
        if self.feedback == "dense" and trial.label_only:
            require_presentations("options['trial']")

    def _begin(self, trial: Trial) -> None:
        self.trial = trial
        arrays = trial.arrays
        # One row more than bins: the zeros that follow the last answer. A new array every trial, so
        # that rows handed out earlier stay as they were.
        self._raster = dense(arrays.channels, arrays.offsets, trial.n_inputs, silent_bins=1)
        self._ahead = list(self._raster[::-1])
        self._n_bins = trial.n_bins
        self._emitted: float = 0.0 if self._graded else 0
        # The segments are followed bin by bin only for dense feedback and for pictures.
        self._follows = self.feedback == "dense" or self._scroll is not None
        if self._follows:
            self._edges, self._target = arrays.edges.tolist(), arrays.target.tolist()
            self._segment, self._in_segment = 0, 0.0
        self._clear_picture()
        if self._scroll is not None and trial.label_only:
            self._scroll.present(-1, trial.label, trial.n_bins)

    def step(self, action: Any) -> tuple[NDArray[np.int8], float, bool, bool, dict[str, Any]]:
        ahead = self._ahead
        if not ahead:
            self._require_reset()
        # Plain ints, as most loops send them, skip the slower general check.
        if type(action) is not int or not 0 <= action <= 1 or self._graded:
            action = self._amount_from(action) if self._graded else spike_from(action)
        reward = self._follow(action) if self._follows else 0.0
        self._emitted += action
        row = ahead.pop()
        if ahead:
            return row, reward, False, False, {}
        if self.feedback != "dense":
            error = float(self.trial.label - self._emitted)
            reward = reward_for(error, self.tolerance, self.feedback == "sign")
        return row, reward, True, False, info_of(self.trial, self._emitted)

    def _amount_from(self, action: Any) -> float:
        """The amount in an action that is one number, of NumPy or not; ValueError otherwise."""
        try:
            given = np.asarray(action)
        except (TypeError, ValueError):  # ragged lists
            given = np.zeros(0)
        # Text that spells a number is no number.
        is_number = given.size == 1 and given.dtype.kind in "fiub"
        amount = float(given.item()) if is_number else math.nan
        if not 0.0 <= amount <= self.max_output:
            raise ValueError(
                f"action must be one amount in 0 … {self.max_output:g} (max_output), "
                f"got {shown(action)}"
            )
        return amount

    def _follow(self, output: float) -> float:
        """Follow the segments through the bin shown last; returns its dense feedback."""
        t = self.trial.n_bins - len(self._ahead)
        segment = segment_at(self._edges, self._segment, t)
        if segment != self._segment:
            self._segment, self._in_segment = segment, 0.0
        self._in_segment += output
        owed, end = self._target[segment], self._edges[segment + 1]
        in_noise = segment % 2 == 0
        if self._scroll is not None:
            if not in_noise and t == self._edges[segment]:
                self._scroll.present(int(self.trial.classes[segment // 2]), owed, end - t)
            self._picture(self._raster[t], output)
        if self.feedback != "dense":
            return 0.0
        return dense_reward(output, self._in_segment, owed, in_noise, t + 1 == end, self.tolerance)
