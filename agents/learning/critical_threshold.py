"""CriticalThreshold: the gradient of the threshold at which a spike would come or go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.critical import membrane_decay, teach_critical
from agents.learning.peaks import (
    extremes,
    highest_missed,
    mark,
    missed_peaks,
    spike_bins,
    spike_peaks,
)
from agents.learning.rule import Rule, average_option, decay_option
from agents.learning.teaching import HeardTrial
from agents.model import Model


class Parameters(NamedTuple):
    """The rule's numbers."""

    amount: float
    decay: float
    """e^(−1/τ_m) of a multi-spike tempotron; of other neurons −1."""


def teach(p: Parameters, trial: HeardTrial, y: Any) -> None:
    """As CriticalThreshold says: y at the bins of the nearest missing or extra spikes."""
    n = int(abs(trial.error) + 0.5) if p.amount > 0.0 else 1
    sign = 1.0 if trial.error > 0.0 else -1.0
    X, spikes, threshold = trial.X, trial.spikes, trial.threshold
    if p.decay >= 0.0:
        teach_critical(trial.V, spikes, threshold, p.decay, trial.counts.sum(), n, sign, y)
    elif sign < 0.0:
        bins = spike_bins(spikes, trial.counts.sum())
        for t in extremes(X, spike_peaks(X, spikes, threshold, bins), n, -1.0):
            mark(y, t, -1.0, trial.lag)
    elif n == 1:
        t = highest_missed(X, threshold)
        if t >= 0:
            mark(y, t, 1.0, trial.lag)
    else:
        for t in extremes(X, missed_peaks(X, threshold, 0, len(X)), n, 1.0):
            mark(y, t, 1.0, trial.lag)


@dataclass(frozen=True)
class CriticalThreshold(Rule):
    """Gradient of the critical threshold, after Gütig's multi-spike tempotron (Science 2016).

    The critical threshold ϑ*_k is where the number of output spikes falls from k or more to fewer
    as the threshold, and with it the reset, rises. With o spikes given, Δw = +λ ∇ϑ*_(o+1) if these
    were too few, −λ ∇ϑ*_o if too many.

    - MST: exact, in bins. y = ±1/C in the bin t* in which the spike comes or goes, with
      C = 1 + Σ_(t_s<t*) e^(−(t*−t_s)/τ_m). Where no threshold gives one spike more, nothing is
      learned.
    - GNM and LIF: too few, y = +1 at the highest missed peak of the readout; too many, y = −1 at
      the lowest of the spikes' peaks. Exact for the GNM at η = 0 as long as excursions above
      threshold neither split nor merge; otherwise resets and R are taken as they fell.

    Feedback: the sign of the error alone; with `amount` the error. The defaults, with unbounded
    weights, were chosen on pattern seeds 0–15. Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ. Large steps suit the rule: 3e-3 … 6e-2.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        amount: teach as many spikes at once as are missing or too many, not only the nearest.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-2
    momentum: float = 0.2
    amount: bool = False
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "critical"
    feedback: ClassVar[str] = "sign"
    needs_spikes: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    teach: ClassVar[Any] = teach

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.amount, (bool, np.bool_)):
            raise ValueError(f"amount must be True or False, got {self.amount!r}")
        if self.amount:
            object.__setattr__(self, "feedback", "label")

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (float(self.amount), membrane_decay(model))
