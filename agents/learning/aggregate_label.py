"""Aggregate-label learning (ALL): only "too many" or "too few" is known, and only at the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import Rule, RuleParameters, average_option, decay_option
from agents.simd import any_lane, like, load, store, where
from gnm_env.checks import real
from gnm_env.compiled import compiled, inlined

_INSERTED = 20
"""Up to this many of the largest eligibilities are found by insertion, more by cuts."""

_FEW, _CUTS = 16.0, 8
"""Cuts count all values until at most so many are left in each lane, or so often."""


@inlined
def teaching_signal(static: tuple[int, ...], V: Any, E: Any) -> Any:
    """ε_i = Σ_t x_i(t) V(t)."""
    return V


@inlined
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
    bar = nth_largest(eligibility, count, sign != 0.0, step)
    for i in range(len(eligibility)):
        store(eligibility, i, where(load(eligibility, i, step) > bar, step, like(0.0, step)))


@compiled
def nth_largest(values: NDArray[np.float64], n: int, learns: Any, lanes: Any) -> Any:
    """A number as good as the (n+1)-th largest value: the same values lie strictly above both.

    In the lanes that `learns` names; `lanes` says how many there are.
    """
    if n > _INSERTED:
        return _between(values, n, learns, lanes)
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


@inlined
def _between(values: NDArray[np.float64], n: int, learns: Any, lanes: Any) -> Any:
    """`nth_largest` in O(N) whatever n, in all lanes at once: cuts between the lowest and highest.

    low <= the (n+1)-th largest <= high throughout. A cut with exactly n values above it is as good
    as that value and ends the search. Once few values are left between low and high, their rows are
    taken aside; from then on low and high are values themselves, so that ties end it as well.
    """
    zero = like(0.0, lanes)
    low, high = _extremes(values, lanes)
    above_low, above_high = like(float(len(values)), lanes), zero
    cut = low  # at once the answer where most eligibilities are 0
    cuts = 0
    while cuts < _CUTS and any_lane(learns & (low < high) & (above_low - above_high > _FEW)):
        above = _count_above(values, cut)
        few = above <= n
        low, high = where(few, low, cut), where(few, cut, high)
        above_low, above_high = where(few, above_low, above), where(few, above, above_high)
        low = where(above == n, high, low)
        cuts += 1
        cut = _next_cut(low, high, above_low, above_high, n, cuts)
    if not any_lane(learns & (low < high)):
        return high
    rest = np.empty_like(values)
    rows = 0
    for i in range(len(values)):
        x = load(values, i, lanes)
        store(rest, rows, x)
        rows += any_lane(learns & (low < high) & (low <= x) & (x <= high))
    while any_lane(learns & (low < high)):
        above, nearest_below, nearest_above = above_high, low, high
        for i in range(rows):
            x = load(rest, i, lanes)
            over = x > cut
            above = above + where(over & (x <= high), 1.0, zero)
            x_above, x_below = where(over, x, high), where(over, low, x)
            nearest_above = where(x_above < nearest_above, x_above, nearest_above)
            nearest_below = where(x_below > nearest_below, x_below, nearest_below)
        few = above <= n
        low, high = where(few, low, nearest_above), where(few, nearest_below, high)
        above_low, above_high = where(few, above_low, above), where(few, above, above_high)
        low = where(above == n, high, low)
        cuts += 1
        cut = _next_cut(low, high, above_low, above_high, n, cuts)
    return high


@inlined
def _extremes(values: NDArray[np.float64], lanes: Any) -> tuple[Any, Any]:
    """The lowest and the highest of the values, in each lane."""
    low, high = like(np.inf, lanes), like(-np.inf, lanes)
    for i in range(len(values)):
        x = load(values, i, lanes)
        low, high = where(x < low, x, low), where(x > high, x, high)
    return low, high


@compiled
def _count_above(values: NDArray[np.float64], cut: Any) -> Any:
    """How many values lie above the cut, in each lane."""
    zero = like(0.0, cut)
    count = zero
    whole = len(values) - len(values) % 4
    for i in range(0, whole, 4):  # four at a time: a sum has to wait for the one before it
        a = where(load(values, i, cut) > cut, 1.0, zero)
        b = where(load(values, i + 1, cut) > cut, 1.0, zero)
        c = where(load(values, i + 2, cut) > cut, 1.0, zero)
        d = where(load(values, i + 3, cut) > cut, 1.0, zero)
        count = count + ((a + b) + (c + d))
    for i in range(whole, len(values)):
        count = count + where(load(values, i, cut) > cut, 1.0, zero)
    return count


@inlined
def _next_cut(low: Any, high: Any, above_low: Any, above_high: Any, n: int, cuts: int) -> Any:
    """Where n values would lie above if they lay evenly; every other time the middle."""
    share = like(0.5, low) if cuts % 2 == 0 else (n + 0.5 - above_high) / (above_low - above_high)
    cut = high - share * (high - low)
    return where((low <= cut) & (cut < high), cut, low)


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
        average_over: first and last trial, counted from 1, of those after which the weights
            count for a mean, which they become after the last; None: no averaging.
    """

    learning_rate: float = 1e-4
    momentum: float = 0.2
    fraction: float = 0.1
    trace_decay: float | None = None
    decay_trials: int | None = decay_option()
    average_over: tuple[int, int] | None = average_option()

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
