"""Chronotron: output spikes moved, added and removed at the least cost."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.alignment import teach_alignment
from agents.learning.peaks import spike_bins
from agents.learning.rule import average_option, decay_option
from agents.learning.spike_times import SpikeTimesRule, differences, target_bins
from agents.learning.teaching import HeardTrial, accumulate
from agents.model import Model, PSPKernel
from agents.neurons.mst import MST
from gnm_env.checks import choice, real


class Parameters(NamedTuple):
    """The rule's numbers."""

    even: float
    tau_q: float
    """0 for I-learning."""
    gamma_r: float


def change(p: Parameters, trial: HeardTrial, eligibility: Any) -> bool:
    """E-learning: ε of the alignment; I-learning: ε_i = |w_i| Σ κ_i, targets less outputs."""
    targets = target_bins(
        trial.X, trial.spikes, trial.edges, trial.target, trial.counts, trial.threshold,
        p.even > 0.0,
    )  # fmt: skip
    outputs = spike_bins(trial.spikes, trial.counts.sum())
    y = np.zeros(len(trial.X))
    if p.tau_q > 0.0:
        teach_alignment(outputs, np.sort(targets), p.tau_q, p.gamma_r, trial.lag, y)
        return accumulate(trial, y, eligibility)
    differences(targets, outputs, trial.lag, y)
    taught = accumulate(trial, y, eligibility)
    for i in range(len(eligibility)):
        eligibility[i] *= abs(trial.again.arrays.weights[i, 0])
    return taught


@dataclass(frozen=True)
class Chronotron(SpikeTimesRule):
    """The chronotron, after Florian (PLOS ONE 2012).

    E-learning aligns output spikes with targets at the least cost: to add or to remove a spike
    costs 1, to move it by Δ bins ½(Δ/τ_q)². Δw_i = λ {Σ_to add x_i(t_d) − Σ_to remove x_i(t_o) +
    (γ_r/τ_q²) Σ_to move (t_o − t_d) x_i(t_o)}. I-learning: Δw_i = λ sign(w_i) {Σ_targets I_i −
    Σ_outputs I_i} with the synaptic current I_i = w_i κ_i, weight included (recalled, not
    confirmed): a weight of 0 stays 0. Target times are not in the stream: see `times`.

    Feedback: where the presentations were and what each was owed. On every spiking neuron; resets
    are left out of the traces. The learning rate was chosen on pattern seeds 16–23. Raises
    ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        times: target times, see `agents.learning.spike_times.TIMES`: "choose", the neuron's own
            highest peaks, or "even", evenly spaced in each presentation.
        rule: "E" or "I".
        tau_q: τ_q in bins; None: the time constant of the neuron's membrane.
        gamma_r: γ_r; None: τ_q.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 3e-3
    momentum: float = 0.2
    times: str = "choose"
    rule: str = "E"
    tau_q: float | None = None
    gamma_r: float | None = None
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "chronotron"
    parameters_type: ClassVar[Any] = Parameters
    change: ClassVar[Any] = change

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("rule", self.rule, ("E", "I"))
        if self.tau_q is not None:
            real("tau_q", self.tau_q, above=0.0)
        if self.gamma_r is not None:
            real("gamma_r", self.gamma_r, low=0.0)

    def kernel(self, model: Model) -> PSPKernel:
        own = super().kernel(model)
        if self.rule == "I" and isinstance(model, MST):
            return PSPKernel(own.fast)
        if self.rule == "E" and self.tau_q is None and not 0.0 < own.slow < 1.0:
            raise ValueError(
                f"the membrane of {model!r} has no time constant that could be τ_q: give tau_q"
            )
        return own

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        even = float(self.times == "even")
        if self.rule == "I":
            return (even, 0.0, 0.0)
        tau = -1.0 / math.log(self.kernel(model).slow) if self.tau_q is None else self.tau_q
        return (even, tau, tau if self.gamma_r is None else self.gamma_r)
