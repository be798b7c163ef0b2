"""The stream once more in plain Python and NumPy, drawn from the same generator in the same order.

Written for the tests, from the description of the task, and sharing no code with the package.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env import Task

PIECE_BINS = 2_048

Raster = NDArray[np.bool_]


def noise(task: Task, n_bins: int, rng: Generator) -> Raster:
    """Bernoulli bits, bin by bin, from the geometric gaps between the ones.

    Channels with rates of their own: ones at the largest, each kept with its channel's share.
    """
    rate = task.rate if task.rates is None else max(task.rates)
    bits = np.zeros(n_bins * task.n_inputs, np.bool_)
    position = -1
    while True:
        exponential = rng.standard_exponential()
        if rate == 0:
            break
        gap = exponential / -math.log1p(-rate) if rate < 1 else 0.0
        if position + 1 + gap >= len(bits):
            break
        position += 1 + math.floor(gap)
        channel = position % task.n_inputs
        bits[position] = task.rates is None or rng.random() < task.rates[channel] / rate
    return bits.reshape(n_bins, task.n_inputs)


def occurrence(task: Task, pattern: Raster, rng: Generator) -> Raster:
    """The pattern with its noise: first deletion, then displacement, spike by spike."""
    if task.jitter_bins == 0 and task.deletion == 0:
        return pattern.copy()
    heard = np.zeros_like(pattern)
    for m, channel in np.argwhere(pattern):
        if task.deletion > 0 and rng.random() < task.deletion:
            continue
        shift = 0
        if task.jitter_bins > 0:
            shift = math.floor(rng.random() * (2 * task.jitter_bins + 1)) - task.jitter_bins
        heard[min(max(m + shift, 0), task.pattern_bins - 1), channel] = True
    return heard


def trial(task: Task, patterns: Raster, rng: Generator) -> tuple[Raster, list[int], list[int], int]:
    """One trial: raster (T, N), onsets, classes and aggregate label."""
    inserted = []
    for class_ in range(task.n_classes):
        for _ in range(rng.poisson(task.mean_occurrences)):
            inserted.append((math.floor(rng.random() * task.background_bins), class_))
    inserted.sort()

    parts: list[Raster] = []
    onsets, n_bins, done = [], 0, 0
    for before, class_ in inserted:
        if before > done:
            parts.append(noise(task, before - done, rng))
            n_bins += before - done
            done = before
        onsets.append(n_bins)
        parts.append(occurrence(task, patterns[class_], rng))
        n_bins += task.pattern_bins
    parts.append(noise(task, task.background_bins - done, rng))
    classes = [class_ for _, class_ in inserted]
    return np.concatenate(parts), onsets, classes, sum(task.owed[c] for c in classes)


def pieces(task: Task, patterns: Raster, rng: Generator) -> Iterator[tuple[Raster, Raster, int]]:
    """The endless stream as (noise, pattern, class); class −1: no pattern yet."""
    while True:
        q = task.onset_probability
        exponential = rng.standard_exponential()
        left = math.inf if q == 0 else 0.0 if q == 1 else exponential // -math.log1p(-q)
        while left > PIECE_BINS:
            yield noise(task, PIECE_BINS, rng), np.zeros((0, task.n_inputs), np.bool_), -1
            left -= PIECE_BINS
        before = noise(task, int(left), rng) if left else np.zeros((0, task.n_inputs), np.bool_)
        class_ = math.floor(rng.random() * task.n_classes)
        yield before, occurrence(task, patterns[class_], rng), class_


def stream(
    task: Task, patterns: Raster, rng: Generator, n_bins: int
) -> tuple[Raster, NDArray[np.int64], NDArray[np.int64]]:
    """At least `n_bins` bins: raster, class of each bin (−1: noise), and its bin in the pattern."""
    rasters: list[Raster] = []
    classes: list[int] = []
    places: list[int] = []
    for before, pattern, class_ in pieces(task, patterns, rng):
        rasters += [before, pattern]
        classes += [-1] * len(before) + [class_] * len(pattern)
        places += [-1] * len(before) + list(range(len(pattern)))
        if len(classes) >= n_bins:
            return np.concatenate(rasters), np.array(classes), np.array(places)
    raise AssertionError("the stream never ends")


def perfect_answers(task: Task, classes: NDArray[np.int64], places: NDArray[np.int64]) -> list[int]:
    """The spikes of an oracle that knows classes and onsets: at the start of each occurrence."""
    return [
        int(class_ >= 0 and place < task.owed[class_])
        for class_, place in zip(classes, places, strict=True)
    ]
