"""The generalised neuron (η = 0) read as chemistry: Fil & Chu, "Interpreting GNM as …"."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.continuous.neuron import ContinuousGNM
from gnm_env.checks import real

CONVERSION = 10.0
"""C of the paper, per bin."""


@dataclass(frozen=True, eq=False)
class ReactionNetwork:
    """Molecules of N input species and of one species V, the membrane potential.

        I_i → V    at rate w_i · C       an input spike of channel i adds molecules of I_i at once
        I_i → ∅    at rate (1 − w_i) · C
        V   → ∅    at rate α

    As C → ∞ V obeys dV/dt = I − αV, in units of molecules per input spike. Raises ValueError if a
    weight lies outside 0 … 1 (a rate cannot be negative) or a rate is not positive.

    Attributes:
        weights: float64 (N,), each in 0 … 1: the fraction of I_i that becomes V.
        alpha: α > 0, per bin.
        conversion: C > 0, per bin: how fast input molecules react.
        theta_r: ϑ_R > 0, readout threshold, in molecules of V per molecules of an input spike.
    """

    weights: NDArray[np.float64]
    alpha: float = 0.3
    conversion: float = CONVERSION
    theta_r: float = 1.0

    def __post_init__(self) -> None:
        weights = np.array(self.weights, np.float64)
        if weights.ndim != 1 or weights.size == 0:
            raise ValueError(f"weights must have shape (N,) with N >= 1, got {weights.shape}")
        wrong = ~((weights >= 0.0) & (weights <= 1.0))
        if wrong.any():
            i = int(np.argmax(wrong))
            raise ValueError(
                "weights must lie in 0 … 1 for chemistry, where w and 1 − w are rates: "
                f"channel {i} has {weights[i]:g}; train with weight_bounds=(0, 1)"
            )
        weights.flags.writeable = False
        object.__setattr__(self, "weights", weights)
        for name in ("alpha", "conversion", "theta_r"):
            object.__setattr__(self, name, real(name, getattr(self, name), above=0.0))

    @classmethod
    def from_agent(cls, agent: Any, conversion: float | None = None) -> ReactionNetwork:
        """The network of a trained ContinuousAgent with η = 0; ValueError for any other agent.

        `conversion` None is that of a `ReactingGNM`, which then does in the network what it was
        trained to do, and else 10 per bin.
        """
        neuron = getattr(agent, "neuron", None)
        if not isinstance(neuron, ContinuousGNM):
            raise ValueError(
                "chemistry needs a neuron in continuous time, a ContinuousAgent, got "
                f"{type(agent).__name__} with {neuron!r}; train one with --time continuous"
            )
        if neuron.eta != 0.0:
            raise ValueError(
                f"chemistry needs a neuron with eta = 0, got eta = {neuron.eta:g}: "
                "the decay by R is no simple reaction; train with eta=0"
            )
        if conversion is None:
            conversion = getattr(neuron, "conversion", CONVERSION)
        return cls(agent.weights, neuron.alpha, conversion, neuron.theta_r)

    @property
    def n_inputs(self) -> int:
        """N, number of input species."""
        return len(self.weights)
