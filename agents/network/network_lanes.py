"""Many networks of one size on one stream: each trial is drawn once and heard by all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.lane_group import Answers
from agents.network import kernels
from agents.network.backpropagation import rule_row
from agents.network.dynamics import wiring_row
from gnm_env.task import Patterns, Task, task_arrays

if TYPE_CHECKING:
    from agents.network.network_agent import NetworkAgent


class NetworkLanes:
    """A `LaneGroup` of NetworkAgents; see there. ValueError if agents and task do not fit."""

    def __init__(self, agents: Sequence[NetworkAgent], task: Task, patterns: Patterns) -> None:
        self._agents = list(agents)
        self._task_arrays = task_arrays(task, patterns)
        for agent in self._agents:
            if agent.n_inputs != task.n_inputs:
                raise ValueError(
                    f"agents must have as many inputs as the task, n_inputs = {task.n_inputs}, "
                    f"got {agent.n_inputs}"
                )
        self._wirings = np.array([wiring_row(a.network, a.n_inputs) for a in agents], np.float64)
        self._rules = np.array([rule_row(a.rule) for a in agents], np.float64)
        self._weights = np.array([a.weights for a in agents])
        self._previous = np.array([a.momentum for a in agents])
        if not np.isfinite(self._weights).all():
            raise ValueError("weights must be finite, but those of an agent hold NaN or infinity")
        # An agent that has overflowed before the start is taught no more.
        self._overflow = np.array([0 if a.overflowed else -1 for a in agents], np.int64)
        self._trials = 0

    def train(self, rng: Generator, trials: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        wrong, absolute = kernels.train(
            rng, self._task_arrays, trials, self._wirings, self._rules,
            self._weights, self._previous, self._overflow, self._trials,
        )  # fmt: skip
        self._trials += trials
        return wrong, absolute

    def survive(self, rng: Generator, cap: int) -> NDArray[np.int64]:
        bins: NDArray[np.int64] = kernels.survive(
            rng, self._task_arrays, cap, self._wirings, self._weights
        )
        return bins

    def answer(self, rng: Generator, trials: int) -> Answers:
        table, false_alarms, wrong = kernels.answer(
            rng, self._task_arrays, trials, self._wirings, self._weights
        )
        noise_bins = trials * self._task_arrays.background_bins
        return Answers(table, false_alarms, noise_bins, wrong, trials)

    def write_back(self) -> None:
        for k, agent in enumerate(self._agents):
            agent.weights[:] = self._weights[k]
            agent.momentum[:] = self._previous[k]
            agent.overflowed = bool(self._overflow[k] >= 0)

    def overflowed(self) -> NDArray[np.int64]:
        return self._overflow.copy()
