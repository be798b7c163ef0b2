"""The linear neuron of two stages, and the rule that follows the network's gradient."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from agents import NeuronAgent, check_neuron, check_rule, record, train_many
from agents.experiments.two_stage import GradientOfError, TwoStage
from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Task, Trial
from tests.agents.worlds import BUSY, BUSY_PATTERNS


def test_its_potential_is_two_leaky_stages_in_series_with_a_largest_response_of_one() -> None:
    task, rng = Task(n_inputs=1), np.random.default_rng(0)
    spikes = (rng.random(200) < 0.1).astype(np.int8)
    neuron = TwoStage(alpha=0.15, alpha_2=0.4)
    agent = NeuronAgent(neuron, GradientOfError(), 1, weight_bounds=None)
    agent.weights = 0.3
    heard = record(agent, Trial.from_dense(spikes[:, None], [], [], task))
    # Two filters of SciPy's in series; the second hears the first a bin later.
    series = lfilter([0.0, 1.0], [1.0, -0.6], lfilter([1.0], [1.0, -0.85], spikes.astype(float)))
    single = lfilter([0.0, 1.0], [1.0, -0.6], lfilter([1.0], [1.0, -0.85], np.eye(1, 200)[0]))
    np.testing.assert_allclose(heard.V, 0.3 * series / single.max(), atol=1e-12)


def test_neuron_and_rule_pass_the_checks_of_the_package() -> None:
    check_neuron(TwoStage())
    check_rule(GradientOfError())


@pytest.mark.parametrize("bad", [{"alpha": 0.4}, {"alpha": 0.5, "alpha_2": 0.3}])
def test_the_faster_stage_must_be_the_faster(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="alpha_2, the decay of the faster stage, must be above"):
        TwoStage(**bad)


def test_the_rule_is_backpropagation_without_a_hidden_layer() -> None:
    from agents import GNM

    neuron = NeuronAgent(GNM(alpha=0.3), GradientOfError(1e-4), 12, weight_bounds=None)
    rule = BackPropagation(learning_rate_output=1e-4, learning_rate_hidden=1e-4)
    network = NetworkAgent(Network(hidden=None, alpha=0.3), rule, 12)
    network.weights = neuron.weights
    for agent in (neuron, network):
        train_many([agent], BUSY, BUSY_PATTERNS, 30, seed=3)
    np.testing.assert_allclose(neuron.weights, network.weights, rtol=1e-9)
