"""A neuron of a user's own: a leaky integrate-and-fire neuron with an adaptive threshold."""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.neurons.neuron import Neuron, PSPKernel, Response


class State(NamedTuple):
    V: Any
    raised: Any


@dataclass(frozen=True)
class ALIF(Neuron):
    """Each spike resets V and raises the threshold, which falls back by `rho` a bin.

    Attributes:
        alpha: decay of the potential per bin.
        rho: what is left of a raised threshold after a bin.
        step_up: how much a spike raises the threshold.
        theta: threshold at rest.
    """

    alpha: float = 0.3
    rho: float = 0.9
    step_up: float = 0.2
    theta: float = 1.0
    name: ClassVar[str] = "alif"
    default_initial_weight: ClassVar[float] = 0.1
    state_type: ClassVar[type] = State

    @staticmethod
    def step(p: Any, static: Any, state: State, current: Any) -> Any:
        V = state.V - p.alpha * state.V + current
        spike = V >= p.theta + state.raised
        raised = p.rho * state.raised + (p.step_up if spike else 0.0)
        response = Response(V, p.alpha * state.V, state.raised, V, spike, spike)
        return State(0.0 if spike else V, raised), response

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(1.0 - self.alpha)
