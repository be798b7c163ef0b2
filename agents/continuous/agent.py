"""ContinuousAgent: a continuous neuron that answers each bin with an amount, and learns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents import checkpoint
from agents.continuous.kernels import WRONG_BEYOND, continuous_kernels
from agents.continuous.neuron import ContinuousGNM
from agents.learning.rule import Rule
from agents.neuron_agent import RULES, NeuronAgent
from agents.neuron_lanes import NeuronLanes
from gnm_env.task import Patterns, Task


@checkpoint.register_kind("continuous")
class ContinuousAgent(NeuronAgent):
    """A neuron in continuous time; for environments made with output="graded".

    What a NeuronAgent is with spikes, this is with amounts: `act` gives the S of one bin, the error
    is target − S, over each occurrence and over the whole trial; in noise E(t) is −1 in every bin
    that gives any output. The trace decays by e^−(1−η)α a bin, and V(t) is the value right after a
    bin's input. The rules, the standard loop, `train_many`, checkpoints and scores are the same.

    Args:
        neuron: a ContinuousGNM.
        rule: AggregateLabel or ErrorTrace.
        n_inputs, seed, initial_weight, weight_bounds: as for a NeuronAgent.

    Raises:
        ValueError: if an argument is out of range.
    """

    neuron: ContinuousGNM
    graded: ClassVar[bool] = True
    wrong_beyond = WRONG_BEYOND

    def __init__(
        self,
        neuron: ContinuousGNM,
        rule: Rule,
        n_inputs: int,
        seed: int = 0,
        initial_weight: float | None = None,
        weight_bounds: tuple[float, float] | None = (0.0, 1.0),
    ) -> None:
        if not isinstance(neuron, ContinuousGNM):
            raise ValueError(
                f"neuron must be a ContinuousGNM, got {neuron!r}; else use NeuronAgent"
            )
        super().__init__(neuron, rule, n_inputs, seed, initial_weight, weight_bounds)

    def _prepare(self) -> None:
        super()._prepare()
        self._kernels = continuous_kernels(self.neuron, self.rule)

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], tuple[NDArray[Any], ...]]:
        """As `NeuronAgent.predict`; (N,) gives an action of shape (1,), (n, N) gives (n, 1)."""
        obs = np.asarray(observation)
        amounts, state = super().predict(np.atleast_2d(obs), state, episode_start, deterministic)
        return (amounts[0] if obs.ndim == 1 else amounts), state

    @classmethod
    def lanes(
        cls, agents: Sequence[NeuronAgent], task: Task, patterns: Patterns
    ) -> ContinuousLanes:
        return ContinuousLanes(agents, task, patterns)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        task: Task | None = None,
        patterns: Patterns | None = None,
        rng: Generator | None = None,
    ) -> None:
        header = {
            "neuron_parameters": asdict(self.neuron),
            "rule": self.rule.name,
            "rule_parameters": asdict(self.rule),  # type: ignore[call-overload]
            "weight_bounds": self.weight_bounds,
            "overflowed": self.overflowed,
        }
        arrays = {"weights": self.weights, "momentum": self.momentum}
        checkpoint.write(path, "continuous", header, arrays, task=task, patterns=patterns, rng=rng)

    @classmethod
    def from_checkpoint(
        cls, header: dict[str, Any], arrays: dict[str, NDArray[Any]]
    ) -> ContinuousAgent:
        bounds = header["weight_bounds"]
        agent = cls(
            ContinuousGNM(**header["neuron_parameters"]),
            RULES[header["rule"]](**header["rule_parameters"]),
            n_inputs=len(arrays["weights"]),
            weight_bounds=None if bounds is None else tuple(bounds),
        )._with(arrays["weights"], arrays["momentum"])
        agent.overflowed = bool(header["overflowed"])
        return agent

    def replaced(self, **changes: Any) -> ContinuousAgent:
        neuron = replace(self.neuron, **changes)
        agent = ContinuousAgent(neuron, self.rule, self.n_inputs, weight_bounds=self.weight_bounds)
        return agent._with(self.weights, self.momentum)

    def _with(self, weights: NDArray[Any], momentum: NDArray[Any]) -> ContinuousAgent:
        if momentum.shape != (self.n_inputs,):
            raise ValueError(f"momentum must have shape ({self.n_inputs},), got {momentum.shape}")
        self.weights = weights
        self.momentum[:] = momentum
        return self


class ContinuousLanes(NeuronLanes):
    """A `LaneGroup` of ContinuousAgents on one stream: blocks of one neuron each."""

    def __init__(self, agents: Sequence[NeuronAgent], task: Task, patterns: Patterns) -> None:
        super().__init__(agents, task, patterns)
        self._kernels = agents[0]._kernels
        for name in ("_parameters", "_rule_parameters", "_weights", "_previous", "_overflow"):
            setattr(self, name, self._one_by_one(getattr(self, name)))
        self._width = 1

    def _one_by_one(self, blocks: NDArray[np.float64]) -> NDArray[np.float64]:
        """(blocks, rows, width) -> (agents, rows, 1)."""
        rows = blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1])
        return np.ascontiguousarray(rows[: len(self._agents), :, None])
