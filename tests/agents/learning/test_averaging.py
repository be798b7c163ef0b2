"""Weight averaging: the mean of the weights after the trials named, in every loop the same bits."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import (
    GNM,
    MST,
    AggregateLabel,
    ErrorTrace,
    NeuronAgent,
    load_checkpoint,
    registry,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.network import BackPropagation, Network, NetworkAgent
from tests.agents.worlds import BUSY, BUSY_PATTERNS, trial_env

FIRST, LAST, TRIALS = 11, 40, 60
RULE = ErrorTrace(learning_rate=0.02, modulate=True)


def agent_of(average_over: Any, lane: int = 0, rule: Rule = RULE) -> NeuronAgent:
    rate = rule.learning_rate * (1.0 + 0.1 * lane)
    learns = replace(rule, learning_rate=rate, average_over=average_over)  # type: ignore[type-var]
    return NeuronAgent(GNM(alpha=0.2 + 0.01 * lane), learns, 12, lane, 0.6, (-0.5, 0.6))


def trained(agent: Any, trials: int = TRIALS, seed: Any = 9) -> Any:
    train_many([agent], BUSY, BUSY_PATTERNS, trials, seed)
    return agent


def test_after_the_last_trial_the_weights_are_the_mean_of_those_after_each() -> None:
    plain, rng = agent_of(None), np.random.default_rng(9)
    total = np.zeros(12)
    for trial in range(1, LAST + 1):
        trained(plain, 1, rng)
        if trial >= FIRST:
            total += plain.weights
    averaged = trained(agent_of((FIRST, LAST)), LAST)
    np.testing.assert_array_equal(averaged.weights, total / (LAST - FIRST + 1))
    np.testing.assert_array_equal(averaged.velocity, plain.velocity)
    assert not np.array_equal(averaged.weights, plain.weights)


def test_before_the_last_trial_learning_is_what_it_is_without() -> None:
    plain, averaged = trained(agent_of(None), LAST - 1), trained(agent_of((FIRST, LAST)), LAST - 1)
    np.testing.assert_array_equal(averaged.weights, plain.weights)


def test_learning_goes_on_from_the_mean() -> None:
    rng = np.random.default_rng(9)
    averaged = trained(agent_of((FIRST, LAST)), LAST, rng)
    plain = agent_of(None)
    plain.weights, plain.velocity = averaged.weights, averaged.velocity
    trained(averaged, TRIALS - LAST, rng)
    rng = np.random.default_rng(9)
    trained(agent_of(None), LAST, rng)  # moves the stream to the same place
    np.testing.assert_array_equal(trained(plain, TRIALS - LAST, rng).weights, averaged.weights)


@pytest.mark.parametrize("rule", [RULE, AggregateLabel(learning_rate=0.02, fraction=0.25)])
def test_the_loop_lanes_and_threads_end_with_the_same_bits(rule: Rule) -> None:
    def windows(lane: int) -> tuple[int, int]:
        return FIRST + lane % 5, LAST + lane % 7

    alone = {lane: trained(agent_of(windows(lane), lane, rule)) for lane in (0, 3, 37)}
    looped = agent_of(windows(0), 0, rule)
    train(looped, trial_env(), TRIALS, seed=9)
    np.testing.assert_array_equal(looped.weights, alone[0].weights)
    for lanes in (4, 40):
        agents = [agent_of(windows(lane), lane, rule) for lane in range(lanes)]
        train_many(agents, BUSY, BUSY_PATTERNS, TRIALS, 9, threads=2)
        for lane in set(alone) & set(range(lanes)):
            np.testing.assert_array_equal(agents[lane].weights, alone[lane].weights)


def test_a_checkpoint_or_pickle_amid_the_trials_keeps_the_sum(tmp_path: Path) -> None:
    whole, path = trained(agent_of((FIRST, LAST))), tmp_path / "agent.npz"
    rng = np.random.default_rng(9)
    agent = trained(agent_of((FIRST, LAST)), 20, rng)
    agent.save(path)
    again = load_checkpoint(path).agent
    assert again.rule.average_over == (FIRST, LAST) and again.weight_sum.any()
    for one in (again, pickle.loads(pickle.dumps(agent)), agent.replaced()):
        from_here = np.random.default_rng()
        from_here.bit_generator.state = rng.bit_generator.state
        np.testing.assert_array_equal(trained(one, TRIALS - 20, from_here).weights, whole.weights)


def test_the_weights_of_a_network_are_averaged_too() -> None:
    rates = {"learning_rate_hidden": 1e-2, "learning_rate_output": 1e-3}
    plain, averaged = (
        NetworkAgent(Network(hidden=3), BackPropagation(**rates, average_over=over), 12)
        for over in (None, (LAST, LAST + 1))
    )
    rng, total = np.random.default_rng(9), 0.0
    trained(plain, LAST - 1, rng)
    for _ in range(2):
        total = total + trained(plain, 1, rng).weights
    np.testing.assert_array_equal(trained(averaged, LAST + 1).weights, total / 2)


def test_a_neuron_whose_weights_overflow_keeps_the_last_finite_ones() -> None:
    rule = ErrorTrace(learning_rate=1e300, modulate=True, average_over=(1, TRIALS))
    agent = NeuronAgent(MST(), rule, 12, 0, 0.6, None)
    with pytest.warns(RuntimeWarning, match="overflowed"):
        trained(agent)
    assert agent.overflowed and np.isfinite(agent.weights).all()


@pytest.mark.parametrize("name", sorted(registry.rules()))
def test_every_rule_takes_the_option_and_checks_it(name: str) -> None:
    kind: Any = registry.rules()[name]
    if not kind.__module__.startswith("agents."):
        pytest.skip("a rule of another test's")
    assert kind(average_over=[3, 5]).average_over == (3, 5)
    for bad in (3, (1, 2, 3), "soon"):
        with pytest.raises(ValueError, match=r"average_over must be \(first, last\), the trials"):
            kind(average_over=bad)
    for bad in ((0, 5), (1.5, 3)):
        with pytest.raises(ValueError, match="the first trial of average_over must be"):
            kind(average_over=bad)
    with pytest.raises(ValueError, match="the last trial of average_over must be"):
        kind(average_over=(9, 8))
