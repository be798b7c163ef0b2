"""The picture of an agent refuses what it cannot draw; tests of commands look at what it shows."""

from __future__ import annotations

from typing import Any

import pytest

from agents import GNM, AggregateLabel, NeuronAgent, plot, train_many
from gnm_env import Patterns, Task

TASK = Task(n_inputs=4, pattern_bins=3, background_bins=6)
PATTERNS = Patterns.draw(TASK, 0)


def agent() -> NeuronAgent:
    return NeuronAgent(GNM(), AggregateLabel(fraction=0.5), TASK.n_inputs)


@pytest.mark.parametrize("history", [3, "x", []])
def test_a_history_is_a_history(history: Any) -> None:
    with pytest.raises(ValueError, match="history must be a History, got"):
        plot(agent(), TASK, PATTERNS, history)


def test_the_history_of_several_agents_is_not_drawn_for_one() -> None:
    history = train_many([agent(), agent()], TASK, PATTERNS, trials=2, seed=1)
    with pytest.raises(ValueError, match=r"got one of several: give history\.of\(k\)"):
        plot(agent(), TASK, PATTERNS, history)
    plot(agent(), TASK, PATTERNS, history.of(0))
