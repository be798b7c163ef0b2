"""Target spike times from the label, and what rules that ask for spike times have in common."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from agents.learning.peaks import (
    Bins,
    Floats,
    extremes,
    mark,
    missed_peaks,
    spike_bins,
    spike_peaks,
)
from agents.learning.rule import Rule
from agents.learning.teaching import HeardTrial
from gnm_env.checks import choice
from gnm_env.compiled import compiled

TIMES = ("choose", "even")
"""Ways to take target times from the label.

"choose": in each presentation as many as it is owed of the highest peaks: those of the spikes, then
the missed ones. A spike that may stay is wanted in its own bin. "even": evenly spaced, of n in M
bins from `start` the g-th at start + ⌊g·M/(n+1)⌋. Noise has none.
"""


@compiled
def target_bins(
    X: Floats, spikes: Floats, edges: Bins, target: Bins, counts: Floats, threshold: float,
    even: bool,
) -> Bins:  # fmt: skip
    """Bins in which output spikes are wanted, by presentation."""
    bins = np.empty(target.sum(), np.int64)
    n = 0
    for segment in range(1, len(target), 2):
        start, stop, owed = edges[segment], edges[segment + 1], target[segment]
        if even:
            for g in range(1, owed + 1):
                bins[n] = start + (g * (stop - start)) // (owed + 1)
                n += 1
            continue
        own = spike_bins(spikes[start:stop], counts[segment]) + start
        peaks = spike_peaks(X, spikes, threshold, own)
        for t in extremes(X, peaks, owed, 1.0):
            bins[n] = own[np.searchsorted(peaks, t)]
            n += 1
        if owed > len(own):
            for t in extremes(X, missed_peaks(X, threshold, start, stop), owed - len(own), 1.0):
                bins[n] = t
                n += 1
    return bins[:n]


@compiled
def differences(targets: Bins, outputs: Bins, lag: int, y: Floats) -> None:
    """+1 at each target, −1 at each output spike."""
    for t in targets:
        mark(y, t, 1.0, lag)
    for t in outputs:
        mark(y, t, -1.0, lag)


def teach_difference(p: Any, trial: HeardTrial, y: Floats) -> None:
    """y = δ_target − δ_output."""
    targets = target_bins(
        trial.X, trial.spikes, trial.edges, trial.target, trial.counts, trial.threshold,
        p.even > 0.0,
    )  # fmt: skip
    outputs = spike_bins(trial.spikes, trial.counts.sum())
    differences(targets, outputs, trial.lag, y)


class SpikeTimesRule(Rule):
    """Base of the rules that ask for target spike times; `times` is a key of TIMES."""

    times: str
    feedback: ClassVar[str] = "presentations"
    needs_spikes: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("times", self.times, TIMES)
        if self.times == "even":  # the right count at the wrong times
            object.__setattr__(self, "learns_when_right", True)
