"""Peaks, spikes and target spike times: the bins in which a rule may teach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tests.agents.learning.oracles.neurons import Floats, Response


class Peak(NamedTuple):
    """A place at which a rule may teach."""

    height: float
    """Readout X there."""
    bin_: int
    spike: int
    """Bin of the output spike whose peak it is; its own bin for a missed peak."""


def is_peak(X: Floats, t: int) -> bool:
    """X(t−1) < X(t) >= X(t+1); what lies outside the trial is not asked."""
    rises = t == 0 or X[t - 1] < X[t]
    falls = t == len(X) - 1 or X[t] >= X[t + 1]
    return bool(rises and falls)


def missed_peaks(response: Response, threshold: float) -> list[Peak]:
    """Peaks of the readout below the threshold, by bin."""
    X = response.X
    return [Peak(float(X[t]), t, t) for t in range(len(X)) if X[t] < threshold and is_peak(X, t)]


def spike_peaks(response: Response, threshold: float, at: str = "peak") -> list[Peak]:
    """The peak of every output spike, by spike.

    The excursion that a spike opens lasts while the readout is at or above the threshold, up to the
    next spike: for a LIF, which resets at once, it is the spike's own bin. Its highest bin is the
    spike's peak, the first of several. `at="crossing"` takes the spike's own bin and height.
    """
    X, peaks = response.X, []
    for s in response.times:
        best, t = s, s + 1
        while at == "peak" and t < len(X) and X[t] >= threshold and not response.spikes[t]:
            best = t if X[t] > X[best] else best
            t += 1
        peaks.append(Peak(float(X[best]), best, s))
    return peaks


def highest(peaks: Sequence[Peak], n: int) -> list[Peak]:
    """The n highest, all if there are fewer; of equals the earliest."""
    return sorted(peaks, key=lambda peak: (-peak.height, peak.bin_))[: max(n, 0)]


def lowest(peaks: Sequence[Peak], n: int) -> list[Peak]:
    """The n lowest, all if there are fewer; of equals the earliest."""
    return sorted(peaks, key=lambda peak: (peak.height, peak.bin_))[: max(n, 0)]


def within(peaks: Sequence[Peak], start: int, stop: int) -> list[Peak]:
    """Those whose spike (missed peaks: whose bin) lies in bins start … stop − 1."""
    return [peak for peak in peaks if start <= peak.spike < stop]


def chosen_targets(
    response: Response, threshold: float, edges: Sequence[int], target: Sequence[int]
) -> list[int]:
    """Target spike times that the neuron chooses itself, ascending.

    In each presentation the spikes and the missed peaks compete by their peaks' heights, and the
    target-many highest win. A spike that wins is wanted where it is, in its own bin, so a
    presentation answered rightly has nothing to learn; a missed peak that wins is wanted in its
    bin. Where there are fewer than owed, those that there are.
    """
    candidates = spike_peaks(response, threshold) + missed_peaks(response, threshold)
    times = []
    for k in range(1, len(target), 2):
        here = within(candidates, edges[k], edges[k + 1])
        times += [peak.spike for peak in highest(here, target[k])]
    return sorted(times)


def even_targets(edges: Sequence[int], target: Sequence[int]) -> list[int]:
    """n spikes owed by M bins from `start`: start + ⌊g·M/(n+1)⌋ for g = 1 … n, ascending."""
    times = []
    for k in range(1, len(target), 2):
        start, n_bins, n = edges[k], edges[k + 1] - edges[k], target[k]
        times += [start + (g * n_bins) // (n + 1) for g in range(1, n + 1)]
    return sorted(times)


class Alignment(NamedTuple):
    """How one spike train becomes another at the least cost."""

    cost: float
    removed: list[int]
    """Output spikes without a target."""
    added: list[int]
    """Targets without an output spike."""
    moved: list[tuple[int, int]]
    """Output spikes and the targets that they are moved to."""


def align(outputs: Sequence[int], targets: Sequence[int], tau_q: float) -> Alignment:
    """Victor–Purpura alignment: adding or removing a spike costs 1, moving it by Δ ½(Δ/τ_q)².

    d[i][j] is the cost for the first i outputs and j targets. Of equal costs, removing goes before
    adding and adding before moving, decided from the last spikes backward.
    """

    def move(i: int, j: int) -> float:
        distance = abs(outputs[i] - targets[j]) / tau_q
        return distance * distance / 2.0

    n, m = len(outputs), len(targets)
    d = [[0.0] * (m + 1) for _ in range(n + 1)]
    for i in range(n + 1):
        for j in range(m + 1):
            ways = [d[i - 1][j] + 1.0] if i else []
            ways += [d[i][j - 1] + 1.0] if j else []
            ways += [d[i - 1][j - 1] + move(i - 1, j - 1)] if i and j else []
            d[i][j] = min(ways, default=0.0)
    removed, added, moved = [], [], []
    i, j = n, m
    while i or j:
        if i and d[i][j] == d[i - 1][j] + 1.0:
            i -= 1
            removed.append(outputs[i])
        elif j and d[i][j] == d[i][j - 1] + 1.0:
            j -= 1
            added.append(targets[j])
        else:
            i, j = i - 1, j - 1
            moved.append((outputs[i], targets[j]))
    return Alignment(d[n][m], removed[::-1], added[::-1], moved[::-1])
