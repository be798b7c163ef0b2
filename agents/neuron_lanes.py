"""Many neurons of one kind and rule, side by side on one stream."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.kernels import kernels
from agents.lane_group import Answers
from gnm_env.task import Patterns, Task, task_arrays

if TYPE_CHECKING:
    from agents.neuron_agent import NeuronAgent

LANES_PER_BLOCK = 32
"""Width of a block of many neurons."""


def width_for(lanes: int) -> int:
    """The block width that serves this number of neurons fastest.

    The wider, the better latencies are hidden; unused lanes cost as much as used ones.
    """
    return 1 if lanes <= 2 else 8 if lanes <= 8 else LANES_PER_BLOCK


class NeuronLanes:
    """A `LaneGroup` of NeuronAgents; see there. Raises ValueError if agents and task do not fit."""

    def __init__(self, agents: Sequence[NeuronAgent], task: Task, patterns: Patterns) -> None:
        self._agents = list(agents)
        self._task_arrays = task_arrays(task, patterns)
        first = self._agents[0]
        for agent in self._agents:
            if agent.n_inputs != task.n_inputs:
                raise ValueError(
                    f"agents must have as many inputs as the task, n_inputs = {task.n_inputs}, "
                    f"got {agent.n_inputs}"
                )
        self._width = width_for(len(self._agents))
        self._kernels = kernels(first.neuron, first.rule, self._width)
        self._mode, self._rule_mode = first.neuron.mode(), first.rule_mode
        self._parameters = self._blocks([a.neuron.parameters() for a in self._agents])
        self._rule_parameters = self._blocks([a.rule_parameters() for a in self._agents])
        self._weights = self._blocks([a.weights for a in self._agents])
        self._previous = self._blocks([a.momentum for a in self._agents])
        if not np.isfinite(self._weights).all():
            raise ValueError("weights must be finite, but those of an agent hold NaN or infinity")
        # Lanes beyond the last agent repeat it, but have overflowed before the start: never taught.
        self._overflow = np.zeros((len(self._weights), 1, self._width))
        self._per_agent(self._overflow)[:] = [0.0 if a.overflowed else -1.0 for a in self._agents]
        self._trials = 0

    def _blocks(self, rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> NDArray[np.float64]:
        """One row per agent -> (blocks, columns, width), the last agent repeated to fill up."""
        table = np.array(rows, np.float64)
        padding = -len(table) % self._width
        table = np.concatenate([table, np.repeat(table[-1:], padding, axis=0)])
        blocks = table.reshape(-1, self._width, table.shape[1])
        return np.ascontiguousarray(blocks.transpose(0, 2, 1))

    def _per_agent(self, blocks: NDArray[np.float64]) -> NDArray[np.float64]:
        """(blocks, 1, width) -> (agents,), a view."""
        return blocks.reshape(-1)[: len(self._agents)]

    def train(self, rng: Generator, trials: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        wrong, absolute = self._kernels.train(
            rng, self._task_arrays, trials, self._mode, self._rule_mode, self._parameters,
            self._rule_parameters, self._weights, self._previous, self._overflow, self._trials,
        )  # fmt: skip
        self._trials += trials
        return self._per_agent(wrong).astype(np.int64), self._per_agent(absolute)

    def survive(self, rng: Generator, cap: int) -> NDArray[np.int64]:
        bins = self._kernels.survive(
            rng, self._task_arrays, cap, self._mode, self._parameters, self._weights
        )
        return self._per_agent(bins).astype(np.int64)

    def answer(self, rng: Generator, trials: int) -> Answers:
        table, false_alarms, wrong, noise_bins = self._kernels.answer(
            rng, self._task_arrays, trials, self._mode, self._parameters, self._weights
        )
        return Answers(
            table.reshape(-1, *table.shape[2:])[: len(self._agents)],
            self._per_agent(false_alarms).astype(np.int64),
            noise_bins,
            self._per_agent(wrong).astype(np.int64),
            trials,
        )

    def write_back(self) -> None:
        weights = self._weights.transpose(0, 2, 1).reshape(-1, self._weights.shape[1])
        previous = self._previous.transpose(0, 2, 1).reshape(-1, self._previous.shape[1])
        overflowed = self.overflowed()
        for k, agent in enumerate(self._agents):
            agent.weights[:] = weights[k]
            agent.momentum[:] = previous[k]
            agent.overflowed = bool(overflowed[k] >= 0)

    def overflowed(self) -> NDArray[np.int64]:
        return self._per_agent(self._overflow).astype(np.int64)
