"""BP: the exact gradient of J = Σ_t E(t) V(t), with E(t) by the rule's settings and held fixed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents import GNM, ErrorTrace, NeuronAgent, WeightOverflow, train, train_many
from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Task, Trial, draw_trial
from tests.agents.network.reference import error_trace, forward, gradient_learner, slope
from tests.agents.network.test_dynamics import NETWORKS
from tests.agents.reference import crossings
from tests.agents.worlds import BUSY, BUSY_PATTERNS, play, trial_env

EXACT = {"lift_above": True}
"""The error trace as error-trace learning has it."""

RULES: dict[str, dict[str, Any]] = {
    "default": {},
    "as ET": EXACT,
    "spikes": {"noise_error": "spikes", "lift_above": True},
    "spikes, below": {"noise_error": "spikes"},
}


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("name", NETWORKS)
def test_a_learning_step_is_the_slope_of_the_objective(name: str, rule: str) -> None:
    network, checked = NETWORKS[name], 0
    rng = np.random.default_rng(5)
    for seed in range(2):
        agent = gradient_learner(network, BUSY.n_inputs, seed, **RULES[rule])
        weights = agent.weights.copy()
        trial = draw_trial(BUSY, BUSY_PATTERNS, rng)
        V = agent.record(trial).V
        E = error_trace(agent.rule, network.theta_r, V, trial)
        expected = slope(network, trial.dense(), weights, E)
        if network.h == 60.0 and np.abs(expected).max() > 1e3:
            continue  # so steep that finite differences do not resolve it
        play(agent, trial)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(agent.velocity, expected, rtol=1e-5, atol=1e-7 * scale + 1e-9)
        assert np.array_equal(agent.weights, weights + agent.velocity)
        checked += scale > 0
    assert checked > 0, "the trials should teach something"


@pytest.mark.parametrize("rule", RULES)
def test_the_two_settings_of_the_error_trace_make_a_difference(rule: str) -> None:
    """Where V stays above threshold over noise and over a pattern that is owed spikes."""
    agent = gradient_learner(Network(hidden=2), BUSY.n_inputs, **RULES[rule])
    agent.weights = 2.0
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1))
    V = agent.record(trial).V
    traces = {
        name: error_trace(BackPropagation(**keywords), 1.0, V, trial)
        for name, keywords in RULES.items()
    }
    assert len({trace.tobytes() for trace in traces.values()}) == len(RULES)
    expected = slope(agent.network, trial.dense(), agent.weights, traces[rule])
    play(agent, trial)
    np.testing.assert_allclose(agent.velocity, expected, rtol=1e-5, atol=1e-7)


def test_the_gradient_runs_through_the_inhibition() -> None:
    """A neuron without an output weight still learns, since it holds down another."""
    agent = gradient_learner(Network(hidden=2, inhibition=0.3), 1, **EXACT)
    agent.hidden_weights, agent.output_weights = 0.8, [1.0, 0.0]
    task = Task(n_inputs=1, pattern_bins=6)
    play(agent, Trial.from_dense(np.ones((8, 1)), [0], [0], task))
    change = agent.velocity[:2]
    assert change[0] * change[1] < 0


@pytest.mark.parametrize("momentum", [0.0, 0.2, 0.9])
def test_without_a_hidden_layer_it_is_error_trace_learning_to_the_last_bit(momentum: float) -> None:
    rule = BackPropagation(
        learning_rate_output=2e-3, momentum=momentum, lift_above=True, max_step=np.inf
    )
    network = NetworkAgent(Network(hidden=None, alpha=0.25), rule, BUSY.n_inputs, 3)
    neuron = NeuronAgent(
        GNM(alpha=0.25), ErrorTrace(2e-3, momentum=momentum), BUSY.n_inputs, weight_bounds=None
    )
    neuron.weights = network.weights
    train_many([network], BUSY, BUSY_PATTERNS, 400, seed=2)
    train_many([neuron], BUSY, BUSY_PATTERNS, 400, seed=2)
    assert np.array_equal(network.weights, neuron.weights)
    assert np.array_equal(network.velocity, neuron.velocity)
    assert np.abs(network.velocity).max() > 0


def test_each_layer_has_its_own_learning_rate() -> None:
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1))
    plain = gradient_learner(Network(hidden=3), BUSY.n_inputs)
    rule = BackPropagation(0.5, 0.25, max_step=np.inf)
    agent = NetworkAgent(Network(hidden=3), rule, BUSY.n_inputs)
    agent.weights = plain.weights
    play(plain, trial)
    play(agent, trial)
    split = 3 * BUSY.n_inputs
    np.testing.assert_allclose(agent.velocity[:split], 0.5 * plain.velocity[:split])
    np.testing.assert_allclose(agent.velocity[split:], 0.25 * plain.velocity[split:])
    assert (np.abs(plain.velocity) > 0).any()


def test_a_step_adds_a_fraction_of_the_step_before_it() -> None:
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1))
    agent = gradient_learner(Network(hidden=3), BUSY.n_inputs, momentum=0.4)
    fresh = gradient_learner(Network(hidden=3), BUSY.n_inputs)
    agent.velocity[:] = before = np.random.default_rng(0).normal(size=len(agent.weights))
    play(agent, trial)
    play(fresh, trial)
    np.testing.assert_allclose(agent.velocity, fresh.velocity + 0.4 * before, rtol=1e-12)


@pytest.mark.parametrize("fraction", [0.999, 1.001, 1e-3])
def test_a_step_longer_than_allowed_keeps_its_direction_and_gets_the_allowed_length(
    fraction: float,
) -> None:
    trial = draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1))
    free = gradient_learner(Network(hidden=3), BUSY.n_inputs)
    play(free, trial)
    length = np.linalg.norm(free.velocity)
    held = gradient_learner(Network(hidden=3), BUSY.n_inputs, max_step=fraction * length)
    play(held, trial)
    assert np.linalg.norm(held.velocity) == pytest.approx(min(fraction, 1.0) * length)
    np.testing.assert_allclose(held.velocity, min(fraction, 1.0) * free.velocity, rtol=1e-12)


def test_a_step_is_shortened_before_momentum_is_added_and_however_long_it_is() -> None:
    agent = NetworkAgent(
        Network(hidden=3), BackPropagation(1e200, 1e200, max_step=0.1), BUSY.n_inputs
    )
    agent.velocity[:] = before = np.random.default_rng(0).normal(size=len(agent.weights))
    agent.weights = 2.0
    play(agent, draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1)))
    assert np.linalg.norm(agent.velocity - 0.2 * before) == pytest.approx(0.1)
    assert not agent.overflowed


def test_a_trial_without_error_changes_nothing_momentum_included() -> None:
    agent = NetworkAgent(n_inputs=BUSY.n_inputs, initial_weight=0.0)
    agent.velocity[:] = 1.0
    weights = agent.weights.copy()
    raster = np.zeros((20, BUSY.n_inputs))
    play(agent, Trial.from_dense(raster, [], [], BUSY))
    assert np.array_equal(agent.weights, weights)
    assert (agent.velocity == 1.0).all()


def test_a_pattern_that_ends_the_trial_is_counted() -> None:
    """A user's own trial may end so; one that the package draws never does."""
    rng = np.random.default_rng(1)
    raster = rng.random((3 * BUSY.pattern_bins, BUSY.n_inputs)) < 0.1
    onsets = [0, BUSY.pattern_bins, 2 * BUSY.pattern_bins]
    trial = Trial.from_dense(raster, onsets, [1, 0, 1], BUSY)
    agent = gradient_learner(Network(hidden=3), BUSY.n_inputs, 1, **EXACT)
    agent.output_weights = 0.5
    layers = forward(agent.network, raster, agent.hidden_weights, agent.output_weights)
    E = error_trace(agent.rule, 1.0, layers.V, trial)
    assert E[-1] != 0
    assert crossings(layers.V, 1.0)[onsets[-1] :].any(), "the last occurrence should have a spike"
    expected = slope(agent.network, raster, agent.weights, E)
    play(agent, trial)
    np.testing.assert_allclose(agent.velocity, expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("loop", ["train", "train_many"])
def test_a_weight_that_would_overflow_ends_learning_and_nothing_is_lost(loop: str) -> None:
    rule = BackPropagation(1e200, 1e200, max_step=np.inf)
    agent = NetworkAgent(Network(hidden=3), rule, BUSY.n_inputs)
    with pytest.warns(WeightOverflow, match="would have overflowed"):
        if loop == "train":
            history = train(agent, trial_env(), 50, seed=1, block=10)
        else:
            history = train_many([agent], BUSY, BUSY_PATTERNS, 50, seed=1, block=10).of(0)
    assert agent.overflowed
    assert np.isfinite(agent.weights).all()
    assert np.isfinite(agent.velocity).all()
    assert 0 <= history.overflowed < 50
    weights = agent.weights.copy()
    play(agent, draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(1)))
    assert np.array_equal(agent.weights, weights)
