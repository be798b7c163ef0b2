"""The network bin by bin, compiled: the equations of `Network`, and the slopes that learning needs.

All weights of a network lie in one column, W by inputs and then u: W_ik at i·H + k, u_k at N·H + k.
Its memory holds v, z and j, H rows each; its state is V and Σ_k z_k. Without a hidden layer H is 0,
and the weights are u (N,).
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from agents.model import Arrays, Response
from agents.neurons.neuron import input_current
from agents.simd import like, load, power, store, where
from gnm_env.compiled import specialise
from gnm_env.rules import compiled_rising as rising

LARGEST_POWER = 1e16
"""Largest (v/ϑ_B)^h that is computed: from here on v^h / (ϑ_B^h + v^h) is 1 to within rounding."""


class NetworkParams(NamedTuple):
    """The parameters of a network as compiled code takes them."""

    alpha: Any
    inhibition: Any
    kappa: Any
    theta_b: Any
    h: Any
    theta_r: Any
    largest: Any
    """v/ϑ_B beyond which the Hill function no longer changes."""


class State(NamedTuple):
    """What passes from bin to bin beside the memory."""

    V: Any
    total: Any
    """Σ_k z_k"""


# Bound for each kind of Hill function; the defaults only say what belongs there.
FOURTH = False
"""Whether its exponent is 4, which needs no power."""
UNIT = False
"""Whether ϑ_B is 1, so that nothing has to be divided by it."""
hill: Any = None
hidden_step: Any = None


def largest_ratio(h: float) -> float:
    """v/ϑ_B at which (v/ϑ_B)^h reaches LARGEST_POWER."""
    return float(LARGEST_POWER ** (1.0 / h))


def advance_template(
    p: NetworkParams,
    static: tuple[int, int],
    arrays: Arrays,
    state: State,
    channels: Any,
    first: int,
    last: int,
    row: int,
) -> tuple[State, Response]:
    """One bin, in which channels[first:last] spike. Notes H'(v_k) and j_k from `row` on."""
    zero = like(0.0, state.V)
    total = zero
    if static[1] == 0:
        I = input_current(arrays.weights, channels, first, last, zero)
    else:
        I, total = hidden_step(p, static, arrays, state.total, channels, first, last, row)
    D = p.alpha * state.V
    V = state.V + I - D
    response = Response(V, D, zero, V, p.theta_r <= V, rising(p.theta_r, V, state.V))
    return State(V, total), response


def hidden_step_template(
    p: NetworkParams,
    static: tuple[int, int],
    arrays: Arrays,
    total: Any,
    channels: Any,
    first: int,
    last: int,
    row: int,
) -> tuple[Any, Any]:
    """The hidden layer in one bin; returns the readout's input, Σ_k u_k j_k, and Σ_k z_k."""
    weights, memory, notes = arrays
    zero = like(0.0, total)
    H = static[1]
    for k in range(H):
        v, z = load(memory, k, zero), load(memory, H + k, zero)
        store(memory, k, v - p.alpha * v - p.inhibition * (total - z))
    for e in range(first, last):
        W = channels[e] * H
        for k in range(H):
            store(memory, k, load(memory, k, zero) + load(weights, W + k, zero))
    I = zero
    total = zero
    for k in range(H):
        z, slope = hill(p, load(memory, k, zero))
        j = load(memory, 2 * H + k, zero)
        j = j - p.kappa * j + z
        store(memory, H + k, z)
        store(memory, 2 * H + k, j)
        store(notes, row + k, slope)
        store(notes, row + H + k, j)
        total = total + z
        I = I + load(weights, static[0] * H + k, zero) * j
    return I, total


def hill_template(p: NetworkParams, v: Any) -> tuple[Any, Any]:
    """z = H(v) and its derivative H'(v); both are 0 for v <= 0.

    With q = (v/ϑ_B)^h: H = q / (1 + q), H' = h q / (v (1 + q)²). Not the function of
    `agents.neurons.gnm`: the exponent is small, so nothing is flat, and learning needs H'.
    """
    # Clamped, so that no power overflows. NaN passes, so that learning notices and refuses it.
    r = v if UNIT else v / p.theta_b
    r = where(r < 0.0, 0.0, where(r > p.largest, p.largest, r))
    cube = r * r * r if FOURTH else where(r > 0.0, power(r, p.h - 1.0), 0.0)
    q = cube * r
    s = 1.0 / (1.0 + q)
    return q * s, p.h / p.theta_b * cube * (s * s)


@functools.cache
def advance_for(fourth: bool, unit: bool) -> tuple[str, Any]:
    """A label and the compiled step for a Hill function of this kind."""
    label = f"network{'_fourth' if fourth else ''}{'_unit' if unit else ''}"
    names = {"FOURTH": fourth, "UNIT": unit}
    hill = specialise(hill_template, label, inline=True, **names)
    hidden = specialise(hidden_step_template, label, inline=True, hill=hill)
    return label, specialise(advance_template, label, inline=True, hidden_step=hidden)
