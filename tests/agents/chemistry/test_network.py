"""Which neurons can be read as chemistry."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from agents import GNM, AggregateLabel, NeuronAgent
from agents.chemistry import ReactionNetwork, sbml
from agents.chemistry.extra import optional
from agents.continuous import ContinuousAgent, ContinuousGNM


def make(**neuron: float) -> ContinuousAgent:
    return ContinuousAgent(ContinuousGNM(**neuron), AggregateLabel(), 10, weight_bounds=None)


def test_the_network_has_the_rates_of_the_neuron() -> None:
    agent = make(alpha=0.2, theta_r=1.5)
    network = ReactionNetwork.from_agent(agent)
    assert (network.alpha, network.conversion, network.theta_r) == (0.2, 10.0, 1.5)
    assert np.array_equal(network.weights, agent.weights)
    agent.weights = 0.0
    assert network.weights.any(), "the network must not change with the agent"


@pytest.mark.parametrize("weight", [-0.01, 1.01, math.nan])
def test_weights_outside_0_and_1_are_refused(weight: float) -> None:
    agent = make()
    agent.weights[7] = weight
    with pytest.raises(ValueError, match=r"weights must lie in 0 … 1 for chemistry.*channel 7"):
        ReactionNetwork.from_agent(agent)


def test_other_neurons_are_refused() -> None:
    with pytest.raises(ValueError, match=r"eta = 0, got eta = 0\.5"):
        ReactionNetwork.from_agent(make(eta=0.5))
    with pytest.raises(ValueError, match="continuous time"):
        ReactionNetwork.from_agent(NeuronAgent(GNM(), AggregateLabel(), 10))


@pytest.mark.parametrize("name", ["alpha", "conversion", "theta_r"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.inf])
def test_rates_must_be_positive(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} must be"):
        ReactionNetwork(np.ones(3), **{name: value})


def test_a_missing_package_is_named_with_the_extra_that_brings_it() -> None:
    with pytest.raises(ImportError, match=r'needs no_such_engine.*"gnm-env\[chemistry\]"'):
        optional("no_such_engine")


def test_importing_the_agents_loads_no_chemistry() -> None:
    code = (
        "import sys, agents, agents.chemistry\n"
        "print([m for m in ('roadrunner', 'antimony', 'libsbml') if m in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"


def test_molecules_are_at_least_one() -> None:
    pytest.importorskip("libsbml")
    with pytest.raises(ValueError, match="molecules must be >= 1, got 0"):
        sbml(ReactionNetwork(np.ones(3)), molecules=0)
