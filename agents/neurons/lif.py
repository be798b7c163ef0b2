"""The leaky integrate-and-fire neuron (LIF) with a hard reset and a refractory period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.simd import seldom, where
from gnm_env.checks import MAX_BINS, real, whole
from gnm_env.compiled import inlined


class Parameters(NamedTuple):
    alpha: Any
    theta: Any
    refractory: Any


class State(NamedTuple):
    V: Any
    waiting: Any
    """Bins left whose input is ignored."""


@inlined
def step(
    p: Parameters, static: tuple[int, ...], state: State, current: Any
) -> tuple[State, Response]:
    """One bin: V(t) = (1−α) V(t−1) + I(t); at V(t) >= ϑ a spike, V <- 0, and then a pause.

    The response holds V before the reset: it is what learning and the readout see.
    """
    D = p.alpha * state.V
    V = state.V + where(state.waiting > 0.0, 0.0, current) - D
    spike = p.theta <= V
    left = where(state.waiting > 0.0, state.waiting - 1.0, 0.0)
    after = State(seldom(spike, 0.0, V), seldom(spike, p.refractory, left))
    return after, Response(V, D, state.waiting, V, spike, spike)


@dataclass(frozen=True)
class LIF(Neuron):
    """Leaky integrate-and-fire neuron. Raises ValueError if a parameter is out of range.

    Attributes:
        alpha: α, decay of the membrane potential per bin, 0 … 1.
        refractory: bins after an output spike whose input is ignored, at most MAX_BINS.
        theta: ϑ, threshold, in membrane-potential units.
    """

    alpha: float = 0.3
    refractory: int = 0
    theta: float = 1.0

    name: ClassVar[str] = "lif"
    default_initial_weight: ClassVar[float] = 0.1
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State
    step: ClassVar[Any] = step

    def __post_init__(self) -> None:
        real("alpha", self.alpha, low=0.0, high=1.0)
        whole("refractory", self.refractory, low=0, high=MAX_BINS)
        real("theta", self.theta, above=0.0)

    @property
    def threshold(self) -> float:
        return self.theta

    @property
    def reads_V(self) -> bool:
        return True

    def parameters(self) -> tuple[float, ...]:
        return (self.alpha, self.theta, float(self.refractory))

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(1.0 - self.alpha)
