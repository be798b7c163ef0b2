"""The network's variables: a trace worked out by hand, and sums over the whole history."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from agents import record
from agents.network import Network, NetworkAgent, NetworkRecording
from gnm_env import Task, Trial
from tests.agents.network.reference import forward

NETWORKS = {
    "default": Network(hidden=4),
    "one neuron": Network(hidden=1),
    "no inhibition": Network(hidden=3, inhibition=0.0),
    "all differ": Network(5, 0.2, 0.4, 0.35, 0.7, 2.7, 0.6),
    "h = 1": Network(hidden=3, h=1.0),
    "steep": Network(hidden=3, h=60.0),
    "no memory": Network(hidden=3, alpha=1.0, kappa=1.0),
    "no decay": Network(hidden=3, alpha=0.0, kappa=0.0, inhibition=0.01),
}


def recorded(agent: NetworkAgent, raster: NDArray[Any]) -> NetworkRecording:
    recording = record(agent, Trial.from_dense(raster, [], [], Task(n_inputs=raster.shape[1])))
    assert isinstance(recording, NetworkRecording)
    return recording


def test_three_bins_worked_out_by_hand() -> None:
    """α = κ = 1/2, c = 1/4, h = 4, W = (1, 3), u = (2, 4); input spikes in bins 0 and 2."""
    agent = NetworkAgent(Network(2, alpha=0.5, inhibition=0.25, kappa=0.5), n_inputs=1)
    agent.hidden_weights, agent.output_weights = [[1.0, 3.0]], [2.0, 4.0]
    heard = recorded(agent, np.array([[1], [0], [1]]))

    def H(v: Fraction) -> Fraction:
        return v**4 / (1 + v**4)

    half = Fraction(1, 2)
    assert (H(Fraction(1)), H(Fraction(3))) == (half, Fraction(81, 82))
    v1 = (half - Fraction(81, 328), Fraction(3, 2) - Fraction(1, 8))
    assert v1 == (Fraction(83, 328), Fraction(11, 8))
    z1 = (H(v1[0]), H(v1[1]))
    v2 = (v1[0] / 2 - z1[1] / 4 + 1, v1[1] / 2 - z1[0] / 4 + 3)
    z2 = (H(v2[0]), H(v2[1]))
    j0 = (half, Fraction(81, 82))
    j1 = (j0[0] / 2 + z1[0], j0[1] / 2 + z1[1])
    j2 = (j1[0] / 2 + z2[0], j1[1] / 2 + z2[1])
    V0 = 1 + Fraction(4 * 81, 82)
    V1 = V0 / 2 + 2 * j1[0] + 4 * j1[1]
    V2 = V1 / 2 + 2 * j2[0] + 4 * j2[1]
    for found, expected in (
        (heard.v, [(1, 3), v1, v2]),
        (heard.z, [j0, z1, z2]),
        (heard.j, [j0, j1, j2]),
        (heard.V[:, None], [(V0,), (V1,), (V2,)]),
        (heard.D[:, None], [(0,), (V0 / 2,), (V1 / 2,)]),
    ):
        np.testing.assert_allclose(found, np.array(expected, float), rtol=1e-14)
    assert heard.spikes.tolist() == [True, False, False]


@pytest.mark.parametrize("name", NETWORKS)
def test_variables_are_the_sums_over_the_whole_history(name: str) -> None:
    network = NETWORKS[name]
    rng = np.random.default_rng(3)
    agent = NetworkAgent(network, n_inputs=6)
    agent.weights = rng.normal(0.3, 0.6, len(agent.weights))
    raster = rng.random((40, 6)) < 0.2
    found = recorded(agent, raster)
    expected = forward(network, raster, agent.hidden_weights, agent.output_weights)
    for variable in ("v", "z", "j", "V"):
        np.testing.assert_allclose(
            getattr(found, variable), getattr(expected, variable), rtol=1e-9, atol=1e-12
        )
    above = network.theta_r <= found.V
    assert np.array_equal(found.spikes, above & ~np.append(False, above[:-1]))
    assert 0.001 < found.z.mean() < 0.999, "hidden neurons should be neither dead nor saturated"


def test_outputs_of_hidden_neurons_stay_within_0_and_1_whatever_the_potential() -> None:
    for h in (1.0, 4.0, 7.3, 300.0):
        agent = NetworkAgent(Network(hidden=4, h=h, inhibition=0.0), n_inputs=1)
        agent.hidden_weights = [[1e300, 1e-300, -1e300, 1.0]]
        z = recorded(agent, np.ones((2, 1))).z[0]
        np.testing.assert_allclose(z, [1.0, 0.0, 0.0, 0.5], atol=1e-15)


def test_without_a_hidden_layer_the_readout_hears_the_input_itself() -> None:
    agent = NetworkAgent(Network(hidden=None, alpha=0.4), n_inputs=5, seed=1)
    raster = np.random.default_rng(0).random((30, 5)) < 0.3
    V = recorded(agent, raster).V
    drive = raster @ agent.weights
    expected = [sum(0.6 ** (t - s) * drive[s] for s in range(t + 1)) for t in range(30)]
    np.testing.assert_allclose(V, expected, rtol=1e-12)
    assert agent.hidden_weights.size == 0
    assert np.array_equal(agent.output_weights, agent.weights)
