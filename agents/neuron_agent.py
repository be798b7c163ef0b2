"""NeuronAgent: a spiking neuron with weights and a learning rule, acting bin by bin."""

from __future__ import annotations

from typing import Any, ClassVar

from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from agents.training.agent import Agent, Bounds


class NeuronAgent(Agent):
    """A spiking neuron that learns from trials.

    In the standard loop: `begin_trial()` before the first bin, `act(obs)` in each bin,
    `learn(reward, info)` after the last. `predict` has the signature of Stable-Baselines3 and
    changes nothing.

    Args:
        neuron: GNM, LIF, MST, or a neuron of yours.
        rule: a learning rule, such as AggregateLabel or ErrorTrace, or one of yours.
        n_inputs: N, number of input channels.
        seed: of the initial weights, default_rng((seed, 2)).random(N) · initial_weight.
        initial_weight: w₀, upper end of the initial weights; None: the neuron's default.
        weight_bounds: lowest and highest weight; None: unbounded.

    Attributes:
        weights: float64 (N,), the agent's own writable array.
        velocity: float64 (N,), weight change of the last learning step, momentum included.
        overflowed: whether learning has ended because a weight would have overflowed.

    Raises:
        ValueError: if an argument is out of range.
    """

    name: ClassVar[str] = "neuron"
    models: ClassVar[Any] = Neuron
    model_role: ClassVar[str] = "neuron"

    def __init__(
        self,
        neuron: Neuron,
        rule: Rule,
        n_inputs: int,
        seed: int = 0,
        initial_weight: float | None = None,
        weight_bounds: Bounds = (0.0, 1.0),
    ) -> None:
        if isinstance(neuron, Neuron) and neuron.graded:
            raise ValueError(
                f"a {type(self).__name__} cannot have {neuron!r}: spikes and amounts do not mix; "
                "amounts are for agents.continuous.ContinuousAgent"
            )
        super().__init__(neuron, rule, n_inputs, seed, initial_weight, weight_bounds)

    @property
    def neuron(self) -> Any:
        """The neuron."""
        return self._model
