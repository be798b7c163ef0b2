"""Agents of one kind, side by side on one stream."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.training.binding import loops
from agents.training.compile_errors import COMPILING, explained
from agents.training.exploration import put_state, state_of
from agents.training.source import Source
from agents.training.streams import MOST_SPIKES, Learning, Models, Tally
from gnm_env.batches import Batch, new_batch

if TYPE_CHECKING:
    from agents.training.agent import Agent

Rows = Sequence[Sequence[float] | NDArray[np.float64]]


@dataclass(frozen=True, eq=False, repr=False)
class Answers:
    """Responses of several agents to the same trials, learning off.

    Attributes:
        table: int64 (agents, classes, most + 1); how often each number of output spikes was given
            to each class. The last column means "that many or more".
        false_positives: int64 (agents,), output spikes in noise.
        noise_bins: number of noise bins heard. Trials of which only the label is known count
            neither here nor in what stands above.
        wrong: int64 (agents,), trials whose sum of output spikes was not the aggregate label.
        absolute: float64 (agents,), Σ |label − emitted|.
        trials: number of trials heard.
    """

    table: NDArray[np.int64]
    false_positives: NDArray[np.int64]
    noise_bins: int
    wrong: NDArray[np.int64]
    absolute: NDArray[np.float64]
    trials: int

    def __repr__(self) -> str:
        wrong = ", ".join(f"{one:,}" for one in self.wrong[:5]) + ", …" * (len(self.wrong) > 5)
        return (
            f"Answers(of {len(self.wrong):,} agent{'s' * (len(self.wrong) != 1)} to "
            f"{self.trials:,} trials, {wrong} of them wrong)"
        )


def width_for(agents: int, widest: int) -> int:
    """The block width that serves this number of agents fastest.

    The wider, the better latencies are hidden; unused lanes cost as much as used ones.
    """
    return 1 if agents <= 2 else min(8, widest) if agents <= 8 else widest


class AgentBatch:
    """Agents of one `group_key` that hear the same stream. ValueError if one does not fit it.

    None of the methods holds the GIL for long.
    """

    def __init__(self, agents: Sequence[Agent], source: Source) -> None:
        self._agents = list(agents)
        self._source = source
        first = self._agents[0]
        for agent in self._agents:
            if agent.n_inputs != source.n_inputs:
                raise ValueError(
                    f"agents must have as many inputs as the task, n_inputs = {source.n_inputs}, "
                    f"got {agent.n_inputs}"
                )
        model = first.model
        self._width = width_for(len(self._agents), model.widest)
        self._loops = loops(model, first.rule, self._width)
        self._models = Models(
            self._blocks([agent.model.parameters() for agent in self._agents]),
            self._blocks([agent.weights for agent in self._agents]),
            model.static(first.n_inputs),
            len(model.state_type._fields),
            model.n_memory,
            model.n_notes,
        )
        if not np.isfinite(self._models.weights).all():
            raise ValueError("weights must be finite, but those of an agent hold NaN or infinity")
        # Lanes beyond the last agent repeat it, but have overflowed before the start: never taught.
        overflow = np.zeros((len(self._models.weights), 1, self._width))
        self._per_agent(overflow)[:] = [0.0 if a.overflowed else -1.0 for a in self._agents]
        self._learning = Learning(
            self._blocks([agent.rule_parameters() for agent in self._agents]),
            self._blocks([agent.velocity for agent in self._agents]),
            overflow,
            self._blocks([[float(agent.trials)] for agent in self._agents]),
            self._blocks([agent.rule_memory for agent in self._agents]),
            self._blocks([agent.weight_sum for agent in self._agents]),
            self._blocks([state_of(agent.rng) for agent in self._agents], np.uint64),
            first.rule.static(first.n_inputs),
        )
        self._trials = 0

    def _blocks(self, rows: Rows, dtype: type = np.float64) -> NDArray[Any]:
        """One row per agent -> (blocks, columns, width), the last agent repeated to fill up."""
        table: NDArray[Any] = np.array(rows, dtype)
        padding = -len(table) % self._width
        table = np.concatenate([table, np.repeat(table[-1:], padding, axis=0)])
        blocks = table.reshape(len(table) // self._width, self._width, table.shape[1])
        return np.ascontiguousarray(blocks.transpose(0, 2, 1))

    def _per_agent(self, blocks: NDArray[np.float64]) -> NDArray[np.float64]:
        """(blocks, 1, width) -> (agents,), a view."""
        return blocks.reshape(-1)[: len(self._agents)]

    def train(
        self, rng: Generator, ahead: Any, trials: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Learn each of the next `trials` trials, `ahead` being `source.ahead(…)` for them.

        Returns, per agent, the number of trials answered wrongly and Σ |label − emitted|.
        """
        wrong, absolute = self._zeros(), self._zeros()
        for done, batch, drawn, longest in self._source.batches(rng, ahead, trials):
            self._learn(batch, drawn, longest, self._trials + done, wrong, absolute)
        self._trials += trials
        return self._per_agent(wrong).astype(np.int64), self._per_agent(absolute)

    def _learn(
        self,
        batch: Batch,
        drawn: int,
        longest: int,
        first: int,
        wrong: NDArray[np.float64],
        absolute: NDArray[np.float64],
    ) -> None:
        """Learn each trial of a batch, whose first is number `first`."""
        try:
            self._loops.train(
                batch, drawn, longest, self._models, self._learning, first, wrong, absolute
            )
        except COMPILING as error:
            raise explained(error, self._agents[0].model, self._agents[0].rule) from None

    def hear_nothing(self) -> None:
        """Learn from, and answer, a batch without a trial: compiles what does."""
        self._learn(new_batch(), 0, 0, self._trials, self._zeros(), self._zeros())
        self._loops.answer(new_batch(), 0, 0, self._models, self._tally())

    def _zeros(self) -> NDArray[np.float64]:
        """A number for each lane, (blocks, 1, width)."""
        return np.zeros((len(self._models.weights), 1, self._width))

    def survive(self, rng: Generator, cap: int) -> NDArray[np.int64]:
        """Bins that each agent survives on the endless stream of `rng`, at most `cap`."""
        try:
            bins = self._loops.survive(rng, self._source.stream(), cap, self._models)
        except COMPILING as error:
            raise explained(error, self._agents[0].model) from None
        return self._per_agent(bins).astype(np.int64)

    def answer(self, rng: Generator, trials: int) -> Answers:
        """Responses to `trials` trials of the source, learning off."""
        tally, n_blocks = self._tally(), len(self._models.weights)
        noise_bins = 0
        ahead = self._source.ahead(rng, trials)
        for _, batch, drawn, longest in self._source.batches(rng, ahead, trials):
            noise_bins += self._loops.answer(batch, drawn, longest, self._models, tally)
        return Answers(
            tally.table.reshape(n_blocks * self._width, *tally.table.shape[2:])[
                : len(self._agents)
            ],
            self._per_agent(tally.false_positives).astype(np.int64),
            noise_bins,
            self._per_agent(tally.wrong).astype(np.int64),
            self._per_agent(tally.absolute),
            trials,
        )

    def _tally(self) -> Tally:
        n_blocks, n_classes = len(self._models.weights), self._source.n_classes
        table = np.zeros((n_blocks, self._width, n_classes, MOST_SPIKES + 1), np.int64)
        return Tally(table, self._zeros(), self._zeros(), self._zeros())

    def write_back(self) -> None:
        """Put what was learned into the agents."""
        weights = self._rows(self._models.weights)
        velocity = self._rows(self._learning.velocity)
        memory = self._rows(self._learning.memory)
        weight_sum = self._rows(self._learning.weight_sum)
        generators = self._rows(self._learning.generators)
        overflowed = self.overflowed()
        for k, agent in enumerate(self._agents):
            heard = int(self._per_agent(self._learning.heard)[k]) + self._trials
            if agent.rng is not None:
                put_state(agent.rng, generators[k])
            agent._take(
                weights[k], velocity[k], memory[k], weight_sum[k], heard, bool(overflowed[k] >= 0)
            )

    def _rows(self, blocks: NDArray[Any]) -> NDArray[Any]:
        """(blocks, rows, width) -> one row per agent."""
        rows = blocks.shape[0] * blocks.shape[2]
        return blocks.transpose(0, 2, 1).reshape(rows, blocks.shape[1])[: len(self._agents)]

    def overflowed(self) -> NDArray[np.int64]:
        """Per agent the trial in which learning ended because a weight overflowed, or −1."""
        return self._per_agent(self._learning.overflow).astype(np.int64)
