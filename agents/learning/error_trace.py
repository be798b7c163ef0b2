"""Error-trace learning (ET), and the error trace itself: where in a trial the errors were."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from agents.learning.rule import Rule, average_option, decay_option
from agents.simd import load
from gnm_env.compiled import inlined


@inlined
def error_at(target: Any, counts: Any, above: Any, segment: int, t: int, zero: Any) -> Any:
    """The error trace E(t) in bin t of a segment.

    Over each presentation what it is owed less what was given in it; over noise −1 in every bin in
    which the readout is at or above the threshold.
    """
    if segment % 2 == 1:
        return float(target[segment]) - load(counts, segment, zero)
    return zero - load(above, t, zero)


@inlined
def teaching_signal(static: tuple[int, ...], V: Any, E: Any) -> Any:
    """ε_i = Σ_t x_i(t) E(t); modulated, E(t) V(t) takes the place of E(t)."""
    return E * V if static[0] == 1 else E


@dataclass(frozen=True)
class ErrorTrace(Rule):
    """Error-trace learning (ET) of Fil & Chu.

    The error trace E(t) is, over each presentation of a pattern, the spikes that it is owed less
    those given in it; over noise −1 in every bin in which the readout is at or above the threshold.
    Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ, weight change per unit of eligibility.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        modulate: multiply E(t) by the membrane potential V(t). Learns better on two and more
            classes, but cannot leave V = 0: all weights 0 stay there.
        trace_decay: decay factor per bin of the presynaptic trace in place of the neuron's own
            response (None); 0 reads the paper's ∫ I_i E dt literally.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    modulate: bool = False
    trace_decay: float | None = None
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

    name: ClassVar[str] = "et"
    feedback: ClassVar[str] = "presentations"
    uses_error: ClassVar[bool] = True
    teaching_signal: ClassVar[Any] = teaching_signal

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.modulate, (bool, np.bool_)):
            raise ValueError(f"modulate must be True or False, got {self.modulate!r}")

    def static(self, n_inputs: int) -> tuple[int, ...]:
        return (int(self.modulate),)
