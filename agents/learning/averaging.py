"""Weight averaging: over the last part of training the weights wander about what they have learned,
and their mean is nearer to it than where they happen to end (Polyak & Juditsky 1992).

A rule with `average_over=(first, last)` learns as ever. The weights as they are after each of these
trials, counted from 1, whether it taught anything or not, are added up, and after the last of them
the weights become their mean. Learning then goes on from there; the velocity stays as it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import RuleParameters
from agents.simd import any_lane, load, store, unpack, where
from gnm_env.compiled import compiled, inlined


@inlined
def average(
    p: RuleParameters,
    number: Any,
    weights: NDArray[np.float64],
    total: NDArray[np.float64],
) -> None:
    """Count the weights after trial `number`, 0 in lanes that take no part; or make them the mean.

    Both arrays have one row per weight; `total` is the sum so far.
    """
    inside = (number >= p.average_first) & (number <= p.average_last)
    if any_lane(inside):
        zero = p.momentum * 0.0
        begins = number == p.average_first
        ends = inside & (number == p.average_last)
        count = p.average_last - p.average_first + 1.0
        for i in range(len(weights)):
            weight, before = load(weights, i, zero), load(total, i, zero)
            so_far = where(begins, zero, before) + weight
            store(total, i, where(inside, so_far, before))
            store(weights, i, where(ends, so_far / count, weight))


@compiled
def average_alone(
    parameters: NDArray[np.float64],
    number: float,
    weights: NDArray[np.float64],
    total: NDArray[np.float64],
) -> None:
    """As `average` for one model, whose rule's numbers are the first column of `parameters`."""
    average(unpack(RuleParameters, parameters, 0.0), number, weights, total)
