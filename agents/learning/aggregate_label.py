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

_BEFORE, _HIGH_PLACE, _LOW_PLACE = 8, 2, 13
"""A sample is so large that 6 to 8 of its values are to be expected above the one that is sought;
which then lies between these two of its places, counted from 0, some 19 times in 20."""


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
    bar = nth_largest(eligibility, static, sign != 0.0, step)
    for i in range(len(eligibility)):
        store(eligibility, i, where(load(eligibility, i, step) > bar, step, like(0.0, step)))


@compiled
def nth_largest(
    values: NDArray[np.float64], static: tuple[int, ...], learns: Any, lanes: Any
) -> Any:
    """A number as good as the (n+1)-th largest value: the same values lie strictly above both.

    In the lanes that `learns` names; `lanes` says how many there are. `static` is that of the rule,
    n first: by its length alone one way is chosen, and the other is not compiled.
    """
    if len(static) > 1:
        return _between(values, static[0], learns, lanes)
    return load(_largest(values, static[0], lanes), static[0], lanes)


@compiled
def _largest(values: NDArray[np.float64], n: int, lanes: Any) -> NDArray[np.float64]:
    """The n + 1 largest values of each lane, descending; −∞ where there are not as many.

    Every value sinks to its place, four at a time so that the list is read and written once for
    four values.
    """
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
    return largest


@inlined
def _between(values: NDArray[np.float64], n: int, learns: Any, lanes: Any) -> Any:
    """`nth_largest` in O(N) whatever n, in all lanes at once (after Floyd & Rivest 1975).

    A sample says between which two numbers the value lies in all likelihood. One look at all values
    tells whether it does, and takes aside what is between them, which a few cuts go through.
    """
    sample = _largest(values[:: n // _BEFORE + 1], _LOW_PLACE, lanes)
    low = where(learns, load(sample, _LOW_PLACE, lanes), np.inf)
    high = where(learns, load(sample, _HIGH_PLACE, lanes), -np.inf)
    rest = np.empty((len(values), values.shape[1]))
    rows, from_low, above_high = _taken_aside(values, low, high, rest)
    missed = learns & ((from_low <= n) | (above_high > n))
    if any_lane(missed):
        lowest, highest = _extremes(values, lanes)
        low, high = where(missed, lowest, low), where(missed, highest, high)
        rows, from_low, above_high = _taken_aside(values, low, high, rest)
    return _by_cuts(rest, rows, low, high, from_low, above_high, n)


@compiled
def _taken_aside(
    values: NDArray[np.float64], low: Any, high: Any, rest: NDArray[np.float64]
) -> tuple[int, Any, Any]:
    """Copy into `rest` the rows in which some lane has a value from low to high.

    Returns their number and, of all values, how many are at least low and how many above high.
    """
    zero = like(0.0, low)
    from_low, above_high = zero, zero
    rows = 0
    for i in range(len(values)):
        x = load(values, i, zero)
        store(rest, rows, x)
        rows += any_lane((low <= x) & (x <= high))
        from_low = from_low + where(low <= x, 1.0, zero)
        above_high = above_high + where(x > high, 1.0, zero)
    return rows, from_low, above_high


@inlined
def _extremes(values: NDArray[np.float64], lanes: Any) -> tuple[Any, Any]:
    """The lowest and the highest of the values, in each lane."""
    low, high = like(np.inf, lanes), like(-np.inf, lanes)
    for i in range(len(values)):
        x = load(values, i, lanes)
        low, high = where(x < low, x, low), where(x > high, x, high)
    return low, high


@inlined
def _by_cuts(
    rest: NDArray[np.float64],
    rows: int,
    low: Any,
    high: Any,
    from_low: Any,
    above_high: Any,
    n: int,
) -> Any:
    """The (n+1)-th largest value of each lane, where `rest` has those from low to high; uses it up.

    low <= the value <= high throughout; `from_low` values are at least low, `above_high` are above
    high. After each cut low and high are values themselves, so that ties end the search; rows in
    which no lane has a value between them are left out.
    """
    zero = like(0.0, low)
    cuts = 0
    while any_lane(low < high):
        # Where n values would lie above if they lay evenly; every other time the middle.
        share = like(0.5, low) if cuts % 2 else (n + 0.5 - above_high) / (from_low - above_high)
        cut = high - share * (high - low)
        cut = where((low <= cut) & (cut < high), cut, low)
        cuts += 1
        bottom = where(low < high, low, np.inf)  # nothing is inside where the value is found
        above, nearest_below, nearest_above = above_high, low, high
        before, rows = rows, 0
        for i in range(before):
            x = load(rest, i, zero)
            inside = (bottom <= x) & (x <= high)
            x = where(inside, x, -np.inf)
            store(rest, rows, x)
            rows += any_lane(inside)
            over = x > cut
            above = above + where(over, 1.0, zero)
            x_above, x_below = where(over, x, high), where(over, low, x)
            nearest_above = where(x_above < nearest_above, x_above, nearest_above)
            nearest_below = where(x_below > nearest_below, x_below, nearest_below)
        few = above <= n
        low, high = where(few, low, nearest_above), where(few, nearest_below, high)
        from_low, above_high = where(few, from_low, above), where(few, above, above_high)
        low = where(above == n, high, low)
    return high


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
        return (count, n_inputs) if count > _INSERTED else (count,)
