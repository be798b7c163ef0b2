"""A continuous neuron in bins, compiled: each bin's input arrives at its beginning."""

from __future__ import annotations

from typing import Any, NamedTuple

from agents.continuous.flow import STEPS_PER_BIN, Between, amount, flow
from agents.simd import like
from gnm_env.compiled import compiled
from gnm_env.rules import compiled_rising as rising


class Parameters(NamedTuple):
    """`agents.neurons.gnm.Parameters`, as rates per bin, and what the readout can give."""

    leak: Any
    eta_gamma: Any
    beta: Any
    zeta: Any
    theta_b: Any
    theta_r: Any
    h: Any
    flat_below: Any
    flat_above: Any
    low: Any
    high: Any
    max_output: Any
    left: Any
    """e^−(1−η)α, what is left of V after a bin; of use for η = 0 only."""


class State(NamedTuple):
    """At the end of a bin."""

    V: Any
    R: Any


class GradedResponse(NamedTuple):
    """What the neuron shows in one bin; compare `agents.model.Response`."""

    V: Any
    """Membrane potential right after the bin's input."""
    D: Any
    """What the rest of the bin takes away from it."""
    R: Any
    """The neuron's own reset variable at the beginning of the bin."""
    X: Any
    """Readout, compared with the threshold: V."""
    above: Any
    """Whether the readout is at or above the threshold right after the bin's input."""
    spike: Any
    """Whether V rises through ϑ_R in this bin: at its beginning, since only input lifts V."""
    S: Any
    """The amount of output, ∫ Θ(V − ϑ_R) V dt over the bin."""


@compiled
def exact_step(
    p: Parameters, static: tuple[int, ...], state: State, current: Any
) -> tuple[State, GradedResponse]:
    """One bin for η = 0: the input adds `current` to V at once, then V decays."""
    V = state.V + current
    left = p.left * V
    return _respond(p, state, V, Between(left, like(0.0, V), amount(p, V, left)))


@compiled
def numerical_step(
    p: Parameters, static: tuple[int, ...], state: State, current: float
) -> tuple[State, GradedResponse]:
    """One bin for η > 0: the input adds `current` to V at once, then V and R go on together."""
    V = state.V + current
    return _respond(p, state, V, flow(p, static, V, state.R, 1.0, STEPS_PER_BIN))


@compiled
def _respond(p: Parameters, state: State, V: Any, end: Between) -> tuple[State, GradedResponse]:
    S = min(end.S, p.max_output)
    spike = rising(p.theta_r, V, state.V)
    response = GradedResponse(V, V - end.V, state.R, V, p.theta_r <= V, spike, S)
    return State(end.V, end.R), response


STEPS = {True: ("continuous_exact", exact_step), False: ("continuous_numerical", numerical_step)}
"""The step for η = 0 and for other η, each with its name."""
