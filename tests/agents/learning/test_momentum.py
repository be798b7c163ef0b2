"""Momentum, bounds, and weights that grow beyond all numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import (
    GNM,
    AggregateLabel,
    ErrorTrace,
    NeuronAgent,
    WeightOverflow,
    train,
    train_many,
)
from gnm_env import Task, Trial
from tests.agents.worlds import BUSY, BUSY_PATTERNS, play, trial_env

TASK = Task(n_inputs=2, pattern_bins=5)
LAMBDA = 0.25


def trial(bins: list[int]) -> Trial:
    """20 bins, channel 1 spikes in `bins`, one output spike is owed."""
    raster = np.zeros((20, 2), np.bool_)
    raster[bins, 1] = True
    return Trial.from_dense(raster, [10], [0], TASK)


MORE = trial([3])
"""Asks for more output as long as the weight of channel 1 is below 1."""


def learner(bounds: tuple[float, float] | None = (0.0, 0.9), momentum: float = 0.2) -> NeuronAgent:
    rule = AggregateLabel(LAMBDA, momentum=momentum, fraction=0.5)
    agent = NeuronAgent(GNM(), rule, 2, initial_weight=0.0, weight_bounds=bounds)
    agent.weights = [0.0, 0.5]
    return agent


def test_the_previous_change_is_added_with_its_own_momentum_and_is_kept_unclipped() -> None:
    agent = learner()
    play(agent, MORE)
    assert agent.velocity.tolist() == [0.0, 0.25]
    assert agent.weights.tolist() == [0.0, 0.75]
    play(agent, MORE)
    assert agent.velocity[1] == 0.25 + 0.2 * 0.25
    assert agent.weights[1] == 0.9  # the bound
    play(agent, MORE)
    assert agent.velocity[1] == 0.25 + 0.2 * (0.25 + 0.2 * 0.25)
    assert agent.weights[1] == 0.9


def test_momentum_carries_inputs_that_are_not_eligible_themselves() -> None:
    agent = learner()
    agent.velocity[:] = [0.5, -0.5]
    play(agent, MORE)
    assert agent.velocity.tolist() == [0.2 * 0.5, 0.25 + 0.2 * -0.5]
    assert agent.weights.tolist() == [0.1, 0.5 + 0.15]


def test_momentum_is_left_alone_by_trials_that_teach_nothing() -> None:
    agent = learner()
    play(agent, MORE)
    before = agent.velocity.copy()
    play(agent, MORE, label=0, targets=[0])
    assert np.array_equal(agent.velocity, before)
    play(agent, MORE)
    assert agent.velocity[1] == 0.25 + 0.2 * 0.25


def test_momentum_lives_across_calls_and_checkpoints(tmp_path: Path) -> None:
    agent = learner()
    play(agent, MORE)
    agent.save(tmp_path / "agent")
    again = NeuronAgent.load(tmp_path / "agent")
    for each in (agent, again):
        play(each, MORE)
        assert each.velocity[1] == 0.25 + 0.2 * 0.25


def test_without_momentum_each_change_stands_alone() -> None:
    agent = learner(momentum=0.0)
    play(agent, MORE)
    play(agent, MORE)
    assert agent.velocity[1] == 0.25


@pytest.mark.parametrize(
    ("bounds", "weight"),
    [((0.0, 0.6), 0.6), ((0.7, 1.0), 0.95), (None, 0.75), ((-np.inf, np.inf), 0.75)],
)
def test_weights_stay_within_the_bounds(bounds: tuple[float, float] | None, weight: float) -> None:
    agent = NeuronAgent(
        GNM(), AggregateLabel(LAMBDA, fraction=0.5), 2, initial_weight=0.5, weight_bounds=bounds
    )
    if bounds != (0.7, 1.0):
        agent.weights = [0.0, 0.5]  # else the start, 0 … ½, has been raised to the lower bound
    play(agent, MORE)
    assert agent.weights[1] == weight


def test_without_bounds_weights_may_become_negative() -> None:
    agent = learner(bounds=None)
    agent.weights = [0.0, 0.05]
    play(agent, MORE, label=-1)
    assert agent.weights[1] == 0.05 - LAMBDA


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ((1.0, 0.0), r"lowest < highest, got \(1.0, 0.0\)"),
        ((0.5, 0.5), r"lowest < highest, got \(0.5, 0.5\)"),
        ((0.0, float("nan")), r"upper weight bound must be finite, got nan"),
        ((0.0,), r"weight_bounds must be \(lowest, highest\) or None, got \(0.0,\)"),
        (1.0, r"weight_bounds must be \(lowest, highest\) or None, got 1.0"),
        ((None, 1.0), r"lower weight bound must be a number, got None"),
    ],
)
def test_bad_bounds_are_refused(bounds: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        NeuronAgent(GNM(), AggregateLabel(), 10, weight_bounds=bounds)


# --- overflow ----------------------------------------------------------------------------------

EXPLOSIVE = ErrorTrace(learning_rate=1e308)


def explosive(bounds: tuple[float, float] | None = None, seed: int = 0) -> NeuronAgent:
    return NeuronAgent(GNM(), EXPLOSIVE, BUSY.n_inputs, seed, 0.6, weight_bounds=bounds)


@pytest.mark.parametrize("bounds", [None, (0.0, 1.0)])
def test_a_weight_that_would_overflow_ends_learning_and_keeps_its_last_finite_value(
    bounds: tuple[float, float] | None,
) -> None:
    looped, lane = explosive(bounds), explosive(bounds)
    with pytest.warns(WeightOverflow, match=r"within \d+ trials.*lower learning_rate"):
        by_loop = train(looped, trial_env(), trials=50, seed=5)
    with pytest.warns(WeightOverflow, match="agent 0 would have overflowed within"):
        by_lane = train_many([lane], BUSY, BUSY_PATTERNS, trials=50, seed=5)
    for agent in (looped, lane):
        assert agent.overflowed
        assert np.isfinite(agent.weights).all()
        assert np.isfinite(agent.velocity).all()
    assert np.array_equal(looped.weights, lane.weights)
    assert np.array_equal(looped.velocity, lane.velocity)
    # Both name the trial itself, not the block in which it lay.
    assert 0 <= int(by_loop.overflowed) < 50
    assert by_lane.overflowed.tolist() == [int(by_loop.overflowed)]
    assert np.array_equal(by_lane.error_rate[:, 0], by_loop.error_rate)


def test_an_agent_that_has_overflowed_learns_no_more() -> None:
    agent = explosive()
    with pytest.warns(WeightOverflow):
        train_many([agent], BUSY, BUSY_PATTERNS, trials=50, seed=5)
    weights = agent.weights.copy()
    with pytest.warns(WeightOverflow):
        train(agent, trial_env(), trials=5, seed=6)
    with pytest.warns(WeightOverflow):
        train_many([agent], BUSY, BUSY_PATTERNS, trials=5, seed=6)
    assert np.array_equal(agent.weights, weights)


def test_a_lane_that_overflows_leaves_its_neighbours_alone() -> None:
    def sane(seed: int) -> NeuronAgent:
        return NeuronAgent(GNM(), ErrorTrace(1e-3), BUSY.n_inputs, seed, 0.6)

    side_by_side = [sane(0), sane(1), explosive(), sane(3), sane(4)]
    with pytest.warns(WeightOverflow, match="agent 2"):
        history = train_many(side_by_side, BUSY, BUSY_PATTERNS, trials=200, seed=5)
    assert [bool(t >= 0) for t in history.overflowed] == [False, False, True, False, False]
    for k in (0, 1, 3, 4):
        alone = sane(k)
        train_many([alone], BUSY, BUSY_PATTERNS, trials=200, seed=5)
        assert np.array_equal(side_by_side[k].weights, alone.weights)
