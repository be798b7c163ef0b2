"""Aggregate-label learning (ALL): only "too many" or "too few" is known, and only at the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import Rule, RuleParameters, decay_option
from agents.simd import like, load, store, where
from gnm_env.checks import real
from gnm_env.compiled import compiled

_INSERTED = 48
"""Up to this many of the largest eligibilities are found by insertion, more by selection."""


@compiled
def teaching_signal(static: tuple[int, ...], V: Any, E: Any) -> Any:
    """ε_i = Σ_t x_i(t) V(t)."""
    return V


@compiled
def weight_change(
    p: RuleParameters,
    static: tuple[int, ...],
    sign: Any,
    eligibility: NDArray[np.float64],
) -> None:
    """Δ_i = ±λ for every i with ε_i strictly above the (k+1)-th largest ε, else 0; in place."""
    count = static[0]
    step = sign * p.learning_rate
    if count >= len(eligibility):
        for i in range(len(eligibility)):
            store(eligibility, i, step)
        return
    bar = nth_largest(eligibility, count, step)
    for i in range(len(eligibility)):
        store(eligibility, i, where(load(eligibility, i, step) > bar, step, like(0.0, step)))


@compiled
def nth_largest(values: NDArray[np.float64], n: int, lanes: Any) -> Any:
    """The value with exactly n values before it in descending order, in the lanes of `lanes`."""
    if n > _INSERTED:
        return _selected(values, n, lanes)
    # The n + 1 largest so far, descending; every value sinks to its place, four at a time so that
    # the list is read and written once for four values.
    largest = np.full((n + 1, values.shape[1]), -np.inf)
    whole = len(values) - len(values) % 4
    for i in range(0, whole, 4):
        a, b = load(values, i, lanes), load(values, i + 1, lanes)
        c, d = load(values, i + 2, lanes), load(values, i + 3, lanes)
        for k in range(n + 1):
            place = load(largest, k, lanes)
            place, a = where(a > place, a, place), where(a > place, place, a)
            place, b = where(b > place, b, place), where(b > place, place, b)
            place, c = where(c > place, c, place), where(c > place, place, c)
            place, d = where(d > place, d, place), where(d > place, place, d)
            store(largest, k, place)
    for i in range(whole, len(values)):
        a = load(values, i, lanes)
        for k in range(n + 1):
            place = load(largest, k, lanes)
            store(largest, k, where(a > place, a, place))
            a = where(a > place, place, a)
    return load(largest, n, lanes)


@compiled
def _selected(values: NDArray[np.float64], n: int, lanes: Any) -> Any:
    """`nth_largest` in O(N) whatever n, a lane after the other: Hoare's selection."""
    bar = np.empty((1, values.shape[1]))
    rest = np.empty(len(values))
    for lane in range(values.shape[1]):
        for i in range(len(values)):
            rest[i] = values[i, lane]
        low, high = 0, len(values) - 1
        while low < high:
            pivot = rest[(low + high) // 2]
            i, j = low, high
            while i <= j:
                while rest[i] > pivot:
                    i += 1
                while pivot > rest[j]:
                    j -= 1
                if i <= j:
                    rest[i], rest[j] = rest[j], rest[i]
                    i += 1
                    j -= 1
            if n <= j:
                high = j
            elif n >= i:
                low = i
            else:
                break
        bar[0, lane] = rest[n]
    return load(bar, 0, lanes)


@dataclass(frozen=True)
class AggregateLabel(Rule):
    """Aggregate-label learning (ALL), after Gütig 2016 and Fil & Chu.

    Raises ValueError if a parameter is out of range.

    Attributes:
        learning_rate: λ, weight change of each eligible input per learning step.
        momentum: fraction of the previous weight change that is added, 0 … 1.
        fraction: fraction of the inputs that is changed: those with the highest eligibility,
            k = round(fraction · N); 0.1 is the paper's ninth decile.
        trace_decay: decay factor per bin of the presynaptic trace in place of the neuron's own
            response (None); 0 reads the paper's ∫ I_i V dt literally.
        decay_trials: trials over which the learning rate falls to 0 in a line; None: constant.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    fraction: float = 0.1
    trace_decay: float | None = None
    decay_trials: int | None = decay_option()

    name: ClassVar[str] = "all"
    feedback: ClassVar[str] = "sign"
    teaching_signal: ClassVar[Any] = teaching_signal
    weight_change: ClassVar[Any] = weight_change

    def __post_init__(self) -> None:
        super().__post_init__()
        real("fraction", self.fraction, low=0.0, high=1.0)

    def static(self, n_inputs: int) -> tuple[int, ...]:
        count = round(self.fraction * n_inputs)
        if count == 0:
            raise ValueError(
                f"fraction {self.fraction:g} of {n_inputs} inputs is no input at all, and nothing "
                f"would be learned: choose fraction >= {0.51 / n_inputs:.3g}"
            )
        return (count,)
