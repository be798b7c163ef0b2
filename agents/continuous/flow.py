"""From one input spike to the next: how V and R go on by themselves, and how much S they give.

Between input spikes V falls towards 0 without ever turning round, so that it crosses the readout
threshold at most once, and downwards. For η = 0 V and S are known in closed form. For η > 0 the
equations are solved by the classical Runge–Kutta method of order 4 in equal steps, divided where
the Hill function is steep; within a step V is the cubic that has V and dV/dt right at both ends
(order 4 as well), which gives the area under V and the time of a crossing.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.neurons.gnm import REAL, WHOLE, hill_template
from agents.neurons.gnm import Parameters as Rates
from gnm_env.compiled import compiled, specialise

CLOSED_FORM, SMOOTH_WHOLE, SMOOTH, STEP = range(4)
"""static[0]: η = 0; η > 0 with an exponent of the Hill function that is whole, real, infinite."""

STEPS_PER_BIN = 8
"""Runge–Kutta steps per bin. What they are good for is measured in the documentation."""

_PIECES = 2.0
"""Steps per unit of h·ln V, the argument of the Hill function, where that function is steep."""

_HALVINGS = 50
"""Bisections of a step to find a crossing: to rounding."""

_hill_whole = specialise(hill_template, f"{WHOLE}_flow", RECOVERY=WHOLE)
_hill_real = specialise(hill_template, f"{REAL}_flow", RECOVERY=REAL)


class Between(NamedTuple):
    """Where V and R have come to, and the amount of output S on the way."""

    V: float
    R: float
    """The reset variable; where input takes time to react, what waits."""
    S: float


@compiled
def amount(rates: Rates, V: Any, V_end: Any) -> Any:
    """S between two input spikes for η = 0, while V falls from `V` to `V_end`.

    S = ∫ V dt over the time with V > ϑ_R; as dV = −αV dt it is (V − max(V_end, ϑ_R)) / α.
    """
    return max(V - max(V_end, rates.theta_r), 0.0) / rates.leak


@compiled
def slopes(rates: Rates, H: float, V: float, R: float) -> tuple[float, float]:
    """dV/dt = −(ηγR + (1−η)α) V and dR/dt = ζH − βR between input spikes."""
    return -(rates.eta_gamma * R + rates.leak) * V, rates.zeta * H - rates.beta * R


@compiled
def _activation(rates: Rates, static: tuple[int, ...], above: bool, V: float) -> float:
    """H(V); for an infinite exponent the caller says on which side of the step V is."""
    if static[0] == STEP:
        return 1.0 if above else 0.0
    return (
        _hill_whole(rates, static, V) if static[0] == SMOOTH_WHOLE else _hill_real(rates, static, V)
    )


@compiled
def _runge_kutta(
    rates: Rates, static: tuple[int, ...], above: bool, V: float, R: float, dt: float
) -> tuple[float, float]:
    """V and R after one step of the classical method of order 4."""
    v1, r1 = slopes(rates, _activation(rates, static, above, V), V, R)
    v, r = V + 0.5 * dt * v1, R + 0.5 * dt * r1
    v2, r2 = slopes(rates, _activation(rates, static, above, v), v, r)
    v, r = V + 0.5 * dt * v2, R + 0.5 * dt * r2
    v3, r3 = slopes(rates, _activation(rates, static, above, v), v, r)
    v, r = V + dt * v3, R + dt * r3
    v4, r4 = slopes(rates, _activation(rates, static, above, v), v, r)
    return V + dt / 6.0 * (v1 + 2.0 * (v2 + v3) + v4), R + dt / 6.0 * (r1 + 2.0 * (r2 + r3) + r4)


@compiled
def _cubic(V: float, V_end: float, d: float, d_end: float, s: float) -> float:
    """The cubic through `V` and `V_end` with slopes d and d_end (per step), at s in 0 … 1."""
    rise = V_end - V
    return V + s * (d + s * ((3.0 * rise - 2.0 * d - d_end) + s * (d + d_end - 2.0 * rise)))


@compiled
def _cubic_area(V: float, V_end: float, d: float, d_end: float, s: float) -> float:
    """The integral of `_cubic` from 0 to s."""
    rise = V_end - V
    third, fourth = 3.0 * rise - 2.0 * d - d_end, d + d_end - 2.0 * rise
    return s * (V + s * (d / 2.0 + s * (third / 3.0 + s * fourth / 4.0)))


@compiled
def _crossing(V: float, V_end: float, d: float, d_end: float, level: float) -> float:
    """Where in the step, 0 … 1, the cubic falls through `level`."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _cubic(V, V_end, d, d_end, middle) > level:
            low = middle
        else:
            high = middle
    return high


@compiled
def _step(
    rates: Rates, static: tuple[int, ...], V: float, R: float, dt: float
) -> tuple[float, float, float, float]:
    """One step of length dt, or up to the step of H if V falls through it: V, R, S, time left."""
    above = rates.theta_b < V
    V_end, R_end = _runge_kutta(rates, static, above, V, R, dt)
    d, _ = slopes(rates, 0.0, V, R)
    d_end, _ = slopes(rates, 0.0, V_end, R_end)
    left = 0.0
    if static[0] == STEP and above and V_end < rates.theta_b:
        part = _crossing(V, V_end, d * dt, d_end * dt, rates.theta_b) * dt
        left, dt = dt - part, part
        _, R_end = _runge_kutta(rates, static, above, V, R, dt)
        V_end = rates.theta_b
        d_end, _ = slopes(rates, 0.0, V_end, R_end)
    S = 0.0
    if rates.theta_r < V:
        s = 1.0
        if V_end < rates.theta_r:
            s = _crossing(V, V_end, d * dt, d_end * dt, rates.theta_r)
        S = _cubic_area(V, V_end, d * dt, d_end * dt, s) * dt
    return V_end, R_end, S, left


@compiled
def _pieces(rates: Rates, static: tuple[int, ...], V: float, R: float, dt: float) -> int:
    """Into how many a step is to be divided: many where V passes the steep part of H, else 1."""
    fall, _ = slopes(rates, 0.0, V, R)
    steep = (
        rates.flat_below * rates.theta_b < V and V + fall * dt < rates.flat_above * rates.theta_b
    )
    return 1 + int(_PIECES * rates.h * -fall / V * dt) if static[0] != STEP and steep else 1


@compiled
def flow(
    rates: Rates, static: tuple[int, ...], V: float, R: float, duration: float, steps_per_bin: int
) -> Between:
    """V and R after `duration` bins without input, and the S of that time."""
    if static[0] == CLOSED_FORM:
        V_end = V * math.exp(-rates.leak * duration)
        return Between(V_end, 0.0, amount(rates, V, V_end))
    n_steps = math.ceil(duration * steps_per_bin)
    dt = duration / max(n_steps, 1)
    S = 0.0
    for _ in range(n_steps):
        n_pieces = _pieces(rates, static, V, R, dt)
        for _ in range(n_pieces):
            V, R, gained, left = _step(rates, static, V, R, dt / n_pieces)
            S += gained
            if left > 0.0:
                V, R, gained, left = _step(rates, static, V, R, left)
                S += gained
    return Between(V, R, S)


# --- through a whole input -----------------------------------------------------------------------


@compiled
def lift(state: Between, jump: float) -> Between:
    """An input spike adds to V at once."""
    return Between(state.V + jump, state.R, 0.0)


def walk_template(
    numbers: Any,
    static: tuple[int, ...],
    jumps: NDArray[np.float64],
    times: NDArray[np.float64],
    at: NDArray[np.float64],
    steps_per_bin: int,
    course: NDArray[np.float64],
) -> None:
    """V, R and S at the times `at` into `course`, from event to event.

    An event is an input spike, of which `jumps` holds the weight, or a time to report at. A neuron
    with another course than `flow` and `lift` give binds its own in their place.
    """
    state = Between(0.0, 0.0, 0.0)
    now = 0.0
    S = 0.0
    spike = 0
    for k in range(at.size):
        while spike < times.size and times[spike] <= at[k]:
            state = flow(numbers, static, state.V, state.R, times[spike] - now, steps_per_bin)
            S += state.S
            now = times[spike]
            state = lift(state, jumps[spike])
            spike += 1
        state = flow(numbers, static, state.V, state.R, at[k] - now, steps_per_bin)
        S += state.S
        now = at[k]
        course[0, k] = state.V
        course[1, k] = state.R
        course[2, k] = S


walk = specialise(walk_template, "continuous")
