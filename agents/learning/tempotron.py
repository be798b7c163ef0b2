"""Tempotron: a spike or none, taught at the highest potential."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.learning.critical import membrane_decay
from agents.learning.peaks import mark
from agents.learning.rule import Rule, average_option, decay_option
from agents.learning.teaching import HeardTrial
from agents.model import Model


class Parameters(NamedTuple):
    """The rule's numbers."""

    decay: float
    """e^(−1/τ_m) of a multi-spike tempotron; of other neurons −1."""


def teach(p: Parameters, trial: HeardTrial, y: Any) -> None:
    """Silent where a spike is owed: +1 at the highest X; a spike where none is: −1 there."""
    X, count = trial.X, trial.counts.sum()
    if count == 0.0:
        best = 0
        for t in range(len(X)):
            if X[t] > X[best]:
                best = t
        mark(y, best, 1.0, trial.lag)
    elif count + trial.error == 0.0:
        first = 0
        while trial.spikes[first] == 0.0:
            first += 1
        best = first
        if p.decay >= 0.0:  # up to the next input; what follows is shunted
            highest, reset, t = trial.V[first], p.decay, first + 1
            while t < len(X) and trial.offsets[t] == trial.offsets[t + 1]:
                U = trial.V[t] + trial.threshold * reset
                if U > highest:
                    best, highest = t, U
                reset = p.decay * (reset + trial.spikes[t])
                t += 1
        mark(y, best, -1.0, trial.lag)


@dataclass(frozen=True)
class Tempotron(Rule):
    """The tempotron of Gütig & Sompolinsky (2006): trials are labelled 0 or 1.

    A trial is right if the neuron spikes where it is owed a spike and is silent where it is not. If
    it is silent for nothing, y = +1 at the highest readout; if it spikes for nothing, y = −1 at the
    highest potential: inputs after the first spike are shunted, so for the MST the highest one up
    to the bin before the next input, resets left out, and for other neurons the spike's own bin.

    Feedback: the error of the trial. Its sign is enough for a neuron that is silent after its first
    spike; these go on, and the sign does not tell two spikes where none is owed from two where one
    is, which is right here. Trials with labels above 1 are refused. The learning rate was chosen on
    pattern seeds 16–23. Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-2
    momentum: float = 0.2
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "tempotron"
    feedback: ClassVar[str] = "label"
    needs_spikes: ClassVar[bool] = True
    binary: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    teach: ClassVar[Any] = teach

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (membrane_decay(model),)
