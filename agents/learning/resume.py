"""ReSuMe: remote supervision by target spike times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.peaks import spike_bins
from agents.learning.rule import average_option, decay_option
from agents.learning.spike_times import SpikeTimesRule, differences, target_bins
from agents.learning.teaching import HeardTrial, accumulate
from agents.model import Model, PSPKernel
from gnm_env.checks import real


class Parameters(NamedTuple):
    """The rule's numbers."""

    even: float
    a: float


def change(p: Parameters, trial: HeardTrial, eligibility: Any) -> bool:
    """ε_i = Σ_t x_i(t) y(t) + a·(targets − outputs), y = δ_target − δ_output."""
    targets = target_bins(
        trial.X, trial.spikes, trial.edges, trial.target, trial.counts, trial.threshold,
        p.even > 0.0,
    )  # fmt: skip
    outputs = spike_bins(trial.spikes, trial.counts.sum())
    y = np.zeros(len(trial.X))
    differences(targets, outputs, trial.lag, y)
    taught = accumulate(trial, y, eligibility)
    extra = p.a * (len(targets) - len(outputs))
    for i in range(len(eligibility)):
        eligibility[i] += extra
    return taught or extra != 0.0


@dataclass(frozen=True)
class ReSuMe(SpikeTimesRule):
    """Remote supervision (ReSuMe), after Ponulak & Kasiński (Neural Computation 2010).

    Every target spike raises the weights of the inputs before it, every output spike lowers them:
    Δw_i = λ {Σ_targets [a + Σ e^(−(t_d − t_i)/τ)] − Σ_outputs [a + Σ e^(−(t_o − t_i)/τ)]}, over the
    input spikes up to each, the same bin included. Target times are not in the stream: see `times`.

    Feedback: where the presentations were and what each was owed. On every spiking neuron; exact as
    a rule, which is no gradient. The learning rate was chosen on pattern seeds 16–23. Raises
    ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        times: target times, see `agents.learning.spike_times.TIMES`: "choose", the neuron's own
            highest peaks, or "even", evenly spaced in each presentation.
        a: what each target adds to every weight, and each output spike takes away.
        tau: τ in bins; None: that of the neuron's own membrane.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 3e-3
    momentum: float = 0.2
    times: str = "choose"
    a: float = 0.0
    tau: float | None = None
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "resume"
    parameters_type: ClassVar[Any] = Parameters
    change: ClassVar[Any] = change

    def __post_init__(self) -> None:
        super().__post_init__()
        real("a", self.a)
        if self.tau is not None:
            real("tau", self.tau, above=0.0)

    def kernel(self, model: Model) -> PSPKernel:
        own = super().kernel(model)
        return PSPKernel(own.slow if self.tau is None else math.exp(-1.0 / self.tau))

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (float(self.times == "even"), self.a)
