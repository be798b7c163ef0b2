"""What a notebook shows of agents, curves and results fits on a line and says what matters."""

from __future__ import annotations

import numpy as np

import agents
from agents import GNM, LIF, AggregateLabel, CriticalThreshold, NeuronAgent
from agents.history import History
from gnm_env import Patterns, Task, draw_trial

TASK = Task(n_classes=2)
PATTERNS = Patterns.draw(TASK, seed=0)


def agent() -> NeuronAgent:
    return NeuronAgent(GNM(alpha=0.1), AggregateLabel(), TASK.n_inputs, seed=0)


def test_an_agent_is_told_by_what_is_not_at_its_default() -> None:
    assert repr(agent()) == "NeuronAgent(GNM(alpha=0.1), AggregateLabel(), n_inputs=100)"
    other = NeuronAgent(LIF(refractory=5), CriticalThreshold(amount=True), 20)
    assert (
        repr(other) == "NeuronAgent(LIF(refractory=5), CriticalThreshold(amount=True), n_inputs=20)"
    )


def test_a_learning_curve_is_told_by_its_end() -> None:
    history = History()
    assert repr(history) == "History(no trials yet)"
    history.append(1_000, 500, 700)
    history.append(1_000, 3, 3)
    assert repr(history) == (
        "History(2,000 trials in 2 blocks, 1 agent: 0.3% of the trials wrong in the last block)"
    )


def test_results_fit_on_a_line() -> None:
    one = agent()
    trial = draw_trial(TASK, PATTERNS, np.random.default_rng(0))
    recorded = agents.record(one, trial)
    assert repr(recorded).startswith(f"Recording({len(recorded.V):,} bins, ")
    given = agents.answers([one] * 7, TASK, PATTERNS, trials=5, seed=0)
    assert repr(given).startswith("Answers(of 7 agents to 5 trials, ")
    kept = agents.pretrained("gnm-critical-3")
    assert repr(kept).startswith("Checkpoint(NeuronAgent(GNM(alpha=0.15), CriticalThreshold(")
    assert repr(kept).endswith("Task(n_classes=3, targets=(1, 2, 3)))")
    for shown in (recorded, given, kept):
        assert "\n" not in repr(shown) and len(repr(shown)) < 180
