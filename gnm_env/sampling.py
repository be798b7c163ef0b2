"""Compiled draws: noise, a presentation of a pattern, a whole trial, a piece of the endless stream.

Everything is sparse. A raster is `channels` (int32, ascending within a bin) and `offsets` (int64):
the spikes of bin t are channels[offsets[t] : offsets[t + 1]]. The functions append to buffers that
they are given and return them, since a buffer that is too short is replaced by a longer one.

The order of the draws is part of the interface: the environments and the compiled training loops
share these functions, and so hear the same stream from the same generator.

In the loops that every spike goes through indices are unsigned, since numba lets signed ones count
from the end and pays for looking; together with a single exit per function (else numba counts
references to the arrays) this is a third of the time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.compiled import compiled, inlined
from gnm_env.task import PatternNoise, TaskArrays

PIECE_BINS = 2_048
"""Most noise bins in one piece of the endless stream, so that memory stays bounded as q -> 0."""


@compiled
def grown(buffer: NDArray[Any], needed: int) -> NDArray[Any]:
    """`buffer` if it holds `needed` entries, else a copy at least twice as long."""
    if needed <= buffer.size:
        return buffer
    longer = np.empty(max(needed, 2 * buffer.size), buffer.dtype)
    # A loop: copying by slice would compile NumPy's message about shapes, for 2 s.
    for i in range(buffer.size):
        longer[i] = buffer[i]
    return longer


@compiled
def _fill_noise(
    rng: Generator,
    task: TaskArrays,
    n_bins: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    bin_: int,
    position: int,
    n_events: int,
) -> tuple[int, int, bool]:
    """Add noise spikes until the end of the bins (True) or of `channels` (False: to be continued).

    The bits are taken in one row, bin by bin. The gap to the next 1 is geometric,
    floor(exponential / −ln(1−p)), so that only the spikes cost a draw; `position` is the last 1
    (−1 at the beginning), `n_events` the number of spikes so far. Where channels have rates of
    their own, ones are drawn at the largest of them, and each is kept with its channel's share.
    """
    if position < 0:
        for t in range(bin_, bin_ + n_bins):
            offsets[t + 1] = 0
    n_inputs = np.uint64(task.n_inputs)
    n_bits = n_bins * task.n_inputs
    thinned = task.kept.size > 0
    done = False
    while n_events < channels.size and not done:
        gap = rng.standard_exponential() / task.hazard
        # Written so that infinity and NaN (p = 0) end the noise as well.
        done = not gap < n_bits - position - 1
        if not done:
            position += 1 + int(gap)
            # Unsigned: a signed division that rounds down costs three times as much.
            noise_bin = np.int64(np.uint64(position) // n_inputs)
            channel = position - noise_bin * task.n_inputs
            if not thinned or rng.random() < task.kept[np.uint64(channel)]:
                channels[np.uint64(n_events)] = channel
                offsets[np.uint64(bin_ + noise_bin + 1)] += 1
                n_events += 1
    if done:
        _accumulate(offsets, bin_, n_bins)
    return position, n_events, done


@compiled
def _accumulate(offsets: NDArray[np.int64], bin_: int, n_bins: int) -> None:
    """Turn counts per bin into offsets, from bin `bin_` on."""
    total = offsets[bin_]
    for t in range(bin_ + 1, bin_ + n_bins + 1):
        total += offsets[t]
        offsets[t] = total


@compiled
def _pattern_spikes(task: TaskArrays, class_: int) -> int:
    """Number of spikes of pattern `class_`."""
    bins = task.pattern_bins
    return task.pattern_offsets[(class_ + 1) * bins] - task.pattern_offsets[class_ * bins]


@compiled
def _fill_pattern(
    rng: Generator,
    task: TaskArrays,
    noise: PatternNoise | None,
    class_: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    bin_: int,
) -> None:
    """Put a presentation of pattern `class_` at bin `bin_`, with `noise` on it; there is room.

    `noise` is that of the task, in a place of its own since numba leaves out what a None in the
    arguments rules out: a task whose patterns come as they are compiles nothing for noise on them.
    """
    if noise is not None:
        _fill_noisy_pattern(rng, task, noise, class_, channels, offsets, bin_)
    else:
        bins = task.pattern_bins
        first = task.pattern_offsets[class_ * bins]
        last = task.pattern_offsets[(class_ + 1) * bins]
        n_events = offsets[bin_]
        for e in range(first, last):
            channels[np.uint64(n_events + e - first)] = task.pattern_channels[np.uint64(e)]
        for m in range(1, bins + 1):
            offsets[np.uint64(bin_ + m)] = (
                n_events + task.pattern_offsets[np.uint64(class_ * bins + m)] - first
            )


@compiled
def _fill_noisy_pattern(
    rng: Generator,
    task: TaskArrays,
    noise: PatternNoise,
    class_: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    bin_: int,
) -> None:
    """Put a presentation of pattern `class_` at bin `bin_`, with noise on it; there is room."""
    n_events = offsets[bin_]
    cells = _noisy_cells(rng, task, noise, class_)
    for m in range(1, task.pattern_bins + 1):
        offsets[bin_ + m] = 0
    for k in range(cells.size):
        # Two spikes moved onto one cell are one spike: the raster stays binary.
        if k > 0 and cells[k] == cells[k - 1]:
            continue
        m = cells[k] // task.n_inputs
        channels[n_events] = cells[k] - m * task.n_inputs
        n_events += 1
        offsets[bin_ + m + 1] += 1
    _accumulate(offsets, bin_, task.pattern_bins)


@compiled
def _noisy_cells(
    rng: Generator, task: TaskArrays, noise: PatternNoise, class_: int
) -> NDArray[np.int64]:
    """Cells m·N + channel of the pattern's spikes after deletion and jitter, ascending."""
    bins = task.pattern_bins
    first = task.pattern_offsets[class_ * bins]
    last = task.pattern_offsets[(class_ + 1) * bins]
    cells = np.empty(last - first, np.int64)
    kept = 0
    for m in range(bins):
        for e in range(
            task.pattern_offsets[class_ * bins + m], task.pattern_offsets[class_ * bins + m + 1]
        ):
            if noise.deletion > 0.0 and rng.random() < noise.deletion:
                continue
            moved = m
            if noise.jitter_bins > 0:
                moved += int(rng.random() * (2 * noise.jitter_bins + 1)) - noise.jitter_bins
                moved = min(max(moved, 0), bins - 1)
            cells[kept] = moved * task.n_inputs + task.pattern_channels[e]
            kept += 1
    _sort(cells, 0, kept)
    return cells[:kept]


@compiled
def _sort(values: NDArray[np.int64], start: int, stop: int) -> None:
    """Sort values[start:stop] in place (Shell's way), without any allocation."""
    gap = 1
    while gap < (stop - start) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for k in range(start + gap, stop):
            value = values[k]
            place = k
            while place >= start + gap and values[place - gap] > value:
                values[place] = values[place - gap]
                place -= gap
            values[place] = value
        gap //= 3


DRAFT = np.dtype(
    [
        ("first_bin", np.int64),
        ("first", np.int64),  # the trial's first presentation
        ("class_", np.int64),  # the class whose presentations are being drawn
        ("count", np.int64),  # its presentations still to be placed (−1: it has yet to be drawn)
        ("label", np.int64),
        ("end", np.int64),  # the presentation after the trial's last so far
        ("presentation", np.int64),  # the next to be laid out
        ("noise_done", np.int64),  # bins of noise that are laid out
        ("position", np.int64),  # the last 1 in the present noise (−1: none yet)
        ("bin_", np.int64),  # the next bin
        ("n_events", np.int64),  # spikes so far
    ]
)
"""How far a trial has been drawn, so that drawing can go on in longer buffers. In arrays (1,).

Once all is drawn, `bin_` and `presentation` are those that follow the trial's last, and `label` is
its aggregate label.
"""


@compiled
def begin_trial(
    draft: NDArray[Any], offsets: NDArray[np.int64], bin_: int, presentation: int
) -> None:
    """Make `draft` one of which nothing is drawn yet, from bin `bin_` and that presentation on."""
    d = draft[0]
    d.first_bin, d.bin_ = bin_, bin_
    d.first, d.end, d.presentation = presentation, presentation, presentation
    d.count, d.position = -1, -1
    d.class_, d.label, d.noise_done, d.n_events = 0, 0, 0, offsets[bin_]


@inlined
def fill_trial(
    rng: Generator,
    task: TaskArrays,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    onsets: NDArray[np.int64],
    classes: NDArray[np.int64],
    draft: NDArray[Any],
) -> bool:
    """Draw what `draft` still lacks. Onsets count from the trial's own first bin.

    Returns False where a buffer is too short: to be continued with `longer_buffers`. One function
    for both halves, and no buffer changes hands in it: each further call that is given the buffers
    costs as much as twenty spikes, since numba counts references to each of them.
    """
    d = draft[0]
    end, fits = d.end, True
    while fits and d.class_ < task.n_classes:
        if d.count < 0:
            d.count = rng.poisson(task.mean_occurrences)
            d.label += d.count * task.targets[d.class_]
        fits = end + d.count <= min(onsets.size, classes.size)
        if fits:
            # Where (background bin) and which (class), in one number: its order is the order in the
            # trial. The numbers wait in `onsets` until the trial is laid out.
            for k in range(end, end + d.count):
                where = int(rng.random() * task.background_bins)
                onsets[k] = where * task.n_classes + d.class_
            end += d.count
            d.count = -1
            d.class_ += 1
            if d.class_ == task.n_classes:
                _sort(onsets, d.first, end)

    n_bins = task.background_bins + (end - d.first) * task.pattern_bins
    fits = fits and d.first_bin + n_bins < offsets.size
    k, noise_done, position, t, n_events = (
        d.presentation, d.noise_done, d.position, d.bin_, d.n_events
    )  # fmt: skip
    done = False
    while fits and not done:
        before = onsets[k] // task.n_classes if k < end else task.background_bins
        if before > noise_done:
            position, n_events, fits = _fill_noise(
                rng, task, before - noise_done, channels, offsets, t, position, n_events
            )
            if fits:
                t += before - noise_done
                noise_done = before
                position = -1
        elif k == end:
            done = True
        else:
            class_ = onsets[k] - before * task.n_classes
            fits = n_events + _pattern_spikes(task, class_) <= channels.size
            if fits:
                onsets[k] = t - d.first_bin
                classes[k] = class_
                _fill_pattern(rng, task, task.noise, class_, channels, offsets, t)
                t += task.pattern_bins
                n_events = offsets[t]
                k += 1
    d.end, d.presentation = end, k
    d.noise_done, d.position, d.bin_, d.n_events = noise_done, position, t, n_events
    return done


@compiled
def longer_buffers(
    task: TaskArrays,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    onsets: NDArray[np.int64],
    classes: NDArray[np.int64],
    draft: NDArray[Any],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The four buffers, with what they hold, long enough for `fill_trial` to get further."""
    d = draft[0]
    n_bins = task.background_bins + (d.end - d.first) * task.pattern_bins
    return (
        # A spike of noise, or any one pattern: no pattern has more spikes than all have together.
        grown(channels, d.n_events + task.pattern_channels.size + 1),
        grown(offsets, d.first_bin + n_bins + 1),
        grown(onsets, d.end + max(d.count, 0)),
        grown(classes, d.end + max(d.count, 0)),
    )


@compiled
def append_trial(
    rng: Generator,
    task: TaskArrays,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    onsets: NDArray[np.int64],
    classes: NDArray[np.int64],
    bin_: int,
    presentation: int,
) -> tuple[
    NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], int, int, int
]:
    """Append one trial; bin `bin_` is its first bin, number `presentation` its first presentation.

    `fill_trial` for those who do not count nanoseconds. Returns the four buffers, the bin and the
    number of the presentation that follow the trial's last, and the aggregate label.
    """
    draft = np.zeros(1, DRAFT)
    begin_trial(draft, offsets, bin_, presentation)
    while not fill_trial(rng, task, channels, offsets, onsets, classes, draft):
        channels, offsets, onsets, classes = longer_buffers(
            task, channels, offsets, onsets, classes, draft
        )
    d = draft[0]
    return channels, offsets, onsets, classes, d.bin_, d.presentation, d.label


@compiled
def append_piece(
    rng: Generator,
    task: TaskArrays,
    noise_left: float,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    bin_: int,
) -> tuple[NDArray[np.int32], NDArray[np.int64], int, int, float]:
    """Append the next piece of the endless stream: some noise, then a pattern if one is due.

    `noise_left` is the state of the stream: noise bins still to come before the next pattern, or
    −1 where that number is to be drawn (at the very beginning and after each pattern). Returns the
    buffers, the number of noise bins in the piece, the class of the pattern that follows them
    (−1: none yet) and the new `noise_left`.
    """
    if noise_left < 0:
        noise_left = np.floor(rng.standard_exponential() / task.onset_hazard)
        if not noise_left >= 0:  # 0 / 0: no pattern ever starts
            noise_left = np.inf
    n_noise = int(min(noise_left, float(PIECE_BINS)))
    offsets = grown(offsets, bin_ + n_noise + task.pattern_bins + 1)
    position, n_events, done = -1, offsets[bin_], n_noise == 0
    while not done:
        position, n_events, done = _fill_noise(
            rng, task, n_noise, channels, offsets, bin_, position, n_events
        )
        if not done:
            channels = grown(channels, channels.size + 1)
    class_ = -1
    if noise_left > PIECE_BINS:
        noise_left -= PIECE_BINS
    else:
        noise_left = -1.0
        class_ = int(rng.random() * task.n_classes)
        channels = grown(channels, n_events + _pattern_spikes(task, class_))
        _fill_pattern(rng, task, task.noise, class_, channels, offsets, bin_ + n_noise)
    return channels, offsets, n_noise, class_, noise_left


def new_buffers() -> tuple[
    NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]
]:
    """Empty buffers for channels, offsets (offsets[0] = 0), onsets and classes."""
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    return channels, offsets, np.empty(8, np.int64), np.empty(8, np.int64)
