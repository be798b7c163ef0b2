"""The neurons once more, from their definitions: what the rules' second opinion is built on.

Nothing here is imported from the package. Sums run over the whole history in every bin anew, so a
trial of T bins costs O(T²) for the multi-spike tempotron.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class GNM:
    """Generalised neuron model; fields as in the package."""

    alpha: float = 0.3
    eta: float = 0.0
    beta: float = 0.3
    gamma: float = 1.0
    zeta: float = 1.0
    theta_b: float = 1.0
    theta_r: float = 1.0
    h: float = 200.0
    readout: str = "V"

    @property
    def threshold(self) -> float:
        return self.theta_r

    @property
    def lag(self) -> int:
        """How many bins the readout is behind the potential that it shows."""
        return int(self.readout == "D")

    @property
    def decay(self) -> float:
        """Decay factor per bin of the neuron's linear response."""
        return 1.0 - (1.0 - self.eta) * self.alpha


@dataclass(frozen=True)
class LIF:
    """Leaky integrate-and-fire neuron; fields as in the package."""

    alpha: float = 0.3
    refractory: int = 0
    theta: float = 1.0

    lag = 0

    @property
    def threshold(self) -> float:
        return self.theta

    @property
    def decay(self) -> float:
        return 1.0 - self.alpha


@dataclass(frozen=True)
class MST:
    """Multi-spike tempotron; fields as in the package."""

    tau_m: float = 20.0
    tau_s: float = 5.0
    theta: float = 1.0

    lag = 0

    @property
    def threshold(self) -> float:
        return self.theta

    @property
    def decay(self) -> float:
        """Decay factor per bin of the membrane: the slower of its two."""
        return math.exp(-1.0 / self.tau_m)


Spec = GNM | LIF | MST


def spec(neuron: Any) -> Spec:
    """The description of a neuron of the package, taken from its name and fields."""
    kinds: dict[str, type[Spec]] = {"gnm": GNM, "lif": LIF, "mst": MST}
    kind = kinds[neuron.name]
    return kind(**{field.name: getattr(neuron, field.name) for field in fields(kind)})


class Response(NamedTuple):
    """What a neuron did in one trial, (T,) each."""

    V: Floats
    """Membrane potential, before the reset of a LIF."""
    X: Floats
    """Readout, compared with the threshold."""
    U: Floats
    """Potential as it would be without any reset; for a LIF and at η > 0 that of the inputs."""
    spikes: Bools
    above: Bools
    """Whether the readout is at or above the threshold."""

    @property
    def times(self) -> list[int]:
        """Bins of the output spikes, ascending."""
        return [int(t) for t in np.flatnonzero(self.spikes)]


def input_current(raster: NDArray[Any], weights: ArrayLike) -> list[float]:
    """I(t), summed from 0.0 over ascending channels."""
    w = np.asarray(weights, np.float64)
    current = []
    for row in raster:
        total = 0.0
        for i in np.flatnonzero(row):
            total += float(w[i])
        current.append(total)
    return current


def kernel(neuron: Spec, n_bins: int) -> Floats:
    """Linear response to one unit input spike, 0 … n_bins − 1 bins later."""
    if isinstance(neuron, MST):
        return biexponential(neuron.tau_m, neuron.tau_s, n_bins)
    return exponential(neuron.decay, n_bins)


def exponential(decay: float, n_bins: int) -> Floats:
    """decay^lag for lags 0 … n_bins − 1, with 0^0 = 1."""
    return np.array([1.0 if lag == 0 else decay**lag for lag in range(n_bins)])


def biexponential(slow: float, fast: float, n_bins: int) -> Floats:
    """V_norm·(e^(−t/slow) − e^(−t/fast)); V_norm makes the maximum over real t equal to 1."""
    k = slow / fast
    scale = k ** (k / (k - 1.0)) / (k - 1.0)
    return np.array([scale * (math.exp(-t / slow) - math.exp(-t / fast)) for t in range(n_bins)])


def traces(raster: NDArray[Any], response: ArrayLike) -> Floats:
    """Presynaptic traces x_i(t): each input spike adds the response from its own bin on, (T, N)."""
    n_bins = len(raster)
    x = np.zeros(raster.shape)
    for s, i in zip(*np.nonzero(raster), strict=True):
        x[s:, i] += np.asarray(response)[: n_bins - s]
    return x


def hear(neuron: Spec, raster: NDArray[Any], weights: ArrayLike) -> Response:
    """What a neuron does with a raster (T, N) of input spikes."""
    if isinstance(neuron, GNM):
        return _gnm(neuron, raster, weights)
    if isinstance(neuron, LIF):
        return _lif(neuron, raster, weights)
    return _mst(neuron, raster, weights)


def _hill(v: float, theta: float, h: float) -> float:
    """v^h / (ϑ^h + v^h), 0 for v <= 0."""
    if v <= 0.0:
        return 0.0
    if math.isinf(h):
        return 0.5 if v == theta else float(v > theta)
    exponent = h * math.log(theta / v)
    return 0.0 if exponent > 700.0 else 1.0 / (1.0 + math.exp(exponent))


def _gnm(p: GNM, raster: NDArray[Any], weights: ArrayLike) -> Response:
    v = d = r = 0.0
    V, D = [], []
    for current in input_current(raster, weights):
        d = p.eta * p.gamma * r * v + (1.0 - p.eta) * p.alpha * v
        r = r + p.zeta * _hill(v, p.theta_b, p.h) - p.beta * r
        v = v + current - d
        V.append(v)
        D.append(d)
    X = np.array(V if p.readout == "V" else D)
    return Response(np.array(V), X, _unreset(p, raster, weights), *_crossings(X, p.theta_r))


def _lif(p: LIF, raster: NDArray[Any], weights: ArrayLike) -> Response:
    v, last, V, spikes = 0.0, -math.inf, [], []
    for t, current in enumerate(input_current(raster, weights)):
        ignored = t - last <= p.refractory
        v = (1.0 - p.alpha) * v + (0.0 if ignored else current)
        V.append(v)
        spikes.append(v >= p.theta)
        if v >= p.theta:
            v, last = 0.0, t
    heard = np.array(V)
    spiking = np.array(spikes, np.bool_)
    return Response(heard, heard, _unreset(p, raster, weights), spiking, spiking)


def _mst(p: MST, raster: NDArray[Any], weights: ArrayLike) -> Response:
    U = _unreset(p, raster, weights)
    V: list[float] = []
    own: list[int] = []
    for t in range(len(raster)):
        V.append(U[t] - p.theta * sum(math.exp(-(t - s) / p.tau_m) for s in own))
        if V[t] >= p.theta and (t == 0 or V[t - 1] < p.theta):
            own.append(t)
    X = np.array(V)
    return Response(X, X, U, *_crossings(X, p.theta))


def _unreset(neuron: Spec, raster: NDArray[Any], weights: ArrayLike) -> Floats:
    """U(t) = Σ_i w_i x_i(t): the double sum over all inputs so far, in every bin anew."""
    current = np.array(input_current(raster, weights))
    response = kernel(neuron, len(raster))
    return np.array([np.dot(current[: t + 1], response[t::-1]) for t in range(len(raster))])


def _crossings(X: Floats, threshold: float) -> tuple[Bools, Bools]:
    """Spikes, where X comes up to the threshold from below (0 before the first bin); and above."""
    above = X >= threshold
    before = np.concatenate([[0.0], X[:-1]]) >= threshold
    return above & ~before, above
