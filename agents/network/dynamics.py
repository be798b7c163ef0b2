"""The network bin by bin, compiled: the equations of `Network`, and the slopes that learning needs.

All weights of a network lie in one row, W by inputs and then u: W_ik at i·H + k, u_k at N·H + k.
Its state lies in another: v, z and j, H numbers each, and V. Without a hidden layer H is 0, and the
rows are u (N,) and V alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.kernels import Heard
from agents.network.parameters import Network
from gnm_env.compiled import compiled

Row = NDArray[np.float64]
Table = NDArray[np.float64]

LARGEST_POWER = 1e16
"""Largest (v/ϑ_B)^h that is computed: from here on v^h / (ϑ_B^h + v^h) is 1 to within rounding."""


class Wiring(NamedTuple):
    """The parameters of a network as compiled code takes them; made by `wiring_at`."""

    n_inputs: int
    hidden: int
    alpha: float
    inhibition: float
    kappa: float
    theta_b: float
    h: float
    theta_r: float
    largest: float
    """v/ϑ_B beyond which the Hill function no longer changes."""


class Log(NamedTuple):
    """What a trial leaves for learning; T bins and what there is of room beyond."""

    V: Row
    slopes: Table
    """H'(v_k(t)), (T, H)."""
    currents: Table
    """j_k(t), (T, H)."""


def wiring_row(network: Network, n_inputs: int) -> tuple[float, ...]:
    """The numbers of a Wiring, in order; a group of networks keeps a row for each."""
    return (
        n_inputs,
        network.width,
        network.alpha,
        network.inhibition,
        network.kappa,
        network.theta_b,
        network.h,
        network.theta_r,
        largest_ratio(network.h),
    )


@compiled
def wiring_at(rows: Table, n: int) -> Wiring:
    """Row `n` as a Wiring."""
    row = rows[n]
    return Wiring(int(row[0]), int(row[1]), row[2], row[3], row[4], row[5], row[6], row[7], row[8])


def largest_ratio(h: float) -> float:
    """v/ϑ_B at which (v/ϑ_B)^h reaches LARGEST_POWER."""
    return float(LARGEST_POWER ** (1.0 / h))


def n_weights(network: Network, n_inputs: int) -> int:
    """Number of weights of a network: N·H + H, or N without a hidden layer."""
    return (n_inputs + 1) * network.width or n_inputs


def n_state(hidden: int) -> int:
    """Length of the state of a network with so many hidden neurons."""
    return 3 * hidden + 1


@compiled
def new_log(bins: int, hidden: int) -> Log:
    """Room for trials of up to `bins` bins."""
    return Log(np.empty(bins), np.empty((bins, hidden)), np.empty((bins, hidden)))


@compiled
def step(
    wiring: Wiring,
    weights: Row,
    state: Row,
    slopes: Row,
    channels: NDArray[np.int32],
    first: int,
    last: int,
) -> float:
    """One bin, in which channels[first:last] spike. Moves `state` on; returns V.

    `slopes` (H,) receives H'(v_k).
    """
    H = wiring.hidden
    I = 0.0
    if H == 0:
        for e in range(first, last):
            I += weights[channels[e]]
    else:
        I = _hidden_step(wiring, weights, state, slopes, channels, first, last)
    V = state[3 * H]
    V = V + I - wiring.alpha * V
    state[3 * H] = V
    return V


@compiled
def _hidden_step(
    wiring: Wiring,
    weights: Row,
    state: Row,
    slopes: Row,
    channels: NDArray[np.int32],
    first: int,
    last: int,
) -> float:
    """The hidden layer in one bin; returns the readout's input, Σ_k u_k j_k."""
    H = wiring.hidden
    v, z, j = state[:H], state[H : 2 * H], state[2 * H : 3 * H]
    total = 0.0
    for k in range(H):
        total += z[k]
    for k in range(H):
        v[k] = v[k] - wiring.alpha * v[k] - wiring.inhibition * (total - z[k])
    for e in range(first, last):
        W = weights[channels[e] * H : (channels[e] + 1) * H]
        for k in range(H):
            v[k] += W[k]
    hill(wiring, v, z, slopes)
    u = weights[wiring.n_inputs * H :]
    I = 0.0
    for k in range(H):
        j[k] = j[k] - wiring.kappa * j[k] + z[k]
        I += u[k] * j[k]
    return I


@compiled
def hill(wiring: Wiring, v: Row, z: Row, slopes: Row) -> None:
    """z = H(v) and its derivative H'(v), in place; both are 0 for v <= 0.

    With p = (v/ϑ_B)^h: H = p / (1 + p), H' = h p / (v (1 + p)²).
    """
    scale = wiring.h / wiring.theta_b
    for k in range(len(v)):
        # Clamped, so that no power overflows. NaN passes, so that learning notices and refuses it.
        r = v[k] / wiring.theta_b
        r = 0.0 if r < 0.0 else (wiring.largest if r > wiring.largest else r)
        if wiring.h == 4.0:
            cube = r * r * r
            p = cube * r
        else:
            cube = r ** (wiring.h - 1.0) if r > 0.0 else 0.0
            p = cube * r
        s = 1.0 / (1.0 + p)
        z[k] = p * s
        slopes[k] = scale * cube * (s * s)


@compiled
def run_trial(wiring: Wiring, weights: Row, heard: Heard, state: Row, log: Log) -> None:
    """A whole trial, from rest. Fills `log`; `state` is for use in between."""
    H = wiring.hidden
    state[:] = 0.0
    for t in range(len(heard.offsets) - 1):
        log.V[t] = step(
            wiring,
            weights,
            state,
            log.slopes[t],
            heard.channels,
            heard.offsets[t],
            heard.offsets[t + 1],
        )
        for k in range(H):
            log.currents[t, k] = state[2 * H + k]
