"""The same equations solved by SciPy: the yardstick for the compiled functions, written apart."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.continuous.neuron import ContinuousGNM
from agents.continuous.simulate import InputSpikes, Trajectory, checked_weights, report_times


def reference(
    neuron: ContinuousGNM,
    weights: ArrayLike,
    spikes: InputSpikes,
    at: ArrayLike | None = None,
    rtol: float = 1e-10,
    atol: float = 1e-12,
) -> Trajectory:
    """What `simulate` gives, by SciPy's adaptive `solve_ivp` (DOP853); slow.

    The solver starts anew at every input spike, and where V falls through ϑ_R (the rate of S jumps)
    or, for an infinite exponent, through ϑ_B (that of R does), so that it never steps over a jump.
    Raises ValueError as `simulate` does and for a `ReactingGNM`, RuntimeError if the solver fails.
    """
    if type(neuron) is not ContinuousGNM:
        raise ValueError(
            "reference takes a ContinuousGNM, whose input acts at once, got "
            f"{type(neuron).__name__}; use simulate, which is exact for it"
        )
    w, times = checked_weights(weights, spikes.n_inputs), report_times(spikes, at)
    course = np.empty((3, times.size))
    y = np.zeros(3)  # V, R, S
    start = 0.0
    for stop in np.unique(np.concatenate([spikes.times, times])):
        y = _solve(neuron, y, start, float(stop), rtol, atol)
        y[0] += w[spikes.channels[spikes.times == stop]].sum()
        course[:, times == stop] = y[:, None]
        start = float(stop)
    return Trajectory(times, *course)


def _solve(
    neuron: ContinuousGNM, y: NDArray[Any], start: float, stop: float, rtol: float, atol: float
) -> NDArray[Any]:
    """V, R and S at `stop`, with no input after `start`."""
    from scipy.integrate import solve_ivp

    levels = {neuron.theta_r, neuron.theta_b} if math.isinf(neuron.h) else {neuron.theta_r}
    while start < stop:
        # The levels that V is above decide the right-hand side until V falls through one.
        over = {level for level in levels if y[0] > level}
        solution = solve_ivp(
            _equations(neuron, over),
            (start, stop),
            y,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            events=[_falls_through(level) for level in sorted(over)],
        )
        if solution.status < 0:
            raise RuntimeError(f"solve_ivp failed at t = {solution.t[-1]:g}: {solution.message}")
        y, start = solution.y[:, -1], float(solution.t[-1])
        if solution.status == 1:
            hits = zip(sorted(over), solution.t_events, strict=True)
            y[0] = min(y[0], max(level for level, times in hits if times.size))
    return y


def _equations(neuron: ContinuousGNM, over: set[float]) -> Callable[[float, Any], list[float]]:
    from scipy.special import expit

    def H(V: float) -> float:
        if math.isinf(neuron.h):
            return float(neuron.theta_b in over)
        return float(expit(neuron.h * math.log(V / neuron.theta_b))) if V > 0.0 else 0.0

    def equations(t: float, y: Any) -> list[float]:
        V, R, _ = y
        D = neuron.eta * neuron.gamma * R * V + (1.0 - neuron.eta) * neuron.alpha * V
        return [-D, neuron.zeta * H(V) - neuron.beta * R, V if neuron.theta_r in over else 0.0]

    return equations


def _falls_through(level: float) -> Any:
    def event(t: float, y: Any) -> float:
        return float(y[0]) - level

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event
