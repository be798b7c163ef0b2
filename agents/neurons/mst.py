"""Gütig's multi-spike tempotron (MST), with its bi-exponential synapses and soft reset."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.simd import seldom
from gnm_env.checks import real
from gnm_env.compiled import inlined
from gnm_env.rules import compiled_rising as rising


class Parameters(NamedTuple):
    slow: Any
    """e^(−1/τ_m)"""
    fast: Any
    """e^(−1/τ_s)"""
    scale: Any
    """V_norm: makes the largest response to a single unit spike 1."""
    theta: Any


class State(NamedTuple):
    slow: Any
    """Σ w e^(−(t−t_j)/τ_m) over the input spikes so far."""
    fast: Any
    """Σ w e^(−(t−t_j)/τ_s), likewise."""
    reset: Any
    """Σ e^(−(t−t_s)/τ_m) over earlier output spikes, as it stands in the coming bin."""
    V: Any


@inlined
def step(
    p: Parameters, static: tuple[int, ...], state: State, current: Any
) -> tuple[State, Response]:
    """One bin: V(t) = V_norm Σ_j w [e^(−(t−t_j)/τ_m) − e^(−(t−t_j)/τ_s)] − ϑ Σ_s e^(−(t−t_s)/τ_m).

    Three decaying sums carry the whole history of input spikes t_j and output spikes t_s.
    """
    slow = p.slow * state.slow + current
    fast = p.fast * state.fast + current
    D = p.theta * state.reset
    V = p.scale * (slow - fast) - D
    spike = rising(p.theta, V, state.V)
    reset = p.slow * seldom(spike, state.reset + 1.0, state.reset)
    return State(slow, fast, reset, V), Response(V, D, state.reset, V, p.theta <= V, spike)


@dataclass(frozen=True)
class MST(Neuron):
    """Multi-spike tempotron.

    Raises ValueError unless 0 < tau_s < tau_m and theta > 0, and the two time constants can be told
    apart within the precision of float64.

    Attributes:
        tau_m: τ_m, membrane time constant in bins.
        tau_s: τ_s, synaptic time constant in bins.
        theta: ϑ, threshold, in membrane-potential units.
    """

    tau_m: float = 20.0
    tau_s: float = 5.0
    theta: float = 1.0

    name: ClassVar[str] = "mst"
    default_initial_weight: ClassVar[float] = 0.02
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State
    step: ClassVar[Any] = step

    def __post_init__(self) -> None:
        real("tau_m", self.tau_m, above=0.0)
        real("tau_s", self.tau_s, above=0.0)
        real("theta", self.theta, above=0.0)
        if not self.tau_s < self.tau_m:
            raise ValueError(
                f"tau_s must be smaller than tau_m = {self.tau_m:g}, got {self.tau_s:g}: "
                "the response to a spike rises with tau_s and falls with tau_m"
            )
        slow, fast, scale, _ = self.psp_kernel()
        if not (math.isfinite(scale) and scale > 0.0 and fast < slow):
            raise ValueError(
                f"tau_m = {self.tau_m:g} and tau_s = {self.tau_s:g} must leave a response to a "
                "spike, and in float64 they leave none: choose them nearer to 20 and 5 bins"
            )

    @property
    def threshold(self) -> float:
        return self.theta

    @property
    def reads_V(self) -> bool:
        return True

    @property
    def v_norm(self) -> float:
        """V_norm = k^(k/(k−1)) / (k−1) with k = τ_m/τ_s."""
        k = self.tau_m / self.tau_s
        return float(k ** (k / (k - 1.0)) / (k - 1.0)) if 1.0 < k < math.inf else math.nan

    def parameters(self) -> tuple[float, ...]:
        kernel = self.psp_kernel()
        return (kernel.slow, kernel.fast, kernel.scale, self.theta)

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(
            math.exp(-1.0 / self.tau_m),
            math.exp(-1.0 / self.tau_s),
            self.v_norm,
            biexponential=True,
        )
