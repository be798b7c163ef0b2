"""Many trials in flat arrays, and what compiled code does with them: lay out, take, delay, draw."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import MAX_BINS, MAX_INPUTS, MAX_LABEL
from gnm_env.compiled import compiled
from gnm_env.sampling import append_trial, grown
from gnm_env.segments import fill_segments
from gnm_env.task import TaskArrays

MAX_TRIALS = 100_000_000
"""Most trials of a data set."""

BATCH_BINS = 16_384
"""`lay_out` lays trials one behind the other until this many bins are there."""


class TrialsArrays(NamedTuple):
    """Many trials, one behind the other, as compiled code takes them: 8 bytes a spike.

    The segments of trial i are edges[first_edge[i] : first_edge[i + 1]] (2K + 2 numbers, counted in
    bins from the trial's own first), and what they are owed stands at the same places of `target`;
    the last place belongs to no segment and holds 0.
    """

    n_inputs: int
    channels: NDArray[np.int32]
    """The channel of each input spike; sorted by trial, bin and channel."""
    bins: NDArray[np.int32]
    """The bin of each input spike, from the first of its trial."""
    first_spike: NDArray[np.int64]
    """(n + 1,); the spikes of trial i are channels[first_spike[i] : first_spike[i + 1]]."""
    edges: NDArray[np.int64]
    target: NDArray[np.int64]
    first_edge: NDArray[np.int64]
    """(n + 1,)"""
    classes: NDArray[np.int64]
    """Class of each presentation, those of all trials one behind the other: the first of trial i is
    number first_edge[i] / 2 − i."""
    label_only: NDArray[np.bool_]
    """(n,), whether only the label of a trial is known."""


@compiled
def lay_out(
    data: TrialsArrays,
    which: NDArray[np.int64],
    first: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    edges: NDArray[np.int64],
    target: NDArray[np.int64],
    bin_of: NDArray[np.int64],
    edge_of: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], int, int]:
    """Lay the trials which[first], which[first + 1], … one behind the other, as if just drawn.

    Stops after BATCH_BINS bins (one trial at least), at the end of `which`, or when `bin_of` and
    `edge_of`, of equal length, are full. Returns the first four buffers, longer ones where they
    were too short; the number of trials laid out; and the bins of the longest. Of these, trial k
    has the bins bin_of[k] … bin_of[k + 1] − 1 and is

        TrialArrays(
            channels,
            offsets[bin_of[k] : bin_of[k + 1] + 1],
            edges[edge_of[k] : edge_of[k + 1]],
            target[edge_of[k] : edge_of[k + 1] - 1],
        )

    Edges count from the trial's own first bin.
    """
    laid = longest = 0
    bin_of[0] = edge_of[0] = offsets[0] = 0
    while first + laid < which.size and laid + 1 < bin_of.size and bin_of[laid] < BATCH_BINS:
        i = which[first + laid]
        begin, end = data.first_spike[i], data.first_spike[i + 1]
        first_edge, n_edges = data.first_edge[i], data.first_edge[i + 1] - data.first_edge[i]
        n_bins = data.edges[first_edge + n_edges - 1]
        bin_, edge = bin_of[laid], edge_of[laid]
        n_events = offsets[bin_]
        # Compared here: a call that is given a buffer costs as much as twenty spikes.
        if n_events + end - begin > channels.size:
            channels = grown(channels, n_events + end - begin)
        if bin_ + n_bins + 1 > offsets.size:
            offsets = grown(offsets, bin_ + n_bins + 1)
        if edge + n_edges > min(edges.size, target.size):
            edges, target = grown(edges, edge + n_edges), grown(target, edge + n_edges)
        _spread(data.channels, data.bins, begin, end, n_bins, channels, offsets, bin_)
        for s in range(n_edges):
            edges[np.uint64(edge + s)] = data.edges[np.uint64(first_edge + s)]
            target[np.uint64(edge + s)] = data.target[np.uint64(first_edge + s)]
        laid += 1
        bin_of[laid], edge_of[laid] = bin_ + n_bins, edge + n_edges
        longest = max(longest, n_bins)
    return channels, offsets, edges, target, laid, longest


@compiled
def _spread(
    from_channels: NDArray[np.int32],
    from_bins: NDArray[np.int32],
    begin: int,
    end: int,
    n_bins: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    bin_: int,
) -> None:
    """Append the spikes begin … end − 1 as the bins from `bin_` on; there is room."""
    n_events = offsets[bin_]
    for t in range(1, n_bins + 1):
        offsets[np.uint64(bin_ + t)] = 0
    for e in range(begin, end):
        channels[np.uint64(n_events + e - begin)] = from_channels[np.uint64(e)]
        offsets[np.uint64(bin_ + 1 + from_bins[np.uint64(e)])] += 1
    total = n_events
    for t in range(1, n_bins + 1):
        total += offsets[np.uint64(bin_ + t)]
        offsets[np.uint64(bin_ + t)] = total


@compiled
def one_trial(
    data: TrialsArrays, i: int
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], Any]:
    """Channels, offsets, edges, target and classes of trial `i`, in arrays of their own."""
    begin, end = data.first_spike[i], data.first_spike[i + 1]
    first, last = data.first_edge[i], data.first_edge[i + 1]
    n_bins = data.edges[last - 1]
    channels, offsets = np.empty(end - begin, np.int32), np.zeros(n_bins + 1, np.int64)
    _spread(data.channels, data.bins, begin, end, n_bins, channels, offsets, 0)
    return (
        channels,
        offsets,
        data.edges[first:last].copy(),
        data.target[first : last - 1].copy(),
        data.classes[first // 2 - i : last // 2 - i - 1].copy(),
    )


@compiled
def bins_of(offsets: NDArray[np.int64], bins: NDArray[np.int32]) -> None:
    """Write the bin of each spike of a trial to `bins`."""
    for t in range(offsets.size - 1):
        for e in range(offsets[t], offsets[t + 1]):
            bins[e] = t


@compiled
def starts(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where each of some parts begins, and where the last ends; (n + 1,)."""
    first = np.zeros(counts.size + 1, np.int64)
    for i in range(counts.size):
        first[i + 1] = first[i] + counts[i]
    return first


@compiled
def _gathered(
    values: NDArray[Any],
    first: NDArray[np.int64],
    which: NDArray[np.int64],
    new_first: NDArray[np.int64],
) -> NDArray[Any]:
    """The parts `which` of `values`, one behind the other."""
    gathered = np.empty(new_first[which.size], values.dtype)
    for k in range(which.size):
        shift = first[which[k]] - new_first[k]
        for e in range(new_first[k], new_first[k + 1]):
            gathered[e] = values[e + shift]
    return gathered


def take(data: TrialsArrays, which: NDArray[np.int64]) -> TrialsArrays:
    """The trials `which`, in that order, in arrays of their own."""
    spikes, edges = data.first_spike, data.first_edge
    new_spikes, new_edges = starts(np.diff(spikes)[which]), starts(np.diff(edges)[which])
    shown = first_presentation(edges)
    return TrialsArrays(
        data.n_inputs,
        _gathered(data.channels, spikes, which, new_spikes),
        _gathered(data.bins, spikes, which, new_spikes),
        new_spikes,
        _gathered(data.edges, edges, which, new_edges),
        _gathered(data.target, edges, which, new_edges),
        new_edges,
        _gathered(data.classes, shown, which, first_presentation(new_edges)),
        data.label_only[which],
    )


def first_presentation(first_edge: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of the first presentation of each trial, and of all; (n + 1,)."""
    return first_edge // 2 - np.arange(len(first_edge))


@compiled
def segments_of(
    onsets: NDArray[np.int64],
    ends: NDArray[np.int64],
    owed: NDArray[np.int64],
    first: NDArray[np.int64],
    n_bins: NDArray[np.int64],
    labels: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Edges, target and first edges of trials, of which i has presentations first[i] …

    A trial without presentations is owed its label as a whole.
    """
    n = n_bins.size
    first_edge = np.empty(n + 1, np.int64)
    for i in range(n + 1):
        first_edge[i] = 2 * (first[i] + i)
    edges, target = np.empty(first_edge[n], np.int64), np.zeros(first_edge[n], np.int64)
    for i in range(n):
        a, b = first[i], first[i + 1]
        begin, end = first_edge[i], first_edge[i + 1]
        fill_segments(
            onsets[a:b], ends[a:b], owed[a:b], n_bins[i], edges[begin:end], target[begin : end - 1]
        )
        if a == b:
            target[begin] = labels[i]
    return edges, target, first_edge


FAULTS = (
    "",
    "a spike outside its bins",
    "spikes that are not sorted by bin and channel, or one twice",
    "presentations that overlap, are empty, out of order or outside its bins",
    "spikes owed in noise, or fewer than none",
)


@compiled
def first_fault(data: TrialsArrays, most: int) -> tuple[int, int]:
    """Number of the first trial that is not as it must be, and of its fault; (−1, 0) if all are.

    Rests on starts that ascend and end with the lengths of what they divide. Nothing may be owed
    more than `most` spikes.
    """
    for i in range(data.label_only.size):
        first, last = data.first_edge[i], data.first_edge[i + 1]
        n_bins = data.edges[last - 1]
        for e in range(data.first_spike[i], data.first_spike[i + 1]):
            if not 0 <= data.bins[e] < n_bins:
                return i, 1
            if e > data.first_spike[i]:
                later = data.bins[e] > data.bins[e - 1]
                same = data.bins[e] == data.bins[e - 1]
                if not (later or (same and data.channels[e] > data.channels[e - 1])):
                    return i, 2
        in_order = data.edges[first] == 0 and n_bins >= 1
        for s in range(first + 1, last):
            least = data.edges[s - 1] + (1 if (s - first) % 2 == 0 else 0)
            in_order = in_order and data.edges[s] >= least
        if not in_order:
            return i, 3
        for s in range(first, last):
            nothing = (s - first) % 2 == 0 and not (data.label_only[i] and s == first)
            if not 0 <= data.target[s] <= most or (
                (nothing or s == last - 1) and data.target[s] > 0
            ):
                return i, 4
        if data.label_only[i] and last - first != 2:
            return i, 4
    return -1, 0


@compiled
def delayed(
    data: TrialsArrays, delays: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
    """Channels, bins and first spikes of trials with a copy of every channel for each delay.

    Copy d of channel i is channel d·N + i; spikes delayed past the end of their trial are dropped.
    """
    n = data.label_only.size
    first_spike = np.zeros(n + 1, np.int64)
    for i in range(n):
        n_bins = data.edges[data.first_edge[i + 1] - 1]
        kept = 0
        for e in range(data.first_spike[i], data.first_spike[i + 1]):
            for d in range(delays.size):
                kept += data.bins[e] + delays[d] < n_bins
        first_spike[i + 1] = first_spike[i] + kept
    channels = np.empty(first_spike[n], np.int32)
    bins = np.empty(first_spike[n], np.int32)
    next_spike = np.empty(delays.size, np.int64)
    for i in range(n):
        end = data.first_spike[i + 1]
        next_spike[:] = data.first_spike[i]
        k = first_spike[i]
        while k < first_spike[i + 1]:
            # The first bin in which any copy has a spike left.
            t = np.int64(2**62)
            for d in range(delays.size):
                if next_spike[d] < end:
                    t = min(t, data.bins[next_spike[d]] + delays[d])
            for d in range(delays.size):
                e = next_spike[d]
                while e < end and data.bins[e] + delays[d] == t:
                    channels[k] = d * data.n_inputs + data.channels[e]
                    bins[k] = t
                    k += 1
                    e += 1
                next_spike[d] = e
    return channels, bins, first_spike


@compiled
def draw(
    held: Any, task: TaskArrays, n: int, room: int
) -> tuple[
    NDArray[np.int32],
    NDArray[np.int32],
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.bool_],
]:
    """All arrays of `n` trials drawn one after the other, from `channels` on.

    `room` is the number of spikes that are expected.
    """
    channels, bins = np.empty(room, np.int32), np.empty(room, np.int32)
    first_spike, first_edge = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    edges, target, classes = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    its_channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    onsets, its_classes = np.empty(8, np.int64), np.empty(8, np.int64)
    for i in range(n):
        its_channels, offsets, onsets, its_classes, n_bins, k, _ = append_trial(
            held[0], task, its_channels, offsets, onsets, its_classes, 0, 0
        )
        spike, edge, shown = first_spike[i], first_edge[i], first_edge[i] // 2 - i
        n_events, n_edges = offsets[n_bins], 2 * k + 2
        channels, bins = grown(channels, spike + n_events), grown(bins, spike + n_events)
        edges, target = grown(edges, edge + n_edges), grown(target, edge + n_edges)
        classes = grown(classes, shown + k)
        channels[spike : spike + n_events] = its_channels[:n_events]
        bins_of(offsets[: n_bins + 1], bins[spike:])
        classes[shown : shown + k] = its_classes[:k]
        fill_segments(
            onsets[:k],
            onsets[:k] + task.pattern_bins,
            task.targets[its_classes[:k]],
            n_bins,
            edges[edge : edge + n_edges],
            target[edge : edge + n_edges],
        )
        target[edge + n_edges - 1] = 0
        first_spike[i + 1], first_edge[i + 1] = spike + n_events, edge + n_edges
    n_spikes, n_edges = first_spike[n], first_edge[n]
    return (
        channels[:n_spikes].copy(),
        bins[:n_spikes].copy(),
        first_spike,
        edges[:n_edges].copy(),
        target[:n_edges].copy(),
        first_edge,
        classes[: n_edges // 2 - n].copy(),
        np.zeros(n, np.bool_),
    )


def check_arrays(a: TrialsArrays) -> None:
    """ValueError unless compiled code may rely on the arrays.

    Their types are right, the channels below n_inputs, and the starts sums of whole numbers >= 0.
    """
    if not 1 <= len(a.label_only) <= MAX_TRIALS:
        raise ValueError(f"there must be 1 … {MAX_TRIALS:,} trials, got {len(a.label_only)}")
    for name, first, values in (
        ("channels", a.first_spike, a.channels),
        ("bins", a.first_spike, a.bins),
        ("edges", a.first_edge, a.edges),
    ):
        if first[-1] != len(values):
            raise ValueError(
                f"{name} must have one entry for each of the {first[-1]}, got {len(values)}"
            )
    edges = np.diff(a.first_edge)
    if np.any((edges < 2) | (edges % 2 == 1)):
        raise ValueError("a trial must have an even number of edges, two at least")
    if a.edges.min() < 0 or a.edges.max() > MAX_BINS:
        raise ValueError(f"edges must lie in 0 … {MAX_BINS:,}")
    if len(a.classes) != first_presentation(a.first_edge)[-1]:
        raise ValueError("there must be one class for each presentation")
    if a.classes.min(initial=0) < 0 or a.classes.max(initial=0) > MAX_INPUTS:
        raise ValueError(f"classes must lie in 0 … {MAX_INPUTS:,}")
    trial, fault = first_fault(a, MAX_LABEL)
    if fault:
        raise ValueError(f"trial {trial} has {FAULTS[fault]}")
    if np.add.reduceat(a.target.astype(np.float64), a.first_edge[:-1]).max() > MAX_LABEL:
        raise ValueError(f"no trial may be owed more than {MAX_LABEL:,} output spikes")


def checked_counts(name: str, counts: NDArray[np.int64], total: int) -> NDArray[np.int64]:
    """`counts` if none is negative and they add up, else ValueError."""
    # Each at most the total and so few of them that the sum cannot run over.
    if counts.min(initial=0) < 0 or counts.max(initial=0) > total or counts.sum() != total:
        raise ValueError(f"{name} must add up to {total}")
    return counts
