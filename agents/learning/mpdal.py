"""MPDAL: the highest potential that was no spike, or the last spike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from agents.learning.peaks import highest_missed, mark
from agents.learning.rule import Rule, average_option, decay_option
from agents.learning.teaching import HeardTrial


def teach(p: Any, trial: HeardTrial, y: Any) -> None:
    """Too few spikes: +1 at the highest missed peak; too many: −1 in the bin of the last spike."""
    if trial.error > 0.0:
        t = highest_missed(trial.X, trial.threshold)
    else:
        t = len(y) - 1
        while t >= 0 and trial.spikes[t] == 0.0:
            t -= 1
    if t >= 0:
        mark(y, t, 1.0 if trial.error > 0.0 else -1.0, trial.lag)


@dataclass(frozen=True)
class MPDAL(Rule):
    """Membrane-potential-driven aggregate-label learning, after Zhang et al. (AAAI 2019).

    Too few output spikes: y = +1 at the highest missed peak of the readout, at the true threshold;
    too many: y = −1 in the bin of the last output spike. Resets are taken as they fell, so the step
    is a gradient of the potential in that bin, not of a threshold; that it is the *last* spike that
    is taken away is the authors' choice as we recall it.

    Feedback: the sign of the error alone. On every spiking neuron. The learning rate was chosen on
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

    name: ClassVar[str] = "mpdal"
    feedback: ClassVar[str] = "sign"
    needs_spikes: ClassVar[bool] = True
    teach: ClassVar[Any] = teach
