"""Compiled steps of the vector environments: one call for all environments and everything in them.

Most bins hold no spike, so that most environments have little to do in a step: the step counters
and the output of all are counted on at once, and only the environments that are pending, since a
spike or an end falls into the bin, are looked at one by one.

The spikes of an environment wait in its row of `events`. An event is a bin and a channel in one
number: bin · 2^shift + channel; channel 2^shift − 1 marks the end of what was drawn. Presentations
that were drawn wait in a row of their own, in one number each too: first bin · 2^32 + class. For
dense feedback there are the segments of the trial besides. A row that proves too short makes all
rows longer. Every environment draws from a generator of its own: what it hears depends on no
others. `shown` are the places of all ones in the observations, which the next step clears again.

All of this is in one record, since an argument costs a compiled call as much as some environments.
Its parts are records in turn, by meaning; those that change hold their arrays by reference.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import types
from numba.experimental import structref
from numpy.typing import NDArray

from gnm_env.compiled import compiled
from gnm_env.sampling import DRAFT

NEXT_STEP, SAME_STEP, DISABLED = 0, 1, 2
COST, SIGN, DENSE = 0, 1, 2


class Config(NamedTuple):
    """What never changes."""

    autoreset: int
    limit: int
    """Bins after which an episode is truncated."""
    most: float
    """Greatest action."""
    feedback: int
    tolerance: float
    tells_ends: bool
    """Whether trials tell where their presentations end."""
    shift: int
    """Bits for a channel in an event."""


class StepCounters(NamedTuple):
    """What is counted in bins or events, uint32 (n,) each."""

    bin_: NDArray[np.uint32]
    """The bin shown."""
    pending_bin: NDArray[np.uint32]
    """The bin at which the environment needs a look: its next spike, or an end."""
    event: NDArray[np.uint32]
    """The next of its events."""
    deadline: NDArray[np.uint32]
    """The bin at which the episode is truncated."""


class Episodes(NamedTuple):
    """The state of each episode."""

    records: NDArray[Any]
    """(n,) of TRIAL_STATE or STREAM_STATE."""
    emitted: NDArray[Any]
    """Output in the present trial, (n,)."""


class DisplayArrays(NamedTuple):
    """What is seen."""

    observations: NDArray[np.int8]
    """(n, N)."""
    final_obs: NDArray[np.int8]
    """Last observations of the episodes that are done, under SAME_STEP."""
    shown: NDArray[np.uint64]
    """Places of the ones in `observations`."""


class OutcomeArrays(NamedTuple):
    """What the last step told."""

    done: NDArray[np.int64]
    """The environments whose episodes are done stand at its beginning."""
    results: Any
    """TrialResults or StreamResults."""
    heads: NDArray[np.int64]
    """(n, 5), for each trial in `report`: the environment, where three lists begin, their end."""


class Growing(NamedTuple):
    """What a step may exchange for something longer, or count on; all that a copy needs to know."""

    events: NDArray[Any]
    """int32 or int64 (n, width)."""
    presentations: NDArray[np.int64]
    """(n, width), of drawn trials."""
    edges: NDArray[np.int64]
    """Segments of the present trial, a row each; see `gnm_env.segments`. For dense feedback."""
    target: NDArray[np.int64]
    report: NDArray[np.int64]
    """Onsets, classes, targets, and ends if asked for, of each trial that the last step ended."""
    n_shown: int
    n_done: int
    n_told: int


class _Record(types.StructRef):
    """Numba's type of a record."""

    def preprocess_fields(self, fields: Any) -> Any:
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Proxy(structref.StructRefProxy):
    """A record as Python sees it; compiled code makes it from its parts by name."""

    if TYPE_CHECKING:

        def __new__(cls, **parts: Any) -> Any: ...


@structref.register
class AheadType(_Record):
    """Type of Ahead."""


class Ahead(_Proxy):
    """What waits to be shown, a row for each environment; as in Growing."""


structref.define_constructor(Ahead, AheadType, ["events", "presentations", "edges", "target"])


@structref.register
class DisplayType(_Record):
    """Type of Display."""


class Display(_Proxy):
    """What is seen; as in DisplayArrays and Growing."""


structref.define_constructor(
    Display, DisplayType, ["observations", "final_obs", "shown", "n_shown"]
)


@structref.register
class OutcomeType(_Record):
    """Type of Outcome."""


class Outcome(_Proxy):
    """What the last step told; as in OutcomeArrays and Growing."""


structref.define_constructor(
    Outcome, OutcomeType, ["done", "n_done", "results", "report", "heads", "n_told"]
)


@structref.register
class RoomType(_Record):
    """Type of Room."""


class Room(_Proxy):
    """Room for what is drawn and for lists of environments; nothing in it outlives a step."""


structref.define_constructor(
    Room,
    RoomType,
    [
        "pending",  # environments that are to be looked at
        "ended",  # those that are found at an end
        "channels",
        "offsets",
        "onsets",
        "classes",
        "draft",
    ],
)


@structref.register
class VectorStateType(_Record):
    """Type of VectorState."""


class VectorState(_Proxy):
    """All that the environments have between steps, for compiled code; made by `new_state`."""


structref.define_boxing(VectorStateType, VectorState)
structref.define_constructor(
    VectorState,
    VectorStateType,
    [
        "rngs",  # the generators
        "source",  # where trials come from: a task, or a data set
        "config",
        "counters",
        "episodes",
        "ahead",
        "display",
        "outcome",
        "room",
    ],
)


@compiled
def new_state(
    rngs: Any,
    source: Any,
    config: Config,
    counters: StepCounters,
    episodes: Episodes,
    display: DisplayArrays,
    outcome: OutcomeArrays,
    growing: Growing,
) -> Any:
    """A VectorState of these arrays, which it shares."""
    n = display.observations.shape[0]
    return VectorState(
        rngs=rngs,
        source=source,
        config=config,
        counters=counters,
        episodes=episodes,
        ahead=Ahead(
            events=growing.events,
            presentations=growing.presentations,
            edges=growing.edges,
            target=growing.target,
        ),
        display=Display(
            observations=display.observations,
            final_obs=display.final_obs,
            shown=display.shown,
            n_shown=growing.n_shown,
        ),
        outcome=Outcome(
            done=outcome.done,
            n_done=growing.n_done,
            results=outcome.results,
            report=growing.report,
            heads=outcome.heads,
            n_told=growing.n_told,
        ),
        room=Room(
            pending=np.empty(n, np.uint32),
            ended=np.empty(n, np.uint32),
            channels=np.empty(1_024, np.int32),
            offsets=np.zeros(1_024, np.int64),
            onsets=np.empty(64, np.int64),
            classes=np.empty(64, np.int64),
            draft=np.zeros(1, DRAFT),
        ),
    )


@compiled
def growing_of(state: Any) -> Growing:
    """What has grown in `state`, so that another can go on from there."""
    ahead, display, outcome = state.ahead, state.display, state.outcome
    return Growing(
        ahead.events,
        ahead.presentations,
        ahead.edges,
        ahead.target,
        outcome.report,
        display.n_shown,
        outcome.n_done,
        outcome.n_told,
    )


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
def show(state: Any, n: int) -> int:
    """Show the spikes of the present bin in the rows `pending[:n]`, which are clear.

    Notes for each when to look again. Puts those that are at the end of what was drawn, or at their
    deadline, into `ended`; returns their number. `pending` is used up.

    All rows show one spike, then those that have another show the next, and so on: no branch
    depends on how many spikes a bin has.
    """
    bins, pending_bins, cursors, deadlines = state.counters
    display, room = state.display, state.room
    events, shift, pending, ended = state.ahead.events, state.config.shift, room.pending, room.ended
    shown, n_shown, n_inputs = display.shown, display.n_shown, display.observations.shape[1]
    end = (1 << shift) - 1
    n_ended = 0
    while n > 0:
        n_more = 0
        for k in range(n):
            i = pending[np.uint32(k)]
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
            pending_bins[i] = min((channel + bin_) >> shift, np.int64(deadline))
            more = channel < end
            pending[np.uint32(n_more)] = i
            n_more += more
            ended[np.uint32(n_ended)] = i
            n_ended += (not more) & ((channel == end) | (bin_ >> shift == deadline))
        n = n_more
    places = display.observations.reshape(-1)
    for k in range(display.n_shown, n_shown):
        places[shown[np.uint64(k)]] = 1
    display.n_shown = n_shown
    return n_ended


@compiled
def show_pending(state: Any) -> int:
    """`show` for all rows that need a look in the present bin."""
    bins, pending_bins = state.counters.bin_, state.counters.pending_bin
    pending = state.room.pending
    n = 0
    for i in range(pending.size):
        pending[n] = i
        n += bins[i] == pending_bins[i]
    return show(state, n)


@compiled
def show_first(state: Any, which: NDArray[Any]) -> None:
    """Show the spikes of the bin at which each environment in `which` begins."""
    pending = state.room.pending
    for k in range(which.size):
        pending[k] = which[k]
    show(state, which.size)


@compiled
def clear_all(display: Any) -> None:
    """Clear all ones."""
    places = display.observations.reshape(-1)
    for place in display.shown[: display.n_shown]:
        places[place] = 0
    display.n_shown = 0


@compiled
def clear_rows(state: Any, which: NDArray[np.bool_]) -> int:
    """Clear the rows `which`, and forget that their episodes are done.

    Returns the number of environments whose episodes are still done.
    """
    display, outcome = state.display, state.outcome
    n_inputs = display.observations.shape[1]
    n_shown = 0
    for place in display.shown[: display.n_shown]:
        i = np.int64(place) // n_inputs
        if which[i]:
            display.observations[i, np.int64(place) - i * n_inputs] = 0
        else:
            display.shown[n_shown] = place
            n_shown += 1
    display.n_shown = n_shown
    n_done = 0
    for i in outcome.done[: outcome.n_done]:
        if not which[i]:
            outcome.done[n_done] = i
            n_done += 1
    outcome.n_done = n_done
    return n_done


@compiled
def set_aside(display: Any, done: NDArray[np.int64]) -> None:
    """Move the observations of the environments `done` to `final_obs`."""
    for k in range(done.size):
        row = display.observations[done[k]]
        for channel in range(row.size):
            display.final_obs[k, channel] = row[channel]
            row[channel] = 0


@compiled
def first_bad_action(actions: NDArray[Any], most: float, done: NDArray[np.int64]) -> int:
    """The first environment whose action is not in 0 … `most`, or −1; those `done` do not count."""
    n_bad = 0
    for i in range(actions.size):
        n_bad += not 0 <= actions[i] <= most
    if n_bad > 0:
        for i in range(actions.size):
            if not 0 <= actions[i] <= most and not np.any(done == i):
                return i
    return -1


@compiled
def fill_zero(array: NDArray[Any]) -> None:
    for i in range(array.size):
        array[i] = 0


@compiled
def is_used_up(state: Any, i: int) -> bool:
    """Whether what was drawn for environment `i`, whose present bin is shown, ends here."""
    left = state.ahead.events[i, state.counters.event[i]]
    return left >> state.config.shift == state.counters.bin_[i]
