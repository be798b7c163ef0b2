"""The logistic function in compiled code, side by side, without a call of the C library."""

from __future__ import annotations

from typing import Any

from agents.simd import WHOLE, multiply_add, times_two_to_the, where
from gnm_env.compiled import compiled

LOG2_E = 1.4426950408889634
LN_2 = 0.6931471805599453


@compiled
def logistic(x: Any) -> Any:
    """1 / (1 + e^(−x)), x within −40 … 40, in steps that are the same in every lane.

    e^(−x) is 2^n e^r with a whole number n and |r| <= ln 2 / 2, and e^r the sum of its first eleven
    terms: right to a few parts in 10^13.
    """
    x = where(x < -40.0, -40.0, where(x > 40.0, 40.0, x))
    shifted = multiply_add(x, -LOG2_E, WHOLE)
    n = shifted - WHOLE
    r = multiply_add(x, -LOG2_E, -n) * LN_2
    power = multiply_add(r, 1.0 / 3628800.0, 1.0 / 362880.0)
    power = multiply_add(r, power, 1.0 / 40320.0)
    power = multiply_add(r, power, 1.0 / 5040.0)
    power = multiply_add(r, power, 1.0 / 720.0)
    power = multiply_add(r, power, 1.0 / 120.0)
    power = multiply_add(r, power, 1.0 / 24.0)
    power = multiply_add(r, power, 1.0 / 6.0)
    power = multiply_add(r, power, 0.5)
    power = multiply_add(r, power, 1.0)
    power = multiply_add(r, power, 1.0)
    return 1.0 / (1.0 + times_two_to_the(power, shifted))
