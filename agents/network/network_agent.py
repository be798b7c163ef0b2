"""NetworkAgent: a network with weights and its learning rule, acting bin by bin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.network.parameters import BackPropagation, Network
from agents.recording import Recording
from agents.training.agent import Agent, Bounds, put


@dataclass(frozen=True, eq=False)
class NetworkRecording(Recording):
    """Variables of a network in each of the T bins of a trial.

    V, X and spikes are those of the readout, D = α V(t−1) its decay, and R is 0: it has no reset.

    Attributes:
        v: hidden potentials, (T, H).
        z: hidden outputs, (T, H).
        j: currents into the readout, (T, H).
    """

    v: NDArray[np.float64]
    z: NDArray[np.float64]
    j: NDArray[np.float64]


class NetworkAgent(Agent):
    """A network with a hidden layer that learns by backpropagated error traces.

    To be used as a NeuronAgent is: in the standard loop, in `train_many`, with `noisy_performance`,
    `record` and checkpoints.

    Args:
        network: its size and parameters.
        rule: BackPropagation.
        n_inputs: N, number of input channels.
        seed: of the initial weights, default_rng((seed, 2)): first W (N, H), then u (H,), uniform
            on [0, initial_weight).
        initial_weight: upper end of the initial weights; None: 0.3.

    Attributes:
        weights: float64 (N·H + H,), the agent's own writable array, W by inputs and then u.
        velocity: float64, same shape, weight change of the last learning step, momentum included.
        overflowed: whether learning has ended because a weight would have overflowed.

    Raises:
        ValueError: if an argument is out of range.
    """

    name: ClassVar[str] = "network"
    models: ClassVar[Any] = Network
    model_role: ClassVar[str] = "network"

    def __init__(
        self,
        network: Network | None = None,
        rule: BackPropagation | None = None,
        n_inputs: int = 100,
        seed: int = 0,
        initial_weight: float | None = None,
    ) -> None:
        network = Network() if network is None else network
        rule = BackPropagation() if rule is None else rule
        super().__init__(network, rule, n_inputs, seed, initial_weight, None)

    @classmethod
    def rebuilt(cls, model: Any, rule: Any, n_inputs: int, weight_bounds: Bounds) -> Self:
        return cls(model, rule, n_inputs)

    @property
    def network(self) -> Any:
        """The network."""
        return self._model

    @property
    def hidden_weights(self) -> NDArray[np.float64]:
        """W, (N, H), a writable view of `weights`; assigning copies into it, checked."""
        return self._weights[: self.n_inputs * self.network.width].reshape(self.n_inputs, -1)

    @hidden_weights.setter
    def hidden_weights(self, values: ArrayLike) -> None:
        put("hidden_weights", values, self.hidden_weights)

    @property
    def output_weights(self) -> NDArray[np.float64]:
        """u, (H,), a writable view of `weights`; assigning copies into it, checked."""
        return self._weights[self.n_inputs * self.network.width :]

    @output_weights.setter
    def output_weights(self, values: ArrayLike) -> None:
        put("output_weights", values, self.output_weights)

    def _recording(
        self, values: NDArray[Any], given: NDArray[np.float64], memory: NDArray[np.float64]
    ) -> NetworkRecording:
        V, D, R, X, spikes = values
        H = self.network.width
        v, z, j = memory[:, :H], memory[:, H : 2 * H], memory[:, 2 * H :]
        return NetworkRecording(V, D, R, X, spikes > 0.0, v, z, j)
