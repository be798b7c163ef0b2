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

from typing import Any

import numpy as np
from numba import types
from numba.experimental import structref
from numpy.typing import NDArray

from gnm_env.compiled import compiled
from gnm_env.sampling import DRAFT
from gnm_env.task import TaskArrays

NEXT_STEP, SAME_STEP, DISABLED = 0, 1, 2
COST, SIGN, DENSE = 0, 1, 2
NO_LIMIT = 2**30
"""Stands for an episode of any length; bins are counted in 32 bits."""


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
def widened(rows: NDArray[Any], width: int) -> NDArray[Any]:
    """`rows` if they hold `width` entries, else a longer copy of them."""
    if width <= rows.shape[1]:
        return rows
    wider = np.empty((rows.shape[0], width + width // 8 + 8), rows.dtype)
    for k in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            wider[k, j] = rows[k, j]
    return wider


@compiled
def store_events(
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
def show(crowd: Any, n: int) -> int:
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
def show_due(crowd: Any) -> int:
    """`show` for all rows that need a look in the present bin."""
    bins, due, looks = crowd.clock[0], crowd.clock[1], crowd.looks
    n = 0
    for i in range(looks.size):
        looks[n] = i
        n += bins[i] == due[i]
    return show(crowd, n)


@compiled
def show_first(crowd: Any, which: NDArray[Any]) -> None:
    """Show the spikes of the bin at which each environment in `which` begins."""
    for k in range(which.size):
        crowd.looks[k] = which[k]
    show(crowd, which.size)


@compiled
def clear_all(crowd: Any) -> None:
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
def set_aside(crowd: Any) -> None:
    """Move the observations of the environments that are over to `finals`."""
    for k in range(crowd.n_over):
        row = crowd.observations[crowd.over[k]]
        for channel in range(row.size):
            crowd.finals[k, channel] = row[channel]
            row[channel] = 0


@compiled
def first_bad_action(actions: NDArray[Any], most: float, over: NDArray[np.int64]) -> int:
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
def fill_zero(array: NDArray[Any]) -> None:
    for i in range(array.size):
        array[i] = 0


@compiled
def is_used_up(crowd: Any, i: int) -> bool:
    """Whether what was drawn for environment `i`, whose present bin is shown, ends here."""
    left = crowd.events[i, crowd.clock[2, i]]
    return left >> crowd.shift == crowd.clock[0, i]
