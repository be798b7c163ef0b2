"""Wrong outputs of the chemical neuron."""

from __future__ import annotations

import numpy as np
import pytest

from agents import ErrorTrace, train_many
from agents.chemistry.mistakes import count_mistakes
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.continuous.outputs import at_edges, wrong_outputs
from gnm_env import Patterns, Task, draw_trial

pytest.importorskip("roadrunner")
pytest.importorskip("libsbml")


def test_few_molecules_make_more_mistakes_than_many() -> None:
    task = Task(n_inputs=20, n_classes=1, rate=0.02, pattern_bins=20, background_bins=20)
    patterns = Patterns.draw(task, seed=3)
    agent = ContinuousAgent(ContinuousGNM(alpha=0.2), ErrorTrace(modulate=True), 20)
    train_many([agent], task, patterns, 20_000, seed=1)
    calls: list[int] = []
    found = count_mistakes(
        agent, task, patterns, (3, 3_000), trials=12, seed=8, progress=lambda: calls.append(1)
    )
    assert found.stochastic.shape == (2, 12)
    assert len(calls) == 12
    assert found.stochastic[0].sum() > found.stochastic[1].sum() + 5
    rng = np.random.default_rng(8)
    trials = [draw_trial(task, patterns, rng) for _ in range(12)]
    neuron = [wrong_outputs(trial, at_edges(agent, trial)) for trial in trials]
    assert found.neuron.tolist() == neuron
