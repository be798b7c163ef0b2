"""PeakError: a perceptron on misplaced peaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from agents.learning.peaks import extremes, mark, missed_peaks, spike_bins, spike_peaks
from agents.learning.rule import Rule, average_option, decay_option
from agents.learning.teaching import HeardTrial


def teach(p: Any, trial: HeardTrial, y: Any) -> None:
    """Spikes too many: −1 at the lowest of their peaks; missing ones: +1 at the highest missed."""
    X, spikes, threshold = trial.X, trial.spikes, trial.threshold
    for segment in range(len(trial.target)):
        owed = trial.target[segment]
        wrong = int(trial.counts[segment] + 0.5) - owed
        if wrong == 0:
            continue
        start, stop = trial.edges[segment], trial.edges[segment + 1]
        if wrong > 0:
            bins = spike_bins(spikes[start:stop], trial.counts[segment]) + start
            if p.first_only > 0.0:
                bins, wrong = bins[: owed + 1], 1
            chosen = spike_peaks(X, spikes, threshold, bins)
            if wrong < len(bins):
                chosen = extremes(X, chosen, wrong, -1.0)
        else:
            chosen = extremes(X, missed_peaks(X, threshold, start, stop), -wrong, 1.0)
        for t in chosen:
            mark(y, t, -1.0 if wrong > 0 else 1.0, trial.lag)
        if p.first_only > 0.0:
            break


@dataclass(frozen=True)
class PeakError(Rule):
    """A perceptron on misplaced peaks, a relative of FP learning (Memmesheimer et al. 2014).

    Every spike in noise: y = −1 at its peak. A presentation with too few spikes: y = +1 at as many
    of its highest missed peaks as are missing; with too many: y = −1 at as many of the lowest of
    its spikes' peaks as are too many. Each is the gradient of the potential in that bin, resets and
    R taken as they fell.

    Feedback: where the presentations were and what each was owed. On every spiking neuron. The
    learning rate was chosen on pattern seeds 0–15. Raises ValueError if a parameter is out of
    range.

    Attributes:
        learning_rate: λ; weights are best left unbounded: 3e-3 … 3e-2.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        first_only: stop at the first mistake of the trial, as the noisy performance does.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 3e-3
    momentum: float = 0.2
    first_only: bool = False
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "peak-error"
    feedback: ClassVar[str] = "presentations"
    needs_spikes: ClassVar[bool] = True
    teach: ClassVar[Any] = teach

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.first_only, (bool, np.bool_)):
            raise ValueError(f"first_only must be True or False, got {self.first_only!r}")
