"""Compiled steps of many trials at once; `gnm_env.base.kernels` says how they are laid out.

Trials are drawn from a task or heard from a data set. `begin_…` and `step_…` are there once for
each, as `drawn` and `recorded`.
"""

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
    show_first,
    show_pending,
    store_events,
    widened,
)
from gnm_env.compiled import compiled, inlined, specialise
from gnm_env.rules import compiled_dense_reward, compiled_reward_for
from gnm_env.sampling import begin_trial, fill_trial, longer_buffers
from gnm_env.segments import compiled_segment_at, fill_segments

TRIAL_STATE = np.dtype(
    [
        ("label", np.int64),
        ("n_bins", np.int64),
        ("n_presentations", np.int64),
        ("pattern_bins", np.int64),  # bins of each presentation; 0 where they differ
        ("label_only", np.int64),  # whether it is not known where the label was earned
        ("segment", np.int64),  # the present segment, and the output in it so far
        ("given", np.float64),
        ("number", np.int64),  # of the trial in the data set
        ("n_heard", np.int64),  # trials of the present epoch, where they come from a data set
        ("anew", np.int64),  # the generator is new, and so is the epoch
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
    label_only: NDArray[np.bool_]


class Recorded(NamedTuple):
    """A data set as the source of trials."""

    trials: Any
    """TrialsArrays, shared by all environments."""
    pattern_bins: int
    """Bins of each presentation, told of trials that have none; 0 where they differ."""
    orders: NDArray[np.uint32]
    """(n, trials), the order of the trials in the present epoch of each environment."""


def begin_trials(state: Any, which: NDArray[np.int64]) -> None:
    """Begin a trial in each environment in `which` and show its first bin; their rows are clear."""
    n_begun = 0
    is_new = True
    while n_begun < which.size:
        n_begun = fetch(state, which, n_begun, is_new)
        if n_begun < which.size:
            is_new = False
            make_room(state, which[n_begun])
    show_first(state, which)


def fetch(state: Any, which: NDArray[np.int64], first: int, is_new: bool) -> int:
    """Put trials for `which[first:]` into their rows, the first of them perhaps begun already.

    Returns the place in `which` of the environment for which there was not enough room, or the
    number of all. No array is exchanged for a longer one in here: numba counts references to those
    that are.
    """
    raise NotImplementedError  # `specialise` puts one function for each source in its place


def make_room(state: Any, i: int) -> None:
    """Room for the trial that environment `i` is about to hear."""
    raise NotImplementedError  # likewise


def report_trial(state: Any, i: int, report: NDArray[np.int64], first: int) -> int:
    """Report the presentations of environment `i` from `first` on; returns where they end."""
    raise NotImplementedError  # likewise


@inlined
def _begin(state: Any, i: int, label: int, n_bins: int, n_presentations: int) -> None:
    """Environment `i` begins a trial: nothing heard and nothing given yet."""
    counters, s = state.counters, state.episodes.records[i]
    s.label, s.n_bins, s.n_presentations = label, n_bins, n_presentations
    s.segment, s.given = 0, 0.0
    state.episodes.emitted[i] = 0
    counters.bin_[i], counters.event[i], counters.deadline[i] = 0, 0, state.config.limit


# Trials that are drawn from a task.


@compiled
def _draw_trials(state: Any, which: NDArray[np.int64], first: int, is_new: bool) -> int:
    """`fetch` of trials that are drawn."""
    rngs, task, config = state.rngs, state.source, state.config
    ahead, room = state.ahead, state.room
    events, presentations = ahead.events, ahead.presentations
    channels, offsets, onsets, classes = room.channels, room.offsets, room.onsets, room.classes
    draft = room.draft
    n = first
    fits = True
    while fits and n < which.size:
        i = which[n]
        if is_new:
            begin_trial(draft, offsets, 0, 0)
        fits = fill_trial(rngs[i], task, channels, offsets, onsets, classes, draft)
        n_bins, n_presentations = draft[0].bin_, draft[0].presentation
        fits = fits and offsets[n_bins] < events.shape[1]
        fits = fits and n_presentations <= presentations.shape[1]
        if fits:
            store_events(events, i, config.shift, n_bins, channels, offsets)
            for k in range(n_presentations):
                presentations[i, k] = (onsets[k] << 32) + classes[k]
            if config.feedback == DENSE:
                _store_segments(state, i, n_presentations, n_bins)
            _begin(state, i, draft[0].label, n_bins, n_presentations)
            state.episodes.records[i].pattern_bins = task.pattern_bins
            n += 1
            is_new = True
    return n


@compiled
def _store_segments(state: Any, i: int, n: int, n_bins: int) -> None:
    """Put the segments of the drawn trial, with `n` presentations, into row `i`."""
    task, ahead = state.source, state.ahead
    onsets, classes = state.room.onsets[:n], state.room.classes[:n]
    _widen_segments(ahead, n)
    fill_segments(
        onsets, onsets + task.pattern_bins, task.targets[classes], n_bins,
        ahead.edges[i], ahead.target[i],
    )  # fmt: skip


@compiled
def _widen_segments(ahead: Any, n: int) -> None:
    """Rows for the segments of a trial with `n` presentations."""
    ahead.edges = widened(ahead.edges, 2 * n + 2)
    ahead.target = widened(ahead.target, 2 * n + 1)


@compiled
def _draw_room(state: Any, i: int) -> None:
    """`make_room` for what is drawn, or for the one trial that is drawn."""
    room, ahead = state.room, state.ahead
    room.channels, room.offsets, room.onsets, room.classes = longer_buffers(
        state.source, room.channels, room.offsets, room.onsets, room.classes, room.draft
    )
    draft = room.draft[0]
    ahead.events = widened(ahead.events, draft.n_events + 1)
    ahead.presentations = widened(ahead.presentations, draft.presentation)


@compiled
def _report_drawn(state: Any, i: int, report: NDArray[np.int64], first: int) -> int:
    """`report_trial` of a trial that was drawn."""
    targets, presentations = state.source.targets, state.ahead.presentations
    n = state.episodes.records[i].n_presentations
    for k in range(n):
        class_ = presentations[i, k] & 0xFFFFFFFF
        report[first + k] = presentations[i, k] >> 32
        report[first + n + k] = class_
        report[first + 2 * n + k] = targets[class_]
    return first + 3 * n


# Trials of a data set: what waits of them are their events, all else stays where it is.


@compiled
def _hear_trials(state: Any, which: NDArray[np.int64], first: int, is_new: bool) -> int:
    """`fetch` of the trials that come next in the data set's order."""
    trials, events = state.source.trials, state.ahead.events
    n = first
    while n < which.size:
        i = which[n]
        number = _next_number(state, i)
        if trials.first_spike[number + 1] - trials.first_spike[number] >= events.shape[1]:
            return n
        _copy_trial(state, i, number)
        s = state.episodes.records[i]
        s.number = number
        s.n_heard += 1
        n += 1
    return n


@compiled
def _next_number(state: Any, i: int) -> int:
    """Number of the trial that environment `i` hears next; draws an order where an epoch begins."""
    s, order = state.episodes.records[i], state.source.orders[i]
    if s.anew or s.n_heard == order.size:
        drawn = state.rngs[i].permutation(order.size)
        for k in range(order.size):
            order[k] = drawn[k]
        s.n_heard, s.anew = 0, 0
    return int(order[s.n_heard])


@compiled
def _copy_trial(state: Any, i: int, number: int) -> None:
    """Begin trial `number` of the data set in environment `i`; there is room for its events."""
    trials, ahead, config = state.source.trials, state.ahead, state.config
    first, edge = trials.first_spike[number], trials.first_edge[number]
    n_events = trials.first_spike[number + 1] - first
    n = (trials.first_edge[number + 1] - edge - 2) // 2
    n_bins = trials.edges[edge + 2 * n + 1]
    for e in range(n_events):
        bin_ = np.int64(trials.bins[first + e])
        ahead.events[i, e] = (bin_ << config.shift) + trials.channels[first + e]
    ahead.events[i, n_events] = ((n_bins + 1) << config.shift) - 1
    edges = trials.edges[edge : edge + 2 * n + 2]
    target = trials.target[edge : edge + 2 * n + 1]
    if config.feedback == DENSE:
        _widen_segments(ahead, n)
        for k in range(2 * n + 1):
            ahead.edges[i, k], ahead.target[i, k] = edges[k], target[k]
        ahead.edges[i, 2 * n + 1] = n_bins
    _begin(state, i, target.sum(), n_bins, n)
    s = state.episodes.records[i]
    s.label_only = trials.label_only[number]
    s.pattern_bins = state.source.pattern_bins if n == 0 else edges[2] - edges[1]
    for k in range(n):
        if edges[2 * k + 2] - edges[2 * k + 1] != s.pattern_bins:
            s.pattern_bins = 0


@compiled
def _hear_room(state: Any, i: int) -> None:
    """`make_room` for the next trial of the data set."""
    first_spike, number = state.source.trials.first_spike, _next_number(state, i)
    n_events = first_spike[number + 1] - first_spike[number]
    state.ahead.events = widened(state.ahead.events, n_events + 1)


@compiled
def _report_recorded(state: Any, i: int, report: NDArray[np.int64], first: int) -> int:
    """`report_trial` of a trial of the data set."""
    trials, s = state.source.trials, state.episodes.records[i]
    n, edge = s.n_presentations, trials.first_edge[s.number]
    for k in range(n):
        report[first + k] = trials.edges[edge + 2 * k + 1]
        report[first + n + k] = trials.classes[edge // 2 - s.number + k]
        report[first + 2 * n + k] = trials.target[edge + 2 * k + 1]
        if state.config.tells_ends:
            report[first + 3 * n + k] = trials.edges[edge + 2 * k + 2]
    return int(first + (4 * n if state.config.tells_ends else 3 * n))


def step_trials(state: Any, actions: NDArray[Any]) -> tuple[int, int, int, bool]:
    """One step of every environment: writes the `results` and, of trials that ended, the `report`.

    Returns the number of the first environment with a bad action (−1: none; else nothing has been
    changed), the number of environments now done, the number of trials that ended, and whether the
    report is a new array, since the old one was too short.
    """
    outcome, config, counters = state.outcome, state.config, state.counters
    done = outcome.done
    bad = first_bad_action(actions, config.most, done[: outcome.n_done])
    if bad >= 0:
        return bad, outcome.n_done, 0, False
    _forget(outcome)
    clear_all(state.display)
    if config.feedback == DENSE:
        _reward_densely(state, actions)
    bins, emitted = counters.bin_, state.episodes.emitted
    for i in range(actions.size):
        bins[i] += 1
        emitted[i] += actions[i]
    if config.autoreset == NEXT_STEP:
        begin_trials(state, done[: outcome.n_done])

    n_done = show_pending(state)
    ended = state.room.ended
    for k in range(n_done):
        done[k] = ended[k]
    outcome.n_done = n_done
    is_new = tell(state)
    if config.autoreset == SAME_STEP:
        set_aside(state.display, done[:n_done])
        begin_trials(state, done[:n_done])
        outcome.n_done = 0
    return -1, n_done, outcome.n_told, is_new


@compiled
def _forget(outcome: Any) -> None:
    """Clear the results of the trials that the last step ended."""
    results, heads = outcome.results, outcome.heads
    for k in range(outcome.n_told):
        i = heads[k, 0]
        results.rewards[i], results.terminated[i], results.labels[i] = 0.0, False, 0
        results.outputs[i], results.pattern_bins[i], results.label_only[i] = 0, 0, False
    fill_zero(results.truncated)


def tell(state: Any) -> bool:
    """Write results and report of the environments that are done; whether the report is new."""
    outcome, config, counters = state.outcome, state.config, state.counters
    results, heads, report = outcome.results, outcome.heads, outcome.report
    room = report.size
    n_told = end = 0
    for i in outcome.done[: outcome.n_done]:
        results.truncated[i] = counters.bin_[i] == counters.deadline[i]
        if is_used_up(state, i):
            s, output = state.episodes.records[i], state.episodes.emitted[i]
            results.terminated[i] = True
            results.labels[i], results.outputs[i] = s.label, output
            results.pattern_bins[i], results.label_only[i] = s.pattern_bins, s.label_only != 0
            if config.feedback != DENSE:
                results.rewards[i] = compiled_reward_for(
                    s.label - output, config.tolerance, config.feedback == SIGN
                )
            n = s.n_presentations
            if end + 4 * n > report.size:
                report = _longer(report, end, end + 4 * n)
            heads[n_told, 0] = i
            for part in range(4):
                heads[n_told, 1 + part] = end + part * n
            end = report_trial(state, i, report, end)
            n_told += 1
    outcome.n_told, outcome.report = n_told, report
    return report.size > room


@compiled
def _reward_densely(state: Any, actions: NDArray[Any]) -> None:
    """Dense feedback for the answers to the present bins; 0 for those who are done."""
    outcome, tolerance = state.outcome, state.config.tolerance
    edges, target, records = state.ahead.edges, state.ahead.target, state.episodes.records
    bins, rewards = state.counters.bin_, outcome.results.rewards
    for i in range(actions.size):
        s = records[i]
        rewards[i] = 0.0
        if bins[i] < s.n_bins:
            bin_ = np.int64(bins[i])
            segment = compiled_segment_at(edges[i], s.segment, bin_)
            if segment != s.segment:
                s.segment, s.given = segment, 0.0
            s.given += actions[i]
            rewards[i] = compiled_dense_reward(
                actions[i], s.given, target[i, segment], segment % 2 == 0,
                bin_ + 1 == edges[i, segment + 1], tolerance,
            )  # fmt: skip
    for i in outcome.done[: outcome.n_done]:
        rewards[i] = 0.0


@compiled
def _longer(report: NDArray[np.int64], used: int, needed: int) -> NDArray[np.int64]:
    longer = np.empty(2 * needed, np.int64)
    for j in range(used):
        longer[j] = report[j]
    return longer


# Last, since a specialised function knows only what stands above it.
begin_drawn = specialise(begin_trials, "drawn", fetch=_draw_trials, make_room=_draw_room)
begin_recorded = specialise(begin_trials, "recorded", fetch=_hear_trials, make_room=_hear_room)
step_drawn = specialise(
    step_trials,
    "drawn",
    begin_trials=begin_drawn,
    tell=specialise(tell, "drawn", report_trial=_report_drawn),
)
step_recorded = specialise(
    step_trials,
    "recorded",
    begin_trials=begin_recorded,
    tell=specialise(tell, "recorded", report_trial=_report_recorded),
)
