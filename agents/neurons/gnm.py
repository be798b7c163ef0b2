"""The generalised neuron model (GNM) of Fil & Chu, equation 1."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.simd import any_lane, like, power, where, whole_power
from gnm_env.checks import choice, real
from gnm_env.compiled import specialise
from gnm_env.rules import compiled_rising as rising

LARGEST_WHOLE = 4096
"""Largest exponent that is raised by repeated squaring; above it `pow` is as good."""

# How R is computed: not at all, or by a Hill function whose exponent is whole, infinite or real.
# Each way is a step of its own, so that a neuron pays for no other; `_steps` binds the name.
NONE, WHOLE, INFINITE, REAL = "none", "whole", "infinite", "real"
RECOVERY = NONE


class Parameters(NamedTuple):
    leak: Any
    """(1−η)α"""
    eta_gamma: Any
    """ηγ"""
    beta: Any
    zeta: Any
    theta_b: Any
    theta_r: Any
    h: Any
    flat_below: Any
    """V/ϑ_B below which the Hill function is 0 to within 2⁻⁶⁰ …"""
    flat_above: Any
    """… and above which it is 1 to within rounding."""
    low: Any
    """V below which V/ϑ_B is at most flat_below, for normal numbers however it is rounded …"""
    high: Any
    """… and above which it is at least flat_above."""


class State(NamedTuple):
    V: Any
    R: Any
    X: Any


def hill_template(p: Parameters, static: tuple[int, ...], V: Any) -> Any:
    """H(V) = V^h / (ϑ_B^h + V^h), 0 for V <= 0; a step with ½ at V = ϑ_B for infinite h.

    Far from ϑ_B the function is flat to within rounding, and the power is not computed.
    """
    if RECOVERY == INFINITE:
        return where(p.theta_b < V, 1.0, where(p.theta_b == V, 0.5, like(0.0, V)))
    H = like(0.0, V)
    if any_lane(p.low < V):
        H = where(p.theta_b < V, 1.0, H)
        if any_lane((p.low < V) & (V < p.high)):
            # Not outside: a division takes as long as the rest of the bin.
            u = V / p.theta_b
            steep = (u > p.flat_below) & (u < p.flat_above)
            u_h = whole_power(u, static[1]) if RECOVERY == WHOLE else power(u, p.h)
            H = where(steep, u_h / (1.0 + u_h), H)
    return H


hill: Any = hill_template


def step_template(
    p: Parameters, static: tuple[int, ...], state: State, current: Any
) -> tuple[State, Response]:
    """One bin. With everything on the right taken at t−1 but the input I(t):

    D(t) = ηγ R V + (1−η)α V,  V(t) = V + I(t) − D(t),  R(t) = R + ζ H(V) − β R;
    an output spike where the readout X (V, or D) rises to ϑ_R or above it.
    """
    R = state.R
    D = p.leak * state.V
    if RECOVERY != NONE:
        D = p.eta_gamma * state.R * state.V + D
        R = state.R + p.zeta * hill(p, static, state.V) - p.beta * state.R
    V = state.V + current - D
    X = V if static[0] == 0 else D
    spike = rising(p.theta_r, X, state.X)
    return State(V, R, X), Response(V, D, R, X, p.theta_r <= X, spike)


def _bound(recovery: str) -> Any:
    hill = specialise(hill_template, recovery, inline=True, RECOVERY=recovery)
    return specialise(step_template, recovery, inline=True, RECOVERY=recovery, hill=hill)


STEPS = {recovery: _bound(recovery) for recovery in (NONE, WHOLE, INFINITE, REAL)}


@dataclass(frozen=True)
class GNM(Neuron):
    """Generalised neuron model: a leaky integrator with an optional soft reset.

    Raises ValueError if a parameter is out of range.

    Attributes:
        alpha: α, decay of the membrane potential per bin, 0 (never forgets) … 1 (no memory).
        eta: η, model choice, 0 (no spikiness: R has no effect) … 1 (decay by R alone).
        beta: β, decay of R per bin, 0 … 1.
        gamma: γ, strength of the decay by R.
        zeta: ζ, rate at which R grows above the behavioural threshold.
        theta_b: ϑ_B, behavioural threshold of the Hill function, in membrane-potential units.
        theta_r: ϑ_R, readout threshold, in units of the readout.
        h: exponent of the Hill function, >= 1; infinity makes it a step.
        readout: what is compared with ϑ_R, "V" or "D". With "D" leave the weights unbounded: D = αV
            must be able to reach ϑ_R.
    """

    alpha: float = 0.3
    eta: float = 0.0
    beta: float = 0.3
    gamma: float = 1.0
    zeta: float = 1.0
    theta_b: float = 1.0
    theta_r: float = 1.0
    h: float = 200.0
    readout: str = "V"

    name: ClassVar[str] = "gnm"
    default_initial_weight: ClassVar[float] = 0.1
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State

    def __post_init__(self) -> None:
        for name in ("alpha", "eta", "beta"):
            real(name, getattr(self, name), low=0.0, high=1.0)
        for name in ("gamma", "zeta"):
            real(name, getattr(self, name), low=0.0)
        for name in ("theta_b", "theta_r"):
            real(name, getattr(self, name), above=0.0)
        real("h", self.h, low=1.0, finite=False)
        choice("readout", self.readout, ("V", "D"))

    @property
    def threshold(self) -> float:
        return self.theta_r

    @property
    def reads_V(self) -> bool:
        return self.readout == "V"

    @property
    def readout_lag(self) -> int:
        """1 for D, which is made of the potential of the bin before."""
        return int(self.readout == "D")

    def parameters(self) -> tuple[float, ...]:
        flat_below, flat_above = 2.0 ** (-60.0 / self.h), 2.0 ** (54.0 / self.h)
        return (
            (1.0 - self.eta) * self.alpha,
            self.eta * self.gamma,
            self.beta,
            self.zeta,
            self.theta_b,
            self.theta_r,
            self.h,
            flat_below,
            flat_above,
            flat_below * self.theta_b * (1.0 - 2.0**-50),
            flat_above * self.theta_b * (1.0 + 2.0**-50),
        )

    def static(self, n_inputs: int) -> tuple[int, ...]:
        """Whether the readout is D, and the exponent where it is whole."""
        return (int(self.readout == "D"), int(self.h) if self._recovery() == WHOLE else 0)

    def compiled_step(self) -> tuple[str, Any]:
        return ("gnm_none", STEPS[NONE]) if self.eta == 0.0 else self.recording_step()

    def recording_step(self) -> tuple[str, Any]:
        recovery = self._recovery()
        return f"gnm_{recovery}", STEPS[recovery]

    def _recovery(self) -> str:
        if math.isinf(self.h):
            return INFINITE
        return WHOLE if self.h <= LARGEST_WHOLE and self.h == int(self.h) else REAL

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(1.0 - (1.0 - self.eta) * self.alpha)
