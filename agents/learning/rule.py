"""What every learning rule offers, and what a trial tells it.

A rule acts once, at the end of a trial. It is one file beside this one, with a frozen dataclass
derived from `Rule` and three compiled functions, written for one neuron or for many side by side
(see `agents.simd`):

- `correction(outcome) -> c`: 0 in the lanes that the trial teaches nothing, else what
  `weight_change` wants to know, such as the sign of the error;
- `teaching_signal(mode, V, E) -> y(t)`: eligibilities are ε_i = Σ_t x_i(t) y(t), with the
  presynaptic trace x_i, the membrane potential V(t) and the error trace E(t);
- `weight_change(p, mode, c, eligibility)`: turns ε into Δw, in place.

Momentum and bounds are the same for every rule and live in `momentum.py`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

from agents.neurons.neuron import Neuron, Trace
from gnm_env.checks import real


class Outcome(NamedTuple):
    """What a whole trial came to."""

    emitted: Any
    """Output spikes in the trial."""
    label: Any
    """Output spikes owed: the aggregate label."""
    blamed: Any
    """Whether the error trace E is anything but zero; of noise only where the rule uses E."""


class RuleParameters(NamedTuple):
    """The numbers of any rule, one per lane."""

    learning_rate: Any
    momentum: Any
    lowest: Any
    """Lower weight bound …"""
    highest: Any
    """… and upper weight bound; infinite where there is none."""
    slow: Any
    """The presynaptic trace: see `agents.neurons.neuron.Trace`."""
    fast: Any
    scale: Any


class Rule(ABC):
    """Base of all learning rules. Each adds its fields as a frozen dataclass."""

    learning_rate: float
    momentum: float
    trace_decay: float | None

    name: ClassVar[str]
    uses_error: ClassVar[bool]
    """Whether the error trace E(t) is needed; it needs the timing that the terminal info tells."""
    correction: ClassVar[Any]
    teaching_signal: ClassVar[Any]
    weight_change: ClassVar[Any]

    def __post_init__(self) -> None:
        real("learning_rate", self.learning_rate, low=0.0)
        real("momentum", self.momentum, low=0.0, high=1.0)
        if self.trace_decay is not None:
            real("trace_decay", self.trace_decay, low=0.0, high=1.0)

    def trace(self, neuron: Neuron) -> Trace:
        """The presynaptic trace: the neuron's own, or the decay per bin that the user gave."""
        return neuron.trace() if self.trace_decay is None else Trace(self.trace_decay)

    @abstractmethod
    def mode(self, n_inputs: int) -> tuple[int, ...]:
        """Settings that are not numbers per lane; neurons side by side must share them."""
