"""What is known of a leaky integrator before training: when it is trapped, what it tells apart.

The GNM at η = 0 is V(t) = (1−α)V(t−1) + I(t). Noise makes its potential an autoregressive process
of first order with, for weights w and a spike probability p per channel and bin,

    mean       μ  = p Σ w / α
    variance   σ² = p(1−p) Σ w² / (2α − α²)
    correlation of neighbouring bins  1 − α

treated here as Gaussian. Nothing in this file is fitted to a result.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnm_env import Patterns, Task

THETA = 1.0
"""Readout threshold."""

DIP = 0.5
"""Potential asked for midway between two spikes of a presentation, as a share of the threshold."""


def owed(task: Task) -> tuple[int, ...]:
    """Output spikes owed by a presentation of each class."""
    assert task.targets is not None  # a task puts them in when it is made
    return task.targets


def mean_potential(weights: ArrayLike, alpha: float, rate: float) -> float:
    """Mean of V in noise, for weights (N,) and `rate` spikes per channel and bin."""
    return rate * float(np.sum(weights)) / alpha


def crossing_rate(weights: ArrayLike, alpha: float, rate: float) -> float:
    """Upward crossings of the threshold per bin of noise.

    For two neighbouring bins of correlation ρ, P(V < ϑ, then V >= ϑ) = 2 T(z, √((1−ρ)/(1+ρ))) with
    Owen's T and z = (ϑ − μ)/σ.
    """
    from scipy.special import owens_t

    squares = float(np.sum(np.square(weights)))
    spread = math.sqrt(rate * (1 - rate) * squares / (2 * alpha - alpha**2))
    z = (THETA - mean_potential(weights, alpha, rate)) / spread
    return float(2 * owens_t(z, math.sqrt(alpha / (2 - alpha))))


def naive_trap(weights: ArrayLike, rate: float) -> float:
    """The α at which the mean potential of these weights is the threshold."""
    return rate * float(np.sum(weights)) / THETA


def trap(weights: ArrayLike, task: Task) -> float:
    """The α below which aggregate labels can only raise weights that start as these.

    A neuron whose potential lies above the threshold gives the one spike with which it rises there,
    and one for each time that noise takes it below and back. As long as these are fewer than the
    mean label, it hears "too few", its weights grow, and it crosses still less often. The α
    returned is where a mean trial has as many crossings as its label; where no weights at all give
    as many crossings, it is the α from which on weights with μ = ϑ do.
    """
    label = task.mean_occurrences * sum(owed(task))
    bins = task.background_bins + task.pattern_bins * task.mean_occurrences * task.n_classes
    # Crossings at μ = ϑ are the most there can be: T(0, a) = arctan(a) / 2π.
    barrier = 2 * math.tan(math.pi * (label - 1) / bins) ** 2
    barrier = barrier / (1 + barrier / 2)
    low, high = 1e-4, naive_trap(weights, task.rate)
    if 1 + bins * crossing_rate(weights, high, task.rate) <= label:
        return max(high, barrier)
    for _ in range(60):
        middle = (low + high) / 2
        escapes = 1 + bins * crossing_rate(weights, middle, task.rate) > label
        low, high = (low, middle) if escapes else (middle, high)
    return max(high, barrier)


def signal_to_noise(patterns: Patterns, task: Task, alpha: float) -> float:
    """How far the best weights lift the wanted spikes above noise, in standard deviations of noise.

    The weights are the shortest that bring V − μ to the threshold at as many bins of each pattern
    as it is owed spikes, and to DIP of it midway between two of them; the bins are those of the
    strongest input, one in each equal part of the pattern. What noise has left over when a pattern
    begins is neglected.
    """
    rate = task.rate
    spread = rate * (1 - rate) / (2 * alpha - alpha**2)
    rows: list[NDArray[np.float64]] = []
    wanted: list[float] = []
    for raster, target in zip(patterns.dense(), owed(task), strict=True):
        x = _traces(raster, alpha) - rate / alpha
        peaks = _strongest(x, target)
        rows += [x[bin_] for bin_ in peaks]
        wanted += [THETA] * len(peaks)
        for first, second in itertools.pairwise(peaks):
            if second - first >= 2:
                rows.append(x[(first + second) // 2])
                wanted.append(DIP * THETA)
    weights, *_ = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)
    return float(THETA / math.sqrt(spread * float(weights @ weights)))


def _traces(raster: NDArray[np.bool_], alpha: float) -> NDArray[np.float64]:
    """Response of each channel to the pattern alone, (bins, channels)."""
    traces = np.empty(raster.shape)
    x = np.zeros(raster.shape[1])
    for bin_, bits in enumerate(raster):
        x = (1 - alpha) * x + bits
        traces[bin_] = x
    return traces


def _strongest(x: NDArray[np.float64], parts: int) -> list[int]:
    """In each of `parts` equal parts of the pattern, the bin with the longest row of x."""
    ends = np.linspace(0, len(x), parts + 1).astype(int)
    return [
        int(first + np.argmax(np.sum(x[first:last] ** 2, axis=1)))
        for first, last in itertools.pairwise(ends)
    ]
