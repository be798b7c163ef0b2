"""Own patterns in a background like one's own recording's.

`task_like` gives noise the recording's rate on each channel: for drawn trials, for the endless
stream and so for the noisy performance. `hide` makes a data set, with such noise or with the
recording itself as noise, each channel moved in time by itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.checks import require_memory, shown, whole
from gnm_env.compiled import compiled, inlined
from gnm_env.generators import Generators
from gnm_env.sampling import grown
from gnm_env.task import Patterns, Task
from gnm_env.trials import Trials, seeded
from gnm_env.trials_kernels import MAX_TRIALS, TrialsArrays


def task_like(trials: Trials, patterns: Patterns | None = None, **fields: Any) -> Task:
    """A task whose noise has on each channel the rate that `trials` have there.

        task = task_like(trials, patterns, onset_probability=0.002)
        survived = noisy_performance(agent, task, patterns)

    Number and length of the patterns are those of `patterns` where they are given; `fields` are
    further fields of Task. Patterns drawn for such a task have these rates, too.

    Raises ValueError if the patterns have other channels, or a field is out of range.
    """
    if not isinstance(trials, Trials):
        raise ValueError(f"trials must be gnm_env.Trials, got {shown(trials)}")
    known = {"n_inputs": trials.n_inputs, "rates": tuple(trials.rates.tolist())}
    if patterns is not None:
        if not isinstance(patterns, Patterns) or patterns.shape[2] != trials.n_inputs:
            raise ValueError(
                f"patterns must be gnm_env.Patterns of {trials.n_inputs} channels, as the trials, "
                f"got {shown(patterns)}"
            )
        known |= {"n_classes": patterns.shape[0], "pattern_bins": patterns.shape[1]}
    for name in known.keys() & fields.keys():
        raise ValueError(f"{name} follows from the trials and patterns; leave it out")
    return Task.from_keywords(None, {**known, **fields})


def hide(
    patterns: Patterns,
    like: Trials,
    n: int,
    seed: int | Generator,
    *,
    shuffled: bool = False,
    **fields: Any,
) -> Trials:
    """`n` trials in which `patterns` hide in a background like that of `like`.

    Args:
        patterns: what is hidden, with as many channels as `like`.
        like: the recording; its presentations and labels do not matter.
        n: number of trials.
        seed: a whole number or a Generator to draw from.
        shuffled: False: noise with the recording's rate on each channel, each spike independent.
            True: the recording itself. Each channel is read on from a place of its own, drawn for
            each trial, through all trials of the recording one behind the other and around: its
            intervals stay, relations between channels are lost.
        fields: fields of Task: `background_bins`, `mean_occurrences`, `targets`, `jitter_bins` …

    Raises ValueError if patterns and recording do not fit each other, or a field is out of range.
    """
    task = task_like(like, patterns, **fields)
    if not isinstance(shuffled, bool):
        raise ValueError(f"shuffled must be True or False, got {shown(shuffled)}")
    if not shuffled:
        return Trials.draw(task, patterns, n, seed)
    n = whole("n", n, low=1, high=MAX_TRIALS)
    rng = seeded(seed)
    bare = Trials.draw(replace(task, rates=None, rate=0.0), patterns, n, rng)
    spikes = n * task.background_bins * task.rate * task.n_inputs
    require_memory(f"{n:,} trials of {spikes / n:,.0f} spikes", 16.0 * spikes, "take fewer")
    times, first = _by_channel(like)
    channels, bins, first_spike = _filled(
        Generators([rng]).held, bare.arrays, times, first, int(like.n_bins.sum())
    )
    arrays = bare.arrays._replace(channels=channels, bins=bins, first_spike=first_spike)
    return Trials._of(arrays, task.n_classes, task.pattern_bins)


def _by_channel(trials: Trials) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Spike times of each channel over all trials, and where those of each channel begin."""
    data, n_bins = trials.arrays, trials.n_bins
    begins = np.cumsum(n_bins) - n_bins
    times = data.bins.astype(np.int64) + np.repeat(begins, trials.n_spikes)
    order = np.argsort(data.channels, kind="stable")
    first = np.append(0, np.cumsum(np.bincount(data.channels, minlength=data.n_inputs)))
    return times[order], first


@compiled
def _filled(
    held: Any,
    bare: TrialsArrays,
    times: NDArray[np.int64],
    first: NDArray[np.int64],
    period: int,
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]:
    """Channels, bins and first spikes of trials whose noise bins are filled from a recording.

    The spikes of channel i are at times[first[i] : first[i + 1]], ascending in 0 … period − 1.
    """
    n = bare.label_only.size
    channels, bins = np.empty(256, np.int32), np.empty(256, np.int32)
    first_spike = np.zeros(n + 1, np.int64)
    read_bins, read_channels = np.empty(256, np.int64), np.empty(256, np.int32)
    for i in range(n):
        edges = bare.edges[bare.first_edge[i] : bare.first_edge[i + 1]]
        at = _noise_bins(edges)
        read_bins, read_channels, n_read = _read(
            held[0], times, first, period, at, read_bins, read_channels
        )
        own = bare.first_spike[i], bare.first_spike[i + 1]
        begin = first_spike[i]
        end = begin + own[1] - own[0] + n_read
        channels, bins = grown(channels, end), grown(bins, end)
        # Where the spikes of each bin go. Patterns and noise share no bin, and both are in the
        # order of their channels.
        place = np.zeros(edges[-1] + 1, np.int64)
        for e in range(own[0], own[1]):
            place[bare.bins[e] + 1] += 1
        for e in range(n_read):
            place[read_bins[e] + 1] += 1
        place[0] = begin
        for t in range(edges[-1]):
            place[t + 1] += place[t]
        for e in range(own[0], own[1]):
            _put(channels, bins, place, bare.channels[e], bare.bins[e])
        for e in range(n_read):
            _put(channels, bins, place, read_channels[e], read_bins[e])
        first_spike[i + 1] = end
    return channels[: first_spike[n]].copy(), bins[: first_spike[n]].copy(), first_spike


@inlined
def _put(
    channels: NDArray[np.int32],
    bins: NDArray[np.int32],
    place: NDArray[np.int64],
    channel: int,
    bin_: int,
) -> None:
    channels[place[bin_]], bins[place[bin_]] = channel, bin_
    place[bin_] += 1


@compiled
def _noise_bins(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """The bins of a trial that lie in noise, ascending."""
    n = 0
    bins = np.empty(edges[-1], np.int64)
    for s in range(0, edges.size - 1, 2):
        for t in range(edges[s], edges[s + 1]):
            bins[n] = t
            n += 1
    return bins[:n]


@compiled
def _read(
    rng: Generator,
    times: NDArray[np.int64],
    first: NDArray[np.int64],
    period: int,
    at: NDArray[np.int64],
    bins: NDArray[np.int64],
    channels: NDArray[np.int32],
) -> tuple[NDArray[np.int64], NDArray[np.int32], int]:
    """Read on each channel from a random time on, round and round, one bin for each of `at`.

    Returns the two buffers, longer ones where they were too short, with the bins (those of `at`)
    and channels of the spikes, channel by channel; and their number.
    """
    n = 0
    for channel in range(first.size - 1):
        begin, end = first[channel], first[channel + 1]
        start = int(rng.random() * period)
        if begin == end:
            continue
        e = begin + np.searchsorted(times[begin:end], start)
        turned = -start
        while True:
            if e == end:
                e, turned = begin, turned + period
            bin_ = times[e] + turned
            if bin_ >= at.size:
                break
            bins, channels = grown(bins, n + 1), grown(channels, n + 1)
            bins[n], channels[n] = at[bin_], channel
            n += 1
            e += 1
    return bins, channels, n
