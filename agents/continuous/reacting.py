"""A continuous neuron whose input takes time to react: its reaction network, with many molecules.

An input spike of channel i adds w_i to what waits, J, which becomes membrane potential at rate C:

    dJ/dt = −C J          dV/dt = C J − α V          S = ∫ Θ(V − ϑ_R) V dt

So one spike lifts V by C/(C−α) (e^−αt − e^−Ct), and by a step for C → ∞. Between the spikes V is
the sum of two exponentials, which turns round once at most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from agents.continuous.flow import Between, walk_template
from agents.continuous.neuron import ContinuousGNM
from agents.continuous.steps import GradedResponse
from gnm_env.checks import real
from gnm_env.compiled import compiled, specialise
from gnm_env.rules import compiled_rising as rising

_HALVINGS = 50
"""Bisections to find a crossing: to rounding."""


class Parameters(NamedTuple):
    """Rates per bin, and what the readout compares with and can give."""

    alpha: float
    conversion: float
    theta_r: float
    max_output: float


class State(NamedTuple):
    """At the end of a bin."""

    V: float
    waiting: float
    """J, input that is not yet membrane potential, in membrane-potential units."""


class _Sum(NamedTuple):
    """V between two input spikes: slow e^−αt + fast e^−Ct."""

    slow: float
    fast: float


@compiled
def _potential(p: Parameters, V: _Sum, t: float) -> float:
    return V.slow * math.exp(-p.alpha * t) + V.fast * math.exp(-p.conversion * t)


@compiled
def _area(p: Parameters, V: _Sum, start: float, end: float) -> float:
    """∫ V dt."""
    slow = math.exp(-p.alpha * start) - math.exp(-p.alpha * end)
    fast = math.exp(-p.conversion * start) - math.exp(-p.conversion * end)
    return V.slow * slow / p.alpha + V.fast * fast / p.conversion


@compiled
def _turn(p: Parameters, V: _Sum, duration: float) -> float:
    """When V turns round, from 0 to `duration`."""
    if V.slow * V.fast >= 0.0:
        return 0.0
    ratio = -p.conversion * V.fast / (p.alpha * V.slow)
    return min(max(math.log(ratio) / (p.conversion - p.alpha), 0.0), duration)


@compiled
def _amount(p: Parameters, V: _Sum, start: float, end: float) -> float:
    """S of a time in which V only rises or only falls."""
    first, last = _potential(p, V, start), _potential(p, V, end)
    rises = first < last
    if max(first, last) <= p.theta_r:
        return 0.0
    if p.theta_r < min(first, last):
        return _area(p, V, start, end)
    low, high = start, end
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if (p.theta_r < _potential(p, V, middle)) == rises:
            high = middle
        else:
            low = middle
    return _area(p, V, high, end) if rises else _area(p, V, start, high)


@compiled
def react(p: Parameters, V: float, waiting: float, duration: float) -> tuple[Between, float]:
    """V, J and S after `duration` bins without input, and the largest V on the way."""
    share = p.conversion / (p.conversion - p.alpha) * waiting
    course = _Sum(V + share, -share)
    turn = _turn(p, course, duration)
    end = _potential(p, course, duration)
    peak = max(V, _potential(p, course, turn), end)
    S = 0.0
    if p.theta_r < peak:
        S = _amount(p, course, 0.0, turn) + _amount(p, course, turn, duration)
    return Between(end, waiting * math.exp(-p.conversion * duration), S), peak


@compiled
def _go_on(
    p: Parameters, static: tuple[int, ...], V: float, waiting: float, duration: float, steps: int
) -> Between:
    return react(p, V, waiting, duration)[0]


@compiled
def _lift_what_waits(state: Between, jump: float) -> Between:
    return Between(state.V, state.R + jump, 0.0)


_WALK = specialise(walk_template, "reacting", flow=_go_on, lift=_lift_what_waits)


@compiled
def reacting_step(
    p: Parameters, static: tuple[int, ...], state: State, current: float
) -> tuple[State, GradedResponse]:
    """One bin: the input adds `current` to J at once. V(t) is the largest V of the bin."""
    end, peak = react(p, state.V, state.waiting + current, 1.0)
    S = min(end.S, p.max_output)
    spike = rising(p.theta_r, peak, state.V)
    response = GradedResponse(peak, peak - end.V, 0.0, peak, p.theta_r <= peak, spike, S)
    return State(end.V, end.R), response


@dataclass(frozen=True)
class ReactingGNM(ContinuousGNM):
    """The generalised neuron model (η = 0) as its reaction network is, with many molecules.

    Trained with it, a network with a finite C gives what it was trained to give; one that is made
    of a `ContinuousGNM` hears through another response than the one it learned with.

    Raises ValueError if a parameter is out of range.

    Attributes:
        conversion: C > 0, rate per bin at which input becomes membrane potential; not α.
        alpha, theta_r, max_output: as for a ContinuousGNM. eta must be 0, and what belongs to R
            has no effect.
    """

    conversion: float = 10.0

    name: ClassVar[str] = "reacting"
    parameters_type: ClassVar[type] = Parameters
    state_type: ClassVar[type] = State
    widest: ClassVar[int] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        real("conversion", self.conversion, above=0.0)
        if self.eta != 0.0:
            raise ValueError(f"eta must be 0, got {self.eta:g}: the decay by R is no reaction")
        if self.conversion == self.alpha:
            raise ValueError(
                f"conversion must differ from alpha, got {self.conversion:g} for both: "
                "change either a little"
            )

    def parameters(self) -> tuple[float, ...]:
        return tuple(self._numbers())

    def _numbers(self) -> Parameters:
        return Parameters(self.alpha, self.conversion, self.theta_r, self.max_output)

    def compiled_step(self) -> tuple[str, Any]:
        return "reacting", reacting_step

    def compiled_walk(self) -> tuple[Any, Any]:
        return _WALK, self._numbers()
