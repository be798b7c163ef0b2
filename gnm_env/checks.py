"""Checks that parameter classes share. Each refusal names the field, the value and the remedy."""

from __future__ import annotations

import math
import numbers
import operator
from typing import Any


def whole(name: str, value: Any, low: int, high: int | None = None) -> int:
    """`value` as an int in low … high (inclusive; None: no upper end), or ValueError."""
    try:
        if isinstance(value, bool):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise ValueError(f"{name} must be a whole number, got {value!r}") from None
    if number < low or (high is not None and number > high):
        bound = f">= {low}" if high is None else f"in {low} … {high}"
        raise ValueError(f"{name} must be {bound}, got {number}")
    return number


def real(
    name: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    above: float | None = None,
    finite: bool = True,
) -> float:
    """`value` as a float in low … high, strictly greater than `above` if given, or ValueError."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{name} must be a number, got {value!r}")
    number = float(value)
    if math.isnan(number) or (finite and math.isinf(number)):
        raise ValueError(f"{name} must be finite, got {number}")
    if above is not None and not number > above:
        raise ValueError(f"{name} must be > {above:g}, got {number!r}")
    if number < low or number > high:
        bound = f">= {low:g}" if math.isinf(high) else f"in {low:g} … {high:g}"
        raise ValueError(f"{name} must be {bound}, got {number!r}")
    return number


def choice(name: str, value: Any, options: tuple[str, ...]) -> str:
    """`value` if it is one of `options`, or ValueError."""
    if value not in options:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, options))}, got {value!r}")
    return str(value)
