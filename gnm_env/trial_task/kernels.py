"""Compiled steps of many trials at once; `gnm_env.base.kernels` says how they are laid out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.base.kernels import (
    DENSE,
    NEXT_STEP,
    SAME_STEP,
    SIGN,
    clear_all,
    fill_zero,
    first_bad_action,
    is_used_up,
    set_aside,
    show_due,
    show_first,
    store_events,
    widened,
)
from gnm_env.compiled import compiled
from gnm_env.rules import compiled_reward_for
from gnm_env.sampling import begin_trial, fill_trial, longer_buffers
from gnm_env.task import TaskArrays

TRIAL_STATE = np.dtype(
    [
        ("label", np.int64),
        ("n_occurrences", np.int64),
        ("occurrence", np.int64),  # the next occurrence to end, and the output in it so far
        ("given", np.float64),
    ]
)


class TrialResults(NamedTuple):
    """What a step of trials tells, (n,) each; zero where there is nothing to tell."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    labels: NDArray[np.int64]
    outputs: NDArray[Any]
    pattern_bins: NDArray[np.int64]


@compiled
def begin_trials(crowd: Any, which: NDArray[np.int64]) -> None:
    """Draw a trial for each environment in `which` and show its first bin; their rows are clear."""
    n_begun = 0
    is_new = True
    while n_begun < which.size:
        n_begun = _draw_trials(crowd, which, n_begun, is_new)
        if n_begun < which.size:
            is_new = False
            _make_room(crowd)
    show_first(crowd, which)


@compiled
def _draw_trials(crowd: Any, which: NDArray[np.int64], first: int, is_new: bool) -> int:
    """Draw trials for `which[first:]`, the first of them perhaps begun already (`is_new` False).

    Returns the number of the environment for which there was not enough room, or that of all. No
    array is exchanged for a longer one in here: numba counts references to those that are.
    """
    held, task, state, emitted = crowd.held, crowd.task, crowd.state, crowd.emitted
    events, parts, shift, limit = crowd.events, crowd.parts, crowd.shift, crowd.limit
    bins, cursors, deadlines = crowd.clock[0], crowd.clock[2], crowd.clock[3]
    channels, offsets, onsets, classes = crowd.channels, crowd.offsets, crowd.onsets, crowd.classes
    draft = crowd.draft
    n = first
    fits = True
    while fits and n < which.size:
        i = which[n]
        if is_new:
            begin_trial(draft, offsets, 0, 0)
        fits = fill_trial(held[i], task, channels, offsets, onsets, classes, draft)
        n_bins, n_occurrences = draft[0].bin_, draft[0].occurrence
        fits = fits and offsets[n_bins] < events.shape[1] and n_occurrences <= parts.shape[1]
        if fits:
            store_events(events, i, shift, n_bins, channels, offsets)
            for k in range(n_occurrences):
                parts[i, k] = (onsets[k] << 32) + classes[k]
            s = state[i]
            s.n_occurrences, s.label = n_occurrences, draft[0].label
            s.occurrence, s.given = 0, 0.0
            emitted[i] = 0
            bins[i], cursors[i], deadlines[i] = 0, 0, limit
            n += 1
            is_new = True
    return n


@compiled
def _make_room(crowd: Any) -> None:
    """Room for what is drawn, or for the one trial that is drawn, where there was too little."""
    draft, offsets = crowd.draft[0], crowd.offsets
    crowd.channels, crowd.offsets, crowd.onsets, crowd.classes = longer_buffers(
        crowd.task, crowd.channels, offsets, crowd.onsets, crowd.classes, crowd.draft
    )
    crowd.events = widened(crowd.events, draft.n_events + 1)
    crowd.parts = widened(crowd.parts, draft.occurrence)


@compiled
def step_trials(
    crowd: Any,
    actions: NDArray[Any],
) -> tuple[int, int, int, bool]:
    """One step of every environment: writes the `results` and, of trials that ended, the `report`.

    Returns the number of the first environment with a bad action (−1: none; else nothing has been
    done), the number of environments now over, the number of trials that ended, and whether the
    report is a new array, since the old one was too short.
    """
    bad = first_bad_action(actions, crowd.most, crowd.over[: crowd.n_over])
    if bad >= 0:
        return bad, crowd.n_over, 0, False
    _forget(crowd)
    clear_all(crowd)
    over, emitted, rewards = crowd.over, crowd.emitted, crowd.results.rewards
    bins = crowd.clock[0]
    if crowd.feedback == DENSE:
        for i in range(actions.size):
            rewards[i] = _dense_reward(
                crowd.state[i], bins[i], actions[i], crowd.task, crowd.parts[i], crowd.tolerance
            )
        for i in over[: crowd.n_over]:
            rewards[i] = 0.0
    for i in range(actions.size):
        bins[i] += 1
        emitted[i] += actions[i]
    if crowd.autoreset == NEXT_STEP:
        begin_trials(crowd, over[: crowd.n_over])

    n_over = show_due(crowd)
    for k in range(n_over):
        over[k] = crowd.ended[k]
    crowd.n_over = n_over
    is_new = _tell(crowd)
    if crowd.autoreset == SAME_STEP:
        set_aside(crowd)
        begin_trials(crowd, over[:n_over])
        crowd.n_over = 0
    return -1, n_over, crowd.n_told, is_new


@compiled
def _forget(crowd: Any) -> None:
    """Clear the results of the trials that the last step ended."""
    rewards, terminated, truncated, labels, outputs, pattern_bins = crowd.results
    for k in range(crowd.n_told):
        i = crowd.heads[k, 0]
        rewards[i], terminated[i], labels[i], outputs[i], pattern_bins[i] = 0.0, False, 0, 0, 0
    fill_zero(truncated)


@compiled
def _tell(crowd: Any) -> bool:
    """Write results and report of the environments that are over; whether the report is new."""
    rewards, terminated, truncated, labels, outputs, pattern_bins = crowd.results
    report, room, heads = crowd.report, crowd.report.size, crowd.heads
    bins, deadlines = crowd.clock[0], crowd.clock[3]
    n_told = end = 0
    for i in crowd.over[: crowd.n_over]:
        truncated[i] = bins[i] == deadlines[i]
        if is_used_up(crowd, i):
            s, output = crowd.state[i], crowd.emitted[i]
            terminated[i] = True
            labels[i], outputs[i], pattern_bins[i] = s.label, output, crowd.task.pattern_bins
            if crowd.feedback != DENSE:
                rewards[i] = compiled_reward_for(
                    s.label - output, crowd.tolerance, crowd.feedback == SIGN
                )
            report = _reported(
                report, heads[n_told], end, i, crowd.parts[i, : s.n_occurrences],
                crowd.task.targets,
            )  # fmt: skip
            end = heads[n_told, 4]
            n_told += 1
    crowd.n_told, crowd.report = n_told, report
    return report.size > room


@compiled
def report_of(crowd: Any) -> NDArray[np.int64]:
    """The report of the trials that the last step ended."""
    return crowd.report


@compiled
def _dense_reward(
    s: Any,
    bin_: int,
    action: float,
    task: TaskArrays,
    occurrences: NDArray[np.int64],
    tolerance: float,
) -> float:
    """−1 per output in noise, −|target − output| at the end of an occurrence."""
    if s.occurrence == s.n_occurrences or bin_ < occurrences[s.occurrence] >> 32:
        return 0.0 - action
    s.given += action
    if bin_ + 1 < (occurrences[s.occurrence] >> 32) + task.pattern_bins:
        return 0.0
    error = task.targets[occurrences[s.occurrence] & 0xFFFFFFFF] - s.given
    s.occurrence += 1
    s.given = 0.0
    return float(compiled_reward_for(error, tolerance, False))


@compiled
def _reported(
    report: NDArray[np.int64],
    head: NDArray[np.int64],
    first: int,
    i: int,
    occurrences: NDArray[np.int64],
    targets: NDArray[np.int64],
) -> NDArray[np.int64]:
    """The report with the occurrences of environment `i` from `first` on; `head` says where."""
    n = occurrences.size
    if first + 3 * n > report.size:
        longer = np.empty(2 * (first + 3 * n), np.int64)
        for j in range(first):
            longer[j] = report[j]
        report = longer
    for k in range(n):
        class_ = occurrences[k] & 0xFFFFFFFF
        report[first + k] = occurrences[k] >> 32
        report[first + n + k] = class_
        report[first + 2 * n + k] = targets[class_]
    head[0] = i
    for part in range(4):
        head[1 + part] = first + part * n
    return report
