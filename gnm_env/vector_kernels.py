"""Compiled steps of the vector environments: one call for all environments and everything in them.

Most bins hold no spike, so that most environments have little to do in a step: their bins and their
output are counted on, all at once. `clock` has a row for each number that this takes, uint32
(4, n): the bin shown, the bin at which the environment needs a look (its next spike, or an end),
the next of its events, and the bin at which the episode is truncated.

The spikes of an environment wait in its row of `events`. An event is a bin and a channel in one
number: bin · 2^shift + channel; channel 2^shift − 1 marks the end of what was drawn. Occurrences
wait in a row of `parts`: first bin · 2^32 + class. A row that proves too short makes all rows
longer. Every environment draws from a generator of its own: what it hears depends on no others.
`shown` are the places of all ones in the observations, which the next step clears again.

All of this is in one struct, since an argument costs a compiled call as much as some environments.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.experimental import structref
from numpy.typing import NDArray

from gnm_env.compiled import compiled
from gnm_env.rules import compiled_mistake, compiled_reward_for
from gnm_env.sampling import (
    DRAFT,
    append_piece,
    begin_trial,
    fill_trial,
    longer_buffers,
)
from gnm_env.task import TaskArrays

NEXT_STEP, SAME_STEP, DISABLED = 0, 1, 2
COST, SIGN, DENSE = 0, 1, 2
NO_LIMIT = 2**30
"""Stands for an episode of any length; bins are counted in 32 bits."""

TRIAL_STATE = np.dtype(
    [
        ("label", np.int64),
        ("n_occurrences", np.int64),
        ("occurrence", np.int64),  # the next occurrence to end, and the output in it so far
        ("given", np.float64),
    ]
)

STREAM_STATE = np.dtype(
    [
        ("n_bins", np.int64),  # of the present piece; bins count from its beginning
        ("n_noise", np.int64),
        ("class_", np.int64),
        ("count", np.int64),  # spikes in the present occurrence
        ("noise_left", np.float64),
        ("anew", np.int64),  # the generator is new, and so is the stream
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


class StreamResults(NamedTuple):
    """What a step of streams tells, (n,) each; numbers and classes of mistakes."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    mistakes: NDArray[np.int64]
    classes: NDArray[np.int64]


@structref.register
class CrowdType(types.StructRef):
    """Numba's type of a Crowd."""

    def preprocess_fields(self, fields: Any) -> Any:
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class Crowd(structref.StructRefProxy):
    """All that the environments have between steps, for compiled code; made by `new_crowd`."""


structref.define_boxing(CrowdType, Crowd)
structref.define_constructor(
    Crowd,
    CrowdType,
    [
        "held",  # the generators
        "task",
        "autoreset",
        "limit",  # bins after which an episode is truncated
        "most",  # greatest action
        "feedback",
        "tolerance",
        "clock",
        "state",  # TRIAL_STATE or STREAM_STATE (n,)
        "emitted",  # output in the present trial (n,)
        "events",  # int32 or int64 (n, width)
        "shift",
        "parts",  # int64 (n, width)
        "observations",  # int8 (n, N)
        "shown",
        "n_shown",
        "over",  # over[:n_over]: the environments that the last step ended
        "n_over",
        "finals",  # their last observations, under SAME_STEP
        "results",  # TrialResults or StreamResults of the last step
        "report",  # of the trials that it ended: onsets, classes and targets of each
        "heads",  # int64 (n, 5): environment, where these three begin, and their end
        "n_told",  # number of these trials
        "looks",  # room for a number per environment, and again
        "ended",
        "channels",  # room for what is drawn
        "offsets",
        "onsets",
        "classes",
        "draft",
    ],
)


@compiled
def new_crowd(
    held: Any,
    task: TaskArrays,
    autoreset: int,
    limit: int,
    most: float,
    feedback: int,
    tolerance: float,
    state: Any,
    emitted: NDArray[Any],
    events: NDArray[Any],
    observations: NDArray[np.int8],
    over: NDArray[np.int64],
    finals: NDArray[np.int8],
    results: Any,
    heads: NDArray[np.int64],
) -> Any:
    """A Crowd in which no environment has begun."""
    n = observations.shape[0]
    return Crowd(
        held, task, autoreset, limit, most, feedback, tolerance,
        np.zeros((4, n), np.uint32), state, emitted,
        events, event_shift(observations.shape[1]), np.zeros((n, 8), np.int64),
        # Under SAME_STEP a row may be shown twice in a step: its last bin, and the first anew.
        observations, np.empty(2 * observations.size + 1, np.uint64), 0,
        over, 0, finals, results, np.empty(64, np.int64), heads, 0,
        np.empty(n, np.uint32), np.empty(n, np.uint32),
        np.empty(1_024, np.int32), np.zeros(1_024, np.int64), np.empty(64, np.int64),
        np.empty(64, np.int64), np.zeros(1, DRAFT),
    )  # fmt: skip


@compiled
def event_shift(n_inputs: int) -> int:
    """Bits for a channel in an event; the number that has them all set is no channel."""
    shift = 1
    while (1 << shift) - 1 < n_inputs:
        shift += 1
    return shift


@compiled
def _widened(rows: NDArray[Any], width: int) -> NDArray[Any]:
    """`rows` if they hold `width` entries, else a longer copy of them."""
    if width <= rows.shape[1]:
        return rows
    wider = np.empty((rows.shape[0], width + width // 8 + 8), rows.dtype)
    for k in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            wider[k, j] = rows[k, j]
    return wider


@compiled
def _store(
    events: NDArray[Any],
    i: int,
    shift: int,
    n_bins: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
) -> None:
    """Put the spikes of `n_bins` bins into row `i` of the events, and their end behind them."""
    n_events = offsets[n_bins]
    row = events[i]
    for e in range(n_events):
        row[e] = 0
    # Every bin is written to where its spikes begin; an empty one is overwritten by the next, and
    # further spikes of a bin take the bin of those before. No branch depends on the spikes.
    for t in range(n_bins):
        row[np.uint64(offsets[t])] = t
    bin_ = 0
    for e in range(n_events):
        bin_ = max(bin_, row[e])
        row[e] = (bin_ << shift) + channels[e]
    row[n_events] = ((n_bins + 1) << shift) - 1


@compiled
def _show(crowd: Any, n: int) -> int:
    """Show the spikes of the present bin in the rows `looks[:n]`, which are clear.

    Notes for each when to look again. Puts those that are at the end of what was drawn, or at their
    deadline, into `ended`; returns their number. `looks` is used up.

    All rows show one spike, then those that have another show the next, and so on: no branch
    depends on how many spikes a bin has.
    """
    bins, due, cursors, deadlines = crowd.clock[0], crowd.clock[1], crowd.clock[2], crowd.clock[3]
    events, shift, looks, ended = crowd.events, crowd.shift, crowd.looks, crowd.ended
    shown, n_shown, n_inputs = crowd.shown, crowd.n_shown, crowd.observations.shape[1]
    end = (1 << shift) - 1
    n_ended = 0
    while n > 0:
        n_more = 0
        for k in range(n):
            i = looks[np.uint32(k)]
            bin_ = np.int64(bins[i]) << shift
            cursor, deadline = cursors[i], deadlines[i]
            # Within the bin this is the channel; at the end of what was drawn `end`, in later bins
            # more. Places that turn out to hold no spike are overwritten by the next.
            channel = events[i, cursor] - bin_
            shown[np.uint64(n_shown)] = np.int64(i) * n_inputs + channel
            is_spike = channel < end
            n_shown += is_spike
            cursor = np.uint32(cursor + is_spike)
            cursors[i] = cursor
            channel = events[i, cursor] - bin_
            due[i] = min((channel + bin_) >> shift, np.int64(deadline))
            more = channel < end
            looks[np.uint32(n_more)] = i
            n_more += more
            ended[np.uint32(n_ended)] = i
            n_ended += (not more) & ((channel == end) | (bin_ >> shift == deadline))
        n = n_more
    places = crowd.observations.reshape(-1)
    for k in range(crowd.n_shown, n_shown):
        places[shown[np.uint64(k)]] = 1
    crowd.n_shown = n_shown
    return n_ended


@compiled
def _show_due(crowd: Any) -> int:
    """`_show` for all rows that need a look in the present bin."""
    bins, due, looks = crowd.clock[0], crowd.clock[1], crowd.looks
    n = 0
    for i in range(looks.size):
        looks[n] = i
        n += bins[i] == due[i]
    return _show(crowd, n)


@compiled
def _show_first(crowd: Any, which: NDArray[Any]) -> None:
    """Show the spikes of the bin at which each environment in `which` begins."""
    for k in range(which.size):
        crowd.looks[k] = which[k]
    _show(crowd, which.size)


@compiled
def _clear(crowd: Any) -> None:
    """Clear all ones."""
    places = crowd.observations.reshape(-1)
    for place in crowd.shown[: crowd.n_shown]:
        places[place] = 0
    crowd.n_shown = 0


@compiled
def clear_rows(crowd: Any, which: NDArray[np.bool_]) -> int:
    """Clear the rows `which`, and forget that their environments are over.

    Returns the number of environments that are still over.
    """
    n_inputs = crowd.observations.shape[1]
    n_shown = 0
    for place in crowd.shown[: crowd.n_shown]:
        i = np.int64(place) // n_inputs
        if which[i]:
            crowd.observations[i, np.int64(place) - i * n_inputs] = 0
        else:
            crowd.shown[n_shown] = place
            n_shown += 1
    crowd.n_shown = n_shown
    n_over = 0
    for i in crowd.over[: crowd.n_over]:
        if not which[i]:
            crowd.over[n_over] = i
            n_over += 1
    crowd.n_over = n_over
    return n_over


@compiled
def _set_aside(crowd: Any) -> None:
    """Move the observations of the environments that are over to `finals`."""
    for k in range(crowd.n_over):
        row = crowd.observations[crowd.over[k]]
        for channel in range(row.size):
            crowd.finals[k, channel] = row[channel]
            row[channel] = 0


@compiled
def _first_bad_action(actions: NDArray[Any], most: float, over: NDArray[np.int64]) -> int:
    """The first environment whose action is not in 0 … `most`, or −1; those `over` do not count."""
    n_bad = 0
    for i in range(actions.size):
        n_bad += not 0 <= actions[i] <= most
    if n_bad > 0:
        for i in range(actions.size):
            if not 0 <= actions[i] <= most and not np.any(over == i):
                return i
    return -1


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
    _show_first(crowd, which)


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
            _store(events, i, shift, n_bins, channels, offsets)
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
    crowd.events = _widened(crowd.events, draft.n_events + 1)
    crowd.parts = _widened(crowd.parts, draft.occurrence)


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
    bad = _first_bad_action(actions, crowd.most, crowd.over[: crowd.n_over])
    if bad >= 0:
        return bad, crowd.n_over, 0, False
    _forget(crowd)
    _clear(crowd)
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

    n_over = _show_due(crowd)
    for k in range(n_over):
        over[k] = crowd.ended[k]
    crowd.n_over = n_over
    is_new = _tell(crowd)
    if crowd.autoreset == SAME_STEP:
        _set_aside(crowd)
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
    _zero(truncated)


@compiled
def _tell(crowd: Any) -> bool:
    """Write results and report of the environments that are over; whether the report is new."""
    rewards, terminated, truncated, labels, outputs, pattern_bins = crowd.results
    report, room, heads = crowd.report, crowd.report.size, crowd.heads
    bins, deadlines = crowd.clock[0], crowd.clock[3]
    n_told = end = 0
    for i in crowd.over[: crowd.n_over]:
        truncated[i] = bins[i] == deadlines[i]
        if _is_used_up(crowd, i):
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
def _zero(array: NDArray[Any]) -> None:
    for i in range(array.size):
        array[i] = 0


@compiled
def _is_used_up(crowd: Any, i: int) -> bool:
    """Whether what was drawn for environment `i`, whose present bin is shown, ends here."""
    left = crowd.events[i, crowd.clock[2, i]]
    return left >> crowd.shift == crowd.clock[0, i]


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


@compiled
def _go_on(crowd: Any, which: NDArray[Any], begin: bool) -> None:
    """Show the next bin of each stream in `which`, whose rows are clear.

    Where a piece is used up, that is the first of the next piece. With `begin` an episode begins in
    each: it goes on after the bin shown last or, where that lies in a pattern, after the pattern.
    """
    if which.size == 0:
        return
    channels, offsets = crowd.channels, crowd.offsets
    held, task, state = crowd.held, crowd.task, crowd.state
    events, shift = crowd.events, crowd.shift
    bins, cursors, deadlines = crowd.clock[0], crowd.clock[2], crowd.clock[3]
    for i in which:
        s = state[i]
        if begin and not s.anew and bins[i] < s.n_noise and bins[i] + 1 < s.n_bins:
            bins[i] += 1
        else:
            if s.anew:
                s.anew, s.noise_left = 0, -1.0
            channels, offsets, s.n_noise, s.class_, s.noise_left = append_piece(
                held[i], task, s.noise_left, channels, offsets, 0
            )
            s.n_bins = s.n_noise + (task.pattern_bins if s.class_ >= 0 else 0)
            if offsets[s.n_bins] >= events.shape[1]:
                events = _widened(events, offsets[s.n_bins] + 1)
            _store(events, i, shift, s.n_bins, channels, offsets)
            if crowd.limit < NO_LIMIT:
                deadlines[i] -= bins[i]
            bins[i], cursors[i] = 0, 0
        s.count = 0
        if begin:
            deadlines[i] = bins[i] + crowd.limit
    crowd.events, crowd.channels, crowd.offsets = events, channels, offsets
    _show_first(crowd, which)


@compiled
def begin_streams(crowd: Any, which: NDArray[np.int64]) -> None:
    """Begin an episode in each environment in `which` and show its first bin; rows are clear."""
    _go_on(crowd, which, True)


@compiled
def step_streams(
    crowd: Any,
    actions: NDArray[np.int64],
) -> tuple[int, int]:
    """One step of every environment: writes the `results`; returns as `step_trials` does."""
    bad = _first_bad_action(actions, crowd.most, crowd.over[: crowd.n_over])
    if bad >= 0:
        return bad, crowd.n_over
    rewards, terminated, truncated, mistakes, classes = crowd.results
    _zero(terminated)
    _zero(truncated)
    _zero(mistakes)
    _zero(classes)
    _clear(crowd)
    over, bins = crowd.over, crowd.clock[0]
    for i in range(actions.size):
        rewards[i] = 1.0
    if crowd.autoreset == NEXT_STEP:
        _go_on(crowd, over[: crowd.n_over], True)
        for i in over[: crowd.n_over]:
            bins[i] -= 1  # below 0 it wraps around, and back by what follows
            rewards[i] = 0.0
    for i in range(actions.size):
        bins[i] += 1

    _show_due(crowd)
    n_used_up = _judge(crowd, actions)
    _go_on(crowd, crowd.looks[:n_used_up], False)
    n_over = crowd.n_over
    if crowd.autoreset == SAME_STEP:
        _set_aside(crowd)
        _go_on(crowd, over[:n_over], True)
        crowd.n_over = 0
    return -1, n_over


@compiled
def _judge(crowd: Any, actions: NDArray[np.int64]) -> int:
    """Judge the answers to the last bin, and write the results of streams that are over.

    Returns the number of streams whose piece is used up; they stand at the beginning of `looks`.
    """
    rewards, terminated, truncated, mistakes, classes = crowd.results
    over, looks = crowd.over, crowd.looks
    bins, due, deadlines = crowd.clock[0], crowd.clock[1], crowd.clock[3]
    # Only those at an end are still due.
    n_looks = 0
    for i in range(actions.size):
        looks[n_looks] = i
        n_looks += (bins[i] == due[i]) | ((actions[i] != 0) & (rewards[i] != 0.0))
    n_over = n_used_up = 0
    for i in looks[:n_looks]:
        used_up = _is_used_up(crowd, i)
        if used_up or actions[i] != 0:
            mistake, class_ = _mistake(crowd.state[i], bins[i], actions[i], crowd.task.targets)
            if mistake:
                rewards[i] = 0.0
                terminated[i] = True
                mistakes[i], classes[i] = mistake, class_
        truncated[i] = bins[i] == deadlines[i]
        if terminated[i] or truncated[i]:
            over[n_over] = i
            n_over += 1
        if used_up:
            looks[n_used_up] = i  # in the place of one that has been looked at
            n_used_up += 1
    crowd.n_over = n_over
    return n_used_up


@compiled
def _mistake(s: Any, next_bin: int, spike: int, targets: NDArray[np.int64]) -> tuple[int, int]:
    """Mistake in answering the bin before `next_bin` with `spike`, and the class (−1: noise)."""
    if next_bin <= s.n_noise:
        return spike, -1
    s.count += spike
    last_bin = next_bin == s.n_bins
    return compiled_mistake(s.count, targets[s.class_], False, last_bin), s.class_
