"""Peaks of the readout and of output spikes: the bins in which most rules teach.

A *peak* is a bin with X(t−1) < X(t) >= X(t+1); the first bin need not rise, the last need not fall.
A *missed peak* is one below the threshold. A *spike's peak* is the highest bin of the excursion at
or above the threshold that the spike opens, up to the next spike. Of equal heights the earliest
counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gnm_env.compiled import compiled, inlined

Floats = NDArray[np.float64]
Bins = NDArray[np.int64]


@inlined
def mark(y: Floats, bin_: int, value: float, lag: int) -> None:
    """Teach `value` in bin `bin_` of the readout, `lag` bins behind the potential that it shows."""
    if bin_ >= lag:
        y[bin_ - lag] += value


@inlined
def is_peak(X: Floats, t: int) -> bool:
    """Whether bin t is a peak; neighbours are those in the trial, also across segments."""
    return (t == 0 or X[t - 1] < X[t]) and (t == len(X) - 1 or X[t] >= X[t + 1])


@compiled
def highest_missed(X: Floats, threshold: float) -> int:
    """Bin of the highest missed peak, −1 if there is none."""
    best, height = -1, -np.inf
    for t in range(len(X)):
        x = X[t]
        if x > height and x < threshold and is_peak(X, t):
            best, height = t, x
    return best


@inlined
def peak_of_spike(X: Floats, spikes: Floats, threshold: float, spike: int) -> int:
    """Bin of the peak of the output spike in bin `spike`."""
    best, t = spike, spike + 1
    while t < len(X) and X[t] >= threshold and spikes[t] == 0.0:
        if X[t] > X[best]:
            best = t
        t += 1
    return best


@compiled
def spike_bins(spikes: Floats, count: float) -> Bins:
    """Bins of the output spikes, `count` in all, ascending."""
    bins = np.empty(int(count + 0.5), np.int64)
    n = t = 0
    while n < len(bins):
        if spikes[t] > 0.0:
            bins[n] = t
            n += 1
        t += 1
    return bins


@compiled
def spike_peaks(X: Floats, spikes: Floats, threshold: float, bins: Bins) -> Bins:
    """Peaks of the output spikes in `bins`."""
    peaks = np.empty_like(bins)
    for k in range(len(bins)):
        peaks[k] = peak_of_spike(X, spikes, threshold, bins[k])
    return peaks


@compiled
def missed_peaks(X: Floats, threshold: float, start: int, stop: int) -> Bins:
    """Bins of the missed peaks in bins start … stop − 1, ascending."""
    bins = np.empty((stop - start) // 2 + 1, np.int64)
    n = 0
    for t in range(start, stop):
        if X[t] < threshold and is_peak(X, t):
            bins[n] = t
            n += 1
    return bins[:n]


@compiled
def extremes(X: Floats, bins: Bins, n: int, sign: float) -> Bins:
    """The n of `bins` in which sign·X is highest, the highest first; all if there are fewer."""
    left = bins.copy()
    n = min(n, len(left))
    chosen = np.empty(n, np.int64)
    for m in range(n):
        best = -1
        for k in range(len(left)):
            if left[k] >= 0 and (best < 0 or sign * X[left[k]] > sign * X[left[best]]):
                best = k
        chosen[m] = left[best]
        left[best] = -1
    return chosen
