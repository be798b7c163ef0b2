"""The network once more, in plain Python, from its equations; shares no code with the package."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Trial
from tests.agents import reference

Floats = NDArray[np.float64]


@dataclass
class Layers:
    """Variables of a network in each bin: v, z, j (T, H) and V (T,)."""

    v: Floats
    z: Floats
    j: Floats
    V: Floats


def forward(network: Network, raster: NDArray[Any], W: Floats, u: Floats) -> Layers:
    """The equations bin by bin; potentials and currents as sums over the whole history."""
    n_bins, H = len(raster), W.shape[1]
    alpha, kappa, c = network.alpha, network.kappa, network.inhibition
    drive = np.zeros((n_bins, H))
    z = np.zeros((n_bins, H))
    for t in range(n_bins):
        for k in range(H):
            inhibition = sum(z[t - 1, other] for other in range(H) if other != k) if t else 0.0
            drive[t, k] = W[:, k] @ raster[t] - c * inhibition
            v = sum(reference.decay_kernel(1 - alpha, t + 1)[::-1] * drive[: t + 1, k])
            z[t, k] = reference.hill(v, network.theta_b, network.h)
    j = leaky(z, kappa)
    return Layers(leaky(drive, alpha), z, j, leaky(j @ u, alpha))


def leaky(drive: Floats, decay: float) -> Floats:
    """x(t) = Σ_s (1 − decay)^(t−s) drive(s), along the first axis."""
    kernel = reference.decay_kernel(1.0 - decay, len(drive))
    columns = [np.convolve(x, kernel)[: len(x)] for x in drive.reshape(len(drive), -1).T]
    return np.stack(columns, axis=1).reshape(drive.shape)


def error_trace(rule: BackPropagation, theta_r: float, V: Floats, trial: Trial) -> Floats:
    """E(t) by the rule's settings."""
    above = theta_r <= V
    spikes = reference.crossings(V, theta_r)
    blamed = above if rule.noise_error == "above" else spikes
    E = reference.error_trace(spikes, blamed, trial.onsets, trial.targets, trial.pattern_bins)
    return E if rule.lift_above else np.where((E > 0) & above, 0.0, E)


def objective(network: Network, raster: NDArray[Any], weights: Floats, E: Floats) -> float:
    """J = Σ_t E(t) V(t) for all weights in one row, W by inputs and then u."""
    n_inputs, H = raster.shape[1], network.width
    W, u = weights[: n_inputs * H].reshape(n_inputs, H), weights[n_inputs * H :]
    return float(E @ forward(network, raster, W, u).V)


def slope(network: Network, raster: NDArray[Any], weights: Floats, E: Floats) -> Floats:
    """∂J/∂w of every weight, by central differences."""
    result = np.empty_like(weights)
    for i in range(len(weights)):
        step = np.zeros_like(weights)
        step[i] = 1e-5
        ahead, behind = (objective(network, raster, weights + s, E) for s in (step, -step))
        result[i] = (ahead - behind) / 2e-5
    return result


def gradient_learner(network: Network, n_inputs: int, seed: int = 0, **rule: Any) -> NetworkAgent:
    """An agent whose weight change in its first learning step is ∂J/∂w itself."""
    settings = BackPropagation(1.0, 1.0, **{"max_step": np.inf, **rule})
    agent = NetworkAgent(network, settings, n_inputs, seed)
    rng = np.random.default_rng(seed)
    agent.weights = rng.normal(0.25, 0.6, len(agent.weights))
    return agent
