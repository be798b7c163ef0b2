"""PSD: precise-spike-driven plasticity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.learning.rule import average_option, decay_option
from agents.learning.spike_times import SpikeTimesRule, teach_difference
from agents.model import Model, PSPKernel
from agents.neurons.mst import MST
from gnm_env.checks import real


class Parameters(NamedTuple):
    """The rule's numbers."""

    even: float


@dataclass(frozen=True)
class PSD(SpikeTimesRule):
    """Precise-spike-driven plasticity (PSD), after Yu et al. (PLOS ONE 2013).

    y = δ_target − δ_output; the trace is the postsynaptic current, a difference of two exponentials
    with a peak of 1, whatever the neuron. Target times are not in the stream: see `times`. The
    constants are as we recall them.

    Feedback: where the presentations were and what each was owed. On every spiking neuron; exact as
    a rule, which is no gradient. The learning rate was chosen on pattern seeds 16–23. Raises
    ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        times: target times, see `agents.learning.spike_times.TIMES`: "choose", the neuron's own
            highest peaks, or "even", evenly spaced in each presentation.
        slow: time constant in bins of the current's decay …
        fast: … and of its rise.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 3e-3
    momentum: float = 0.2
    times: str = "choose"
    slow: float = 10.0
    fast: float = 2.5
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "psd"
    parameters_type: ClassVar[Any] = Parameters
    teach: ClassVar[Any] = teach_difference

    def __post_init__(self) -> None:
        super().__post_init__()
        real("slow", self.slow, above=0.0)
        real("fast", self.fast, above=0.0)
        if not self.fast < self.slow:
            raise ValueError(f"fast must be smaller than slow = {self.slow:g}, got {self.fast:g}")

    def kernel(self, model: Model) -> PSPKernel:
        super().kernel(model)  # refuses models without one
        return MST(tau_m=self.slow, tau_s=self.fast).psp_kernel()

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (float(self.times == "even"),)
