"""Trials for compiled code, several at a time: drawn from a stream, or taken from a data set."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.compiled import compiled, inlined
from gnm_env.sampling import DRAFT, begin_trial, fill_trial, grown, longer_buffers
from gnm_env.segments import TrialArrays
from gnm_env.task import TaskArrays
from gnm_env.trials_kernels import BATCH_BINS, TrialsArrays, lay_out


class Batch(NamedTuple):
    """Trials one behind the other. Trial k begins at bin bin_of[k], its segments at edge_of[k]."""

    channels: NDArray[np.int32]
    offsets: NDArray[np.int64]
    edges: NDArray[np.int64]
    """Of each trial, counted from its own first bin."""
    target: NDArray[np.int64]
    """Of each trial, from edge_of[k] on: one number less than it has edges."""
    classes: NDArray[np.int64]
    """Class of each presentation, at the place of its segment in `target`; −1 in noise, and −2
    where only the label is known."""
    bin_of: NDArray[np.int64]
    edge_of: NDArray[np.int64]
    onsets: NDArray[np.int64]
    """Room for drawing."""
    which: NDArray[np.int64]
    """Room for drawing."""


def new_batch(bins: int = 2 * BATCH_BINS) -> Batch:
    """Buffers for about so many bins; they grow where they are too short."""
    channels, offsets = np.empty(bins, np.int32), np.zeros(bins + 1, np.int64)
    edges, target, classes = (np.zeros(bins // 4 + 4, np.int64) for _ in range(3))
    bin_of, edge_of = (np.zeros(min(bins, BATCH_BINS) + 1, np.int64) for _ in range(2))
    onsets, which = (np.empty(64, np.int64) for _ in range(2))
    return Batch(channels, offsets, edges, target, classes, bin_of, edge_of, onsets, which)


@compiled
def draw_batch(
    rng: Generator, task: TaskArrays, done: int, most: int, batch: Batch
) -> tuple[Batch, int, int]:
    """Draw at most `most` trials, until there are BATCH_BINS bins.

    Returns the batch, in longer buffers where it needs them, the number of trials, and the length
    of the longest in bins. `done` trials came before; that is of use to data sets.
    """
    channels, offsets, edges, target, classes, bin_of, edge_of, onsets, which = batch
    draft = np.zeros(1, DRAFT)
    drawn = longest = 0
    while drawn < most and bin_of[drawn] < BATCH_BINS:
        begin_trial(draft, offsets, bin_of[drawn], 0)
        while not fill_trial(rng, task, channels, offsets, onsets, which, draft):
            channels, offsets, onsets, which = longer_buffers(
                task, channels, offsets, onsets, which, draft
            )
        n, first = draft[0].presentation, edge_of[drawn]
        if first + 2 * n + 2 > edges.size:
            edges = grown(edges, first + 2 * n + 2)
            target = grown(target, edges.size)
            classes = grown(classes, edges.size)
        n_bins = draft[0].bin_ - bin_of[drawn]
        _lay_segments(task, onsets, which, n, n_bins, edges, target, classes, first)
        drawn += 1
        bin_of[drawn], edge_of[drawn] = draft[0].bin_, first + 2 * n + 2
        longest = max(longest, n_bins)
    return (
        Batch(channels, offsets, edges, target, classes, bin_of, edge_of, onsets, which),
        drawn,
        longest,
    )


@inlined
def _lay_segments(
    task: TaskArrays,
    onsets: NDArray[np.int64],
    which: NDArray[np.int64],
    n: int,
    n_bins: int,
    edges: NDArray[np.int64],
    target: NDArray[np.int64],
    classes: NDArray[np.int64],
    first: int,
) -> None:
    """The segments of a drawn trial with `n` presentations, from place `first` on."""
    edges[first] = 0
    target[first] = 0
    classes[first] = -1
    for k in range(n):
        place = first + 2 * k + 1
        edges[place] = onsets[k]
        edges[place + 1] = onsets[k] + task.pattern_bins
        target[place] = task.targets[which[k]]
        target[place + 1] = 0
        classes[place] = which[k]
        classes[place + 1] = -1
    edges[first + 2 * n + 1] = n_bins


class DataAhead(NamedTuple):
    """The next trials of a data set, in their order."""

    data: TrialsArrays
    which: NDArray[np.int64]


@compiled
def take_batch(
    rng: Generator, source: DataAhead, done: int, most: int, batch: Batch
) -> tuple[Batch, int, int]:
    """As `draw_batch`, from a data set: the trials which[done], which[done + 1], …"""
    data, which = source
    channels, offsets, edges, target, classes, bin_of, edge_of, onsets, room = batch
    channels, offsets, edges, target, laid, longest = lay_out(
        data, which, done, channels, offsets, edges, target, bin_of, edge_of
    )
    if classes.size < edges.size:
        classes = grown(classes, edges.size)
    for k in range(laid):
        i = which[done + k]
        first, n_segments = edge_of[k], edge_of[k + 1] - edge_of[k] - 1
        presentation = data.first_edge[i] // 2 - i
        for segment in range(n_segments):
            classes[first + segment] = -2 if data.label_only[i] else -1
            if segment % 2 == 1:
                classes[first + segment] = data.classes[presentation]
                presentation += 1
    return (
        Batch(channels, offsets, edges, target, classes, bin_of, edge_of, onsets, room),
        laid,
        longest,
    )


@inlined
def trial_of(batch: Batch, k: int) -> TrialArrays:
    """Trial `k` of the batch."""
    first, last = batch.edge_of[k], batch.edge_of[k + 1]
    return TrialArrays(
        batch.channels,
        batch.offsets[batch.bin_of[k] : batch.bin_of[k + 1] + 1],
        batch.edges[first:last],
        batch.target[first : last - 1],
    )
