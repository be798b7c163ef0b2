"""SPAN: spike trains compared as smooth functions of time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.rule import average_option, decay_option
from agents.learning.spike_times import SpikeTimesRule, teach_difference
from agents.learning.teaching import HeardTrial
from agents.model import Model, PSPKernel
from gnm_env.checks import real
from gnm_env.compiled import compiled

compiled_difference = compiled(teach_difference)


class Parameters(NamedTuple):
    """The rule's numbers."""

    even: float
    tau: float
    decay: float
    """e^(−1/τ)"""


def teach(p: Parameters, trial: HeardTrial, y: Any) -> None:
    """y(t) = (e/2)² Σ_u d(u) (|t − u| + τ) e^(−|t − u|/τ), d = δ_target − δ_output.

    Forward in time for u <= t, then backward for u > t: Σ d e^(…) and Σ d |t − u| e^(…) are carried
    from bin to bin.
    """
    d = np.zeros(len(y))
    compiled_difference(p, trial, d)
    if not d.any():
        return
    scale = (math.e / 2.0) ** 2
    faded = weighted = 0.0
    for t in range(len(y)):
        weighted = p.decay * (weighted + faded)
        faded = p.decay * faded + d[t]
        y[t] = scale * (weighted + p.tau * faded)
    faded = weighted = 0.0
    for t in range(len(y) - 1, -1, -1):
        weighted = p.decay * (weighted + faded)
        faded = p.decay * faded
        y[t] += scale * (weighted + p.tau * faded)
        faded += d[t]


@dataclass(frozen=True)
class SPAN(SpikeTimesRule):
    """Spike pattern association neuron (SPAN), after Mohemmed et al. (2012).

    Inputs, targets and outputs are convolved with α(t) = (e/τ) t e^(−t/τ), and Δw_i is the integral
    of the input times the difference of target and output:
    Δw_i = λ (e/2)² {Σ_targets Σ_i (|t_i − t_d| + τ) e^(−|t_i − t_d|/τ) − the same over outputs}.
    So it sees inputs after a spike as well as before, and the presynaptic trace is the input spike
    alone. Target times are not in the stream: see `times`. α is as we recall it.

    Feedback: where the presentations were and what each was owed. On every spiking neuron; exact as
    a rule. The learning rate was chosen on pattern seeds 16–23. Raises ValueError if a parameter is
    out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        times: target times, see `agents.learning.spike_times.TIMES`: "choose", the neuron's own
            highest peaks, or "even", evenly spaced in each presentation.
        tau: τ in bins.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    times: str = "choose"
    tau: float = 5.0
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "span"
    parameters_type: ClassVar[Any] = Parameters
    teach: ClassVar[Any] = teach

    def __post_init__(self) -> None:
        super().__post_init__()
        real("tau", self.tau, above=0.0)

    def kernel(self, model: Model) -> PSPKernel:
        super().kernel(model)  # refuses models without one
        return PSPKernel(0.0)

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (float(self.times == "even"), self.tau, math.exp(-1.0 / self.tau))
