"""Compiled steps of many streams at once; `gnm_env.base.kernels` says how they are laid out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.base.kernels import (
    NEXT_STEP,
    NO_LIMIT,
    SAME_STEP,
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
from gnm_env.rules import compiled_mistake
from gnm_env.sampling import append_piece

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


class StreamResults(NamedTuple):
    """What a step of streams tells, (n,) each; numbers and classes of mistakes."""

    rewards: NDArray[np.float64]
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    mistakes: NDArray[np.int64]
    classes: NDArray[np.int64]


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
                events = widened(events, offsets[s.n_bins] + 1)
            store_events(events, i, shift, s.n_bins, channels, offsets)
            if crowd.limit < NO_LIMIT:
                deadlines[i] -= bins[i]
            bins[i], cursors[i] = 0, 0
        s.count = 0
        if begin:
            deadlines[i] = bins[i] + crowd.limit
    crowd.events, crowd.channels, crowd.offsets = events, channels, offsets
    show_first(crowd, which)


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
    bad = first_bad_action(actions, crowd.most, crowd.over[: crowd.n_over])
    if bad >= 0:
        return bad, crowd.n_over
    rewards, terminated, truncated, mistakes, classes = crowd.results
    fill_zero(terminated)
    fill_zero(truncated)
    fill_zero(mistakes)
    fill_zero(classes)
    clear_all(crowd)
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

    show_due(crowd)
    n_used_up = _judge(crowd, actions)
    _go_on(crowd, crowd.looks[:n_used_up], False)
    n_over = crowd.n_over
    if crowd.autoreset == SAME_STEP:
        set_aside(crowd)
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
        used_up = is_used_up(crowd, i)
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
