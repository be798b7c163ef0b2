"""The network bin by bin, compiled: the equations of `Network`, and the slopes that learning needs.

All weights of a network lie in one column, W by inputs and then u: W_ik at i·H + k, u_k at N·H + k.
Its memory holds v, z and j, H rows each; its state is V. Without a hidden layer H is 0, and the
weights are u (N,).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from agents.model import Arrays, Response
from agents.neurons.neuron import input_current
from agents.simd import like, load, power, store, where
from gnm_env.compiled import compiled, inlined
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


def largest_ratio(h: float) -> float:
    """v/ϑ_B at which (v/ϑ_B)^h reaches LARGEST_POWER."""
    return float(LARGEST_POWER ** (1.0 / h))


@compiled
def advance(
    p: NetworkParams,
    static: tuple[int, int, int],
    arrays: Arrays,
    state: State,
    channels: Any,
    first: int,
    last: int,
    row: int,
) -> tuple[State, Response]:
    """One bin, in which channels[first:last] spike. Notes H'(v_k) and j_k from `row` on."""
    zero = like(0.0, state.V)
    if static[1] == 0:
        I = input_current(arrays.weights, channels, first, last, zero)
    else:
        I = _hidden_step(p, static, arrays, channels, first, last, row, zero)
    D = p.alpha * state.V
    V = state.V + I - D
    return State(V), Response(V, D, zero, V, p.theta_r <= V, rising(p.theta_r, V, state.V))


@compiled
def _hidden_step(
    p: NetworkParams,
    static: tuple[int, int, int],
    arrays: Arrays,
    channels: Any,
    first: int,
    last: int,
    row: int,
    zero: Any,
) -> Any:
    """The hidden layer in one bin; returns the readout's input, Σ_k u_k j_k."""
    weights, memory, notes = arrays
    H = static[1]
    total = zero
    for k in range(H):
        total = total + load(memory, H + k, zero)
    for k in range(H):
        v, z = load(memory, k, zero), load(memory, H + k, zero)
        store(memory, k, v - p.alpha * v - p.inhibition * (total - z))
    for e in range(first, last):
        W = channels[e] * H
        for k in range(H):
            store(memory, k, load(memory, k, zero) + load(weights, W + k, zero))
    I = zero
    for k in range(H):
        z, slope = hill(p, static, load(memory, k, zero))
        j = load(memory, 2 * H + k, zero)
        j = j - p.kappa * j + z
        store(memory, H + k, z)
        store(memory, 2 * H + k, j)
        store(notes, row + k, slope)
        store(notes, row + H + k, j)
        I = I + load(weights, static[0] * H + k, zero) * j
    return I


@inlined
def hill(p: NetworkParams, static: tuple[int, int, int], v: Any) -> tuple[Any, Any]:
    """z = H(v) and its derivative H'(v); both are 0 for v <= 0.

    With q = (v/ϑ_B)^h: H = q / (1 + q), H' = h q / (v (1 + q)²).
    """
    # Clamped, so that no power overflows. NaN passes, so that learning notices and refuses it.
    r = v / p.theta_b
    r = where(r < 0.0, 0.0, where(r > p.largest, p.largest, r))
    cube = r * r * r if static[2] == 1 else where(r > 0.0, power(r, p.h - 1.0), 0.0)
    q = cube * r
    s = 1.0 / (1.0 + q)
    return q * s, p.h / p.theta_b * cube * (s * s)
