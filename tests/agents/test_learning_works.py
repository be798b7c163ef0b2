"""End to end, at full size: neurons learn the task, and what cannot come back does not."""

from __future__ import annotations

import numpy as np
import pytest

from agents import GNM, AggregateLabel, ErrorTrace, NeuronAgent, noisy_performance, train_many
from agents.learning.rule import Rule
from gnm_env import Patterns, Task

TRIALS = 60_000
HELD_OUT = 1_000_000
"""Seed of the streams for scoring, far from those of training."""


def score(
    rule: Rule, n_classes: int, seed: int, trials: int, *, alpha: float = 0.3, start: float | None
) -> tuple[float, NeuronAgent]:
    """Mean noisy performance after training, from all weights `start` (None: the usual ones)."""
    task = Task(n_classes=n_classes)
    patterns = Patterns.draw(task, seed)
    agent = NeuronAgent(GNM(alpha=alpha), rule, task.n_inputs, seed)
    if start is not None:
        agent.weights = start
    train_many([agent], task, patterns, trials, seed=seed)
    return float(noisy_performance(agent, task, patterns, 50, seed=HELD_OUT).mean()), agent


SILENCE = Task().silent_score


def test_a_neuron_learns_one_pattern_from_too_many_or_too_few() -> None:
    """Measured: 10,000, 9,749, 10,000 bins; untrained it is silent, which survives 148."""
    scores = [score(AggregateLabel(), 1, seed, 20_000, start=None)[0] for seed in range(3)]
    untrained = [score(AggregateLabel(), 1, seed, 0, start=None)[0] for seed in range(3)]
    assert np.mean(scores) > 7_000
    assert min(scores) > 10 * SILENCE
    assert max(untrained) < 2 * SILENCE


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("start", [0.0, 1.0], ids=["silent", "saturated"])
@pytest.mark.parametrize("n_classes", [1, 2])
def test_error_traces_come_back_from_silence_and_from_saturation(
    n_classes: int, start: float, seed: int
) -> None:
    """Measured: 541 bins or more over four seeds, most in the thousands."""
    reached, agent = score(ErrorTrace(), n_classes, seed, TRIALS, start=start)
    assert reached > 2 * SILENCE
    assert 0.01 < agent.weights.mean() < 0.3


def test_modulated_error_traces_cannot_leave_silence() -> None:
    """E(t)·V(t) is zero wherever V is."""
    for trials in (100, 5_000):
        reached, agent = score(ErrorTrace(modulate=True), 1, 0, trials, start=0.0)
        assert not agent.weights.any()
        assert not agent.velocity.any()
    assert 100 < reached < 250


def test_aggregate_labels_cannot_leave_silence_either() -> None:
    """Every eligibility is zero, and none lies above the others."""
    _, agent = score(AggregateLabel(), 1, 0, 5_000, start=0.0)
    assert not agent.weights.any()


@pytest.mark.parametrize("alpha", [0.1, 0.05, 0.02])
@pytest.mark.parametrize(
    "rule",
    [ErrorTrace(), ErrorTrace(modulate=True), AggregateLabel()],
    ids=["et", "et-modulated", "all"],
)
def test_nothing_comes_back_from_saturation_when_the_potential_decays_slowly(
    rule: Rule, alpha: float
) -> None:
    """Always above threshold, there is no upward crossing to be told about; measured: 7–39 bins."""
    reached, _ = score(rule, 1, 0, TRIALS, alpha=alpha, start=1.0)
    assert reached < SILENCE
