"""ContinuousAgent: a continuous neuron that answers each bin with an amount, and learns."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.continuous.neuron import ContinuousGNM
from agents.learning.rule import Rule
from agents.training.agent import Agent, Bounds


class ContinuousAgent(Agent):
    """A neuron in continuous time; for environments made with output="graded".

    What a NeuronAgent is with spikes, this is with amounts: `act` gives the S of one bin, the error
    is target − S, over each presentation and over the whole trial; in noise E(t) is −1 in every bin
    that gives any output. The trace decays by e^−(1−η)α a bin, and V(t) is the value right after a
    bin's input. The rules, the standard loop, `train_many`, checkpoints and scores are the same.

    Args:
        neuron: a ContinuousGNM.
        rule: AggregateLabel or ErrorTrace.
        n_inputs, seed, initial_weight, weight_bounds: as for a NeuronAgent.

    Raises:
        ValueError: if an argument is out of range.
    """

    name: ClassVar[str] = "continuous"
    models: ClassVar[Any] = ContinuousGNM
    model_role: ClassVar[str] = "neuron"

    def __init__(
        self,
        neuron: ContinuousGNM,
        rule: Rule,
        n_inputs: int,
        seed: int = 0,
        initial_weight: float | None = None,
        weight_bounds: Bounds = (0.0, 1.0),
    ) -> None:
        super().__init__(neuron, rule, n_inputs, seed, initial_weight, weight_bounds)

    @property
    def neuron(self) -> Any:
        """The neuron."""
        return self._model

    def act(self, obs: NDArray[Any]) -> float:
        """The amount of output in one bin. `obs` holds N bits."""
        return self._step(obs)

    def predict(
        self,
        observation: NDArray[Any] | dict[str, NDArray[Any]],
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], tuple[NDArray[Any], ...]]:
        """As `NeuronAgent.predict`; (N,) gives an action of shape (1,), (n, N) gives (n, 1)."""
        amounts, states = self._predicted(observation, state, episode_start)
        return (amounts if np.asarray(observation).ndim == 1 else amounts[:, None]), (states,)
