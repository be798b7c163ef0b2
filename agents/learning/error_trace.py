"""Error-trace learning (ET): the timing of the errors is known at the end of the trial."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import Outcome, Rule, RuleParameters
from agents.simd import like, load, store, where
from gnm_env.compiled import compiled


@compiled
def correction(outcome: Outcome) -> Any:
    """1 where the error trace is anything but zero."""
    return where(outcome.blamed, 1.0, like(0.0, outcome.emitted))


@compiled
def teaching_signal(mode: tuple[int, ...], V: Any, E: Any) -> Any:
    """ε_i = Σ_t x_i(t) E(t); modulated, E(t) V(t) takes the place of E(t)."""
    return E * V if mode[0] == 1 else E


@compiled
def weight_change(
    p: RuleParameters,
    mode: tuple[int, ...],
    blamed: Any,
    eligibility: NDArray[np.float64],
) -> None:
    """Δ_i = λ ε_i, in place."""
    for i in range(len(eligibility)):
        store(eligibility, i, p.learning_rate * load(eligibility, i, blamed))


@dataclass(frozen=True)
class ErrorTrace(Rule):
    """Error-trace learning (ET) of Fil & Chu.

    The error trace E(t) is, over each occurrence of a pattern, the spikes that it is owed less
    those given in it; over noise −1 in every bin in which the readout is at or above the threshold.
    Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ, weight change per unit of eligibility.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        modulate: multiply E(t) by the membrane potential V(t). Learns better on two and more
            classes, but cannot leave V = 0: all weights 0 stay there.
        trace_decay: decay factor per bin of the presynaptic trace in place of the neuron's own
            response (None); 0 reads the paper's ∫ I_i E dt literally.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    modulate: bool = False
    trace_decay: float | None = None

    name: ClassVar[str] = "et"
    uses_error: ClassVar[bool] = True
    correction: ClassVar[Any] = correction
    teaching_signal: ClassVar[Any] = teaching_signal
    weight_change: ClassVar[Any] = weight_change

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.modulate, (bool, np.bool_)):
            raise ValueError(f"modulate must be True or False, got {self.modulate!r}")

    def mode(self, n_inputs: int) -> tuple[int, ...]:
        return (int(self.modulate),)
