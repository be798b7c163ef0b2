"""SurrogateGradient: errors times a smooth stand-in for the derivative of the spike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from agents.learning.rule import BinOfTrial, Rule, average_option, decay_option
from agents.model import Model
from agents.simd import any_lane, like, where
from gnm_env.checks import choice, real
from gnm_env.compiled import compiled


class Parameters(NamedTuple):
    """The rule's numbers."""

    k: Any
    triangle: Any
    """1 for the triangle, else 0."""


@compiled
def bin_signal(p: Parameters, b: BinOfTrial) -> Any:
    """y(t) = E(t) ψ(X(t))."""
    psi = like(0.0, b.X)
    if any_lane(b.E != 0.0):
        far = abs(b.X - b.threshold)
        if any_lane(p.triangle == 0.0):
            slope = 1.0 + p.k * far
            psi = 1.0 / (slope * slope)
        if any_lane(p.triangle != 0.0):
            left = 1.0 - far / b.threshold
            height = 0.3 / b.threshold * where(left > 0.0, left, like(0.0, b.X))
            psi = where(p.triangle != 0.0, height, psi)
    return b.E * psi


@dataclass(frozen=True)
class SurrogateGradient(Rule):
    """Gradient descent through the spike by a surrogate of its derivative.

    y(t) = E(t) ψ(X(t)), with ψ either 1 / (1 + k|X − ϑ|)², SuperSpike (Zenke & Ganguli 2018; norse,
    superspike.py, has k = 100), or the triangle (0.3/ϑ) max(0, 1 − |X − ϑ|/ϑ) of e-prop (Bellec et
    al. 2020). E(t) is that of ErrorTrace: over a presentation what it lacks, over noise −1 in bins
    at or above the threshold. With `on_count`, E is label − emitted in every bin. The trace leaves
    out that resets depend on the weights; ψ is a surrogate in any case.

    Feedback: where the presentations were and what each was owed; with `on_count` the error of the
    trial. On every neuron. The defaults were chosen on pattern seeds 0–15. Raises ValueError if a
    parameter is out of range.

    Attributes:
        learning_rate: λ; weights are best left unbounded.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        surrogate: "superspike" or "triangle".
        k: steepness of SuperSpike, per unit of the readout.
        on_count: learn from the error of the whole trial alone.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-2
    momentum: float = 0.2
    surrogate: str = "superspike"
    k: float = 5.0
    on_count: bool = False
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "surrogate"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True
    parameters_type: ClassVar[Any] = Parameters
    bin_signal: ClassVar[Any] = bin_signal

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("surrogate", self.surrogate, ("superspike", "triangle"))
        real("k", self.k, low=0.0)
        if not isinstance(self.on_count, (bool, np.bool_)):
            raise ValueError(f"on_count must be True or False, got {self.on_count!r}")
        if self.on_count:
            object.__setattr__(self, "feedback", "label")

    def own_numbers(self, model: Model) -> tuple[float, ...]:
        return (self.k, float(self.surrogate == "triangle"))
