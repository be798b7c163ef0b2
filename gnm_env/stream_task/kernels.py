"""Compiled steps of many streams at once; `gnm_env.base.kernels` says how they are laid out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.base.kernels import (
    NEXT_STEP,
    SAME_STEP,
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
from gnm_env.base.params import NO_LIMIT
from gnm_env.compiled import compiled
from gnm_env.rules import compiled_mistake
from gnm_env.sampling import append_piece

STREAM_STATE = np.dtype(
    [
        ("n_bins", np.int64),  # of the present piece; bins count from its beginning
        ("n_noise", np.int64),
        ("class_", np.int64),
        ("count", np.int64),  # spikes in the present presentation
        ("noise_left", np.float64),
        ("anew", np.int64),  # the generator is new, and so is the stream
    ]
)


class StreamResults(NamedTuple):
    """What a step of streams tells, (n,) each; numbers and classes of mistakes."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    mistakes: NDArray[np.int64]
    classes: NDArray[np.int64]


@compiled
def _go_on(state: Any, which: NDArray[Any], begin: bool) -> None:
    """Show the next bin of each stream in `which`, whose rows are clear.

    Where a piece is used up, that is the first of the next piece. With `begin` an episode begins in
    each: it goes on after the bin shown last or, where that lies in a pattern, after the pattern.
    """
    if which.size == 0:
        return
    rngs, task, config = state.rngs, state.source, state.config
    records, ahead, room = state.episodes.records, state.ahead, state.room
    channels, offsets, events = room.channels, room.offsets, ahead.events
    bins, _, cursors, deadlines = state.counters
    for i in which:
        s = records[i]
        if begin and not s.anew and bins[i] < s.n_noise and bins[i] + 1 < s.n_bins:
            bins[i] += 1
        else:
            if s.anew:
                s.anew, s.noise_left = 0, -1.0
            channels, offsets, s.n_noise, s.class_, s.noise_left = append_piece(
                rngs[i], task, s.noise_left, channels, offsets, 0
            )
            s.n_bins = s.n_noise + (task.pattern_bins if s.class_ >= 0 else 0)
            if offsets[s.n_bins] >= events.shape[1]:
                events = widened(events, offsets[s.n_bins] + 1)
            store_events(events, i, config.shift, s.n_bins, channels, offsets)
            if config.limit < NO_LIMIT:
                deadlines[i] -= bins[i]
            bins[i], cursors[i] = 0, 0
        s.count = 0
        if begin:
            deadlines[i] = bins[i] + config.limit
    ahead.events, room.channels, room.offsets = events, channels, offsets
    show_first(state, which)


@compiled
def begin_streams(state: Any, which: NDArray[np.int64]) -> None:
    """Begin an episode in each environment in `which` and show its first bin; rows are clear."""
    _go_on(state, which, True)


@compiled
def step_streams(state: Any, actions: NDArray[np.int64]) -> tuple[int, int]:
    """One step of every environment: writes the `results`.

    Returns the number of the first environment with a bad action (−1: none; else nothing has been
    changed) and the number of environments now done.
    """
    outcome, config = state.outcome, state.config
    done = outcome.done
    bad = first_bad_action(actions, config.most, done[: outcome.n_done])
    if bad >= 0:
        return bad, outcome.n_done
    rewards, terminated, truncated, mistakes, classes = outcome.results
    fill_zero(terminated)
    fill_zero(truncated)
    fill_zero(mistakes)
    fill_zero(classes)
    clear_all(state.display)
    bins = state.counters.bin_
    for i in range(actions.size):
        rewards[i] = 1.0
    if config.autoreset == NEXT_STEP:
        _go_on(state, done[: outcome.n_done], True)
        for i in done[: outcome.n_done]:
            bins[i] -= 1  # below 0 it wraps around, and back by what follows
            rewards[i] = 0.0
    for i in range(actions.size):
        bins[i] += 1

    show_pending(state)
    n_used_up = _judge(state, actions)
    _go_on(state, state.room.pending[:n_used_up], False)
    n_done = outcome.n_done
    if config.autoreset == SAME_STEP:
        set_aside(state.display, done[:n_done])
        _go_on(state, done[:n_done], True)
        outcome.n_done = 0
    return -1, n_done


@compiled
def _judge(state: Any, actions: NDArray[np.int64]) -> int:
    """Judge the answers to the last bin, and write the results of streams that are done.

    Returns the number of streams whose piece is used up; they stand at the beginning of `pending`.
    """
    outcome, records, targets = state.outcome, state.episodes.records, state.source.targets
    rewards, terminated, truncated, mistakes, classes = outcome.results
    done, pending = outcome.done, state.room.pending
    bins, pending_bins, _, deadlines = state.counters
    # Only those at an end are still pending.
    n_pending = 0
    for i in range(actions.size):
        pending[n_pending] = i
        n_pending += (bins[i] == pending_bins[i]) | ((actions[i] != 0) & (rewards[i] != 0.0))
    n_done = n_used_up = 0
    for i in pending[:n_pending]:
        used_up = is_used_up(state, i)
        if used_up or actions[i] != 0:
            mistake, class_ = _mistake(records[i], bins[i], actions[i], targets)
            if mistake:
                rewards[i] = 0.0
                terminated[i] = True
                mistakes[i], classes[i] = mistake, class_
        truncated[i] = bins[i] == deadlines[i]
        if terminated[i] or truncated[i]:
            done[n_done] = i
            n_done += 1
        if used_up:
            pending[n_used_up] = i  # in the place of one that has been looked at
            n_used_up += 1
    outcome.n_done = n_done
    return n_used_up


@compiled
def _mistake(s: Any, next_bin: int, spike: int, targets: NDArray[np.int64]) -> tuple[int, int]:
    """Mistake in answering the bin before `next_bin` with `spike`, and the class (−1: noise)."""
    if next_bin <= s.n_noise:
        return compiled_mistake(spike, 0, True, False), -1
    s.count += spike
    return compiled_mistake(s.count, targets[s.class_], False, next_bin == s.n_bins), s.class_
