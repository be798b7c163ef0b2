"""The neurons and the learning rules once more, in plain Python, from the equations.

Written for the tests and sharing no code with the package: explicit sums over the whole history
instead of running ones, powers instead of repeated squaring, forward instead of backward in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Trace(NamedTuple):
    """Variables of a neuron, (T,) each."""

    V: Floats
    D: Floats
    R: Floats
    spikes: NDArray[np.bool_]


def drives(raster: NDArray[Any], weights: ArrayLike) -> list[float]:
    """I(t), summed from 0.0 over ascending channels."""
    w = np.asarray(weights, np.float64)
    result = []
    for row in raster:
        total = 0.0
        for i in np.flatnonzero(row):
            total += float(w[i])
        result.append(total)
    return result


def crossings(X: ArrayLike, threshold: float) -> NDArray[np.bool_]:
    """X(t) >= ϑ and X(t−1) < ϑ, with X = 0 before the first bin."""
    x = np.asarray(X)
    return (x >= threshold) & (np.concatenate([[0.0], x[:-1]]) < threshold)


def hill(v: float, theta: float, h: float) -> float:
    """v^h / (ϑ^h + v^h)."""
    if v <= 0.0:
        return 0.0
    if math.isinf(h):
        return 0.5 if v == theta else float(v > theta)
    exponent = h * math.log(theta / v)
    return 0.0 if exponent > 700.0 else 1.0 / (1.0 + math.exp(exponent))


def gnm(
    drive: Sequence[float],
    *,
    alpha: float,
    eta: float,
    beta: float,
    gamma: float,
    zeta: float,
    theta_b: float,
    theta_r: float,
    h: float,
    readout: str,
) -> Trace:
    """Equation 1 of the paper, bin by bin, everything on the right taken at t−1."""
    V, D, R = [0.0], [0.0], [0.0]
    for I in drive:
        d = eta * gamma * R[-1] * V[-1] + (1 - eta) * alpha * V[-1]
        r = R[-1] + zeta * hill(V[-1], theta_b, h) - beta * R[-1]
        V.append(V[-1] + I - d)
        D.append(d)
        R.append(r)
    X = V if readout == "V" else D
    return Trace(np.array(V[1:]), np.array(D[1:]), np.array(R[1:]), crossings(X[1:], theta_r))


def lif(drive: Sequence[float], *, alpha: float, refractory: int, theta: float) -> Trace:
    """V is the value before the reset; R the bins left whose input is ignored."""
    V, D, R, spikes = [], [], [], []
    v, last_spike = 0.0, -math.inf
    for t, I in enumerate(drive):
        ignored = t - last_spike <= refractory
        D.append(alpha * v)
        R.append(max(0.0, refractory - (t - last_spike - 1)))
        v = (1 - alpha) * v + (0.0 if ignored else I)
        V.append(v)
        spikes.append(v >= theta)
        if v >= theta:
            v, last_spike = 0.0, t
    return Trace(np.array(V), np.array(D), np.array(R), np.array(spikes))


def mst_kernel(lags: ArrayLike, tau_m: float, tau_s: float) -> Floats:
    """The response to one unit spike, so many bins later; 0 before it."""
    s = np.asarray(lags, np.float64)
    k = tau_m / tau_s
    v_norm = k ** (k / (k - 1)) / (k - 1)
    late = np.maximum(s, 0.0)
    return np.where(s < 0, 0.0, v_norm * (np.exp(-late / tau_m) - np.exp(-late / tau_s)))


def mst(
    raster: NDArray[Any], weights: ArrayLike, *, tau_m: float, tau_s: float, theta: float
) -> Trace:
    """The double sum over all input spikes and all earlier output spikes, in every bin anew."""
    w = np.asarray(weights, np.float64)
    times, channels = np.nonzero(raster)
    V, D, own = [], [], []
    for t in range(len(raster)):
        heard = times <= t
        response = w[channels[heard]] * mst_kernel(t - times[heard], tau_m, tau_s)
        D.append(theta * sum(math.exp(-(t - s) / tau_m) for s in own))
        V.append(float(np.sum(response)) - D[-1])
        if V[-1] >= theta and (t == 0 or V[-2] < theta):
            own.append(t)
    spikes = np.isin(np.arange(len(raster)), own)
    return Trace(np.array(V), np.array(D), np.array(D) / theta, spikes)


def decay_kernel(decay: float, n_bins: int) -> Floats:
    """decay^lag for lags 0 … n_bins − 1, with 0^0 = 1."""
    return np.array([decay**lag if lag else 1.0 for lag in range(n_bins)])


def presynaptic_traces(raster: NDArray[Any], kernel: Floats) -> Floats:
    """x_i(t): every channel convolved with the response to one spike, (T, N)."""
    n_bins = len(raster)
    columns = [np.convolve(channel, kernel[:n_bins])[:n_bins] for channel in raster.T.astype(float)]
    return np.stack(columns, axis=1)


def eligibilities(raster: NDArray[Any], kernel: Floats, signal: ArrayLike) -> Floats:
    """ε_i = Σ_t x_i(t) y(t), (N,)."""
    x = presynaptic_traces(raster, kernel)
    y = np.asarray(signal, np.float64)
    return np.array([sum(x[t, i] * y[t] for t in range(len(y))) for i in range(x.shape[1])])


def error_trace(
    spikes: NDArray[np.bool_],
    above: NDArray[np.bool_],
    onsets: Sequence[int],
    owed: Sequence[int],
    pattern_bins: int,
) -> Floats:
    """E(t): what is missing in each occurrence, −1 in noise at or above the threshold."""
    E = np.where(above, -1.0, 0.0)
    for onset, target in zip(onsets, owed, strict=True):
        part = slice(onset, onset + pattern_bins)
        E[part] = target - int(spikes[part].sum())
    return E


def top(eligibility: Floats, k: int) -> NDArray[np.bool_]:
    """The inputs whose ε lies strictly above the (k+1)-th largest; all of them for k >= N."""
    if k >= len(eligibility):
        return np.ones(len(eligibility), np.bool_)
    return eligibility > sorted(eligibility, reverse=True)[k]
