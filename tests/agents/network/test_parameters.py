"""What a network and its rule refuse, and with what words."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents import ErrorTrace
from agents.network import BackPropagation, Network, NetworkAgent


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("hidden", 0, "hidden must be in 1 … 10000, got 0; .* NeuronAgent with ErrorTrace"),
        ("hidden", -3, "hidden must be in 1 … 10000, got -3"),
        ("hidden", 10**9, "hidden must be in 1 … 10000, got 1000000000"),
        ("hidden", 2.5, "hidden must be a whole number, got 2.5"),
        ("alpha", 1.1, "alpha must be in 0 … 1, got 1.1"),
        ("alpha", float("nan"), "alpha must be finite, got nan"),
        ("kappa", -0.1, "kappa must be in 0 … 1, got -0.1"),
        ("inhibition", -0.1, "inhibition must be >= 0, got -0.1"),
        ("theta_b", 0.0, "theta_b must be > 0, got 0.0"),
        ("theta_r", -1.0, "theta_r must be > 0, got -1.0"),
        ("h", 0.5, "h must be >= 1, got 0.5"),
        ("h", float("inf"), "h must be finite, got inf"),
    ],
)
def test_a_network_names_field_value_and_range(field: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Network(**{field: value})


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("learning_rate_hidden", -1.0, "learning_rate_hidden must be >= 0, got -1.0"),
        ("learning_rate_output", float("inf"), "learning_rate_output must be finite, got inf"),
        ("momentum", 1.2, "momentum must be in 0 … 1, got 1.2"),
        ("noise_error", "never", "noise_error must be one of 'above', 'spikes', got 'never'"),
        ("max_step", 0.0, "max_step must be > 0, got 0.0"),
        ("max_step", float("nan"), "max_step must be finite, got nan"),
        ("lift_above", 1, "lift_above must be True or False, got 1"),
    ],
)
def test_a_rule_names_field_value_and_range(field: str, value: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BackPropagation(**{field: value})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"network": 10}, "network must be one of Network, .*got 10"),
        ({"rule": ErrorTrace()}, "a Network learns by BackPropagation"),
        ({"n_inputs": 0}, "n_inputs must be >= 1, got 0"),
        ({"seed": -1}, "seed must be >= 0, got -1"),
        ({"initial_weight": float("nan")}, "initial_weight must be finite, got nan"),
        (
            {"network": Network(hidden=10_000), "n_inputs": 20_000},
            "at most 100,000,000 weights, got 200,010,000 for 20,000 inputs",
        ),
    ],
)
def test_an_agent_refuses_what_cannot_be(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        NetworkAgent(**arguments)


def test_whole_numbers_of_other_kinds_will_do_and_become_ints() -> None:
    assert type(Network(hidden=np.int32(3)).hidden) is int


@pytest.mark.parametrize(
    ("name", "value"),
    [("weights", np.ones(5)), ("hidden_weights", np.ones((3, 4))), ("output_weights", np.ones(4))],
)
def test_weights_of_another_shape_are_refused(name: str, value: Any) -> None:
    agent = NetworkAgent(Network(hidden=3), n_inputs=4)
    with pytest.raises(ValueError, match=f"{name} must have shape"):
        setattr(agent, name, value)


def test_weights_that_are_not_finite_are_refused_when_set_and_when_found() -> None:
    agent = NetworkAgent(Network(hidden=3), n_inputs=4)
    with pytest.raises(ValueError, match="weights must be finite"):
        agent.weights = np.nan
    agent.weights[2] = np.inf
    with pytest.raises(ValueError, match="weights must be finite"):
        agent.begin_trial()


def test_initial_weights_are_those_of_the_protocol() -> None:
    """default_rng((seed, 2)), W by inputs and then u, uniform on [0, 0.3)."""
    agent = NetworkAgent(Network(hidden=3), n_inputs=4, seed=5)
    drawn = 0.3 * np.random.default_rng((5, 2)).random(15)
    assert np.array_equal(agent.hidden_weights.ravel(), drawn[:12])
    assert np.array_equal(agent.output_weights, drawn[12:])
    half = NetworkAgent(Network(hidden=3), n_inputs=4, seed=5, initial_weight=0.15)
    np.testing.assert_allclose(half.weights, drawn / 2)
