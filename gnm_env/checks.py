"""Checks that public classes share. Each refusal names the field, the value and the remedy.

What enters compiled code has been checked here: lengths, ranges, order, type, finiteness, and that
the memory is there. Inside, nobody checks again.
"""

from __future__ import annotations

import dataclasses
import math
import numbers
import operator
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_INPUTS = 100_000_000
"""Most input channels."""

MAX_BINS = 1_000_000_000
"""Most bins of one trial: 11 days in milliseconds."""

MAX_TARGET = 1_000_000_000
"""Most output spikes that one presentation may be owed."""

MAX_LABEL = 1_000_000_000_000_000
"""Most output spikes that a trial may be owed: exact in a float64, with room for errors."""

MAX_SEED = 2**128 - 1
"""Largest seed, as many bits as NumPy recommends; and the largest whole number of any kind."""

VERY_MANY = 100_000
"""An upper limit beyond it is named only when it is exceeded."""

SMALL_BYTES = 2**26
"""Arrays up to this size are allocated without asking how much memory there is."""


def shown(value: Any) -> str:
    """`value` for a message: one line, not too long, whatever it is."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an int of thousands of digits, an object with a broken repr
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:76]} …"


def brief(record: Any) -> str:
    """A dataclass by the fields that are not at their defaults: `GNM(alpha=0.1)`; else its repr."""
    if not dataclasses.is_dataclass(record) or isinstance(record, type):
        return repr(record)
    told = [
        f"{field.name}={value}"
        for field in dataclasses.fields(record)
        if field.repr and (value := repr(getattr(record, field.name))) != repr(field.default)
    ]
    return f"{type(record).__name__}({', '.join(told)})"


def whole(name: str, value: Any, low: int, high: int | None = None) -> int:
    """`value` as an int in low … high (inclusive; None: MAX_SEED), or ValueError.

    A high beyond VERY_MANY is no part of what a number means: it is told to those who exceed it.
    """
    try:
        if isinstance(value, bool):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise ValueError(f"{name} must be a whole number, got {shown(value)}") from None
    high = MAX_SEED if high is None else high
    if low <= number <= high:
        return number
    if high <= VERY_MANY:
        bound = f"in {low} … {high}"
    else:
        bound = f">= {low}" if number < low else f"at most {high:,}"
    raise ValueError(f"{name} must be {bound}, got {shown(number)}")


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
        raise ValueError(f"{name} must be a number, got {shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        raise ValueError(f"{name} must be finite, got {shown(value)}") from None
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
    if not isinstance(value, str) or value not in options:
        raise ValueError(
            f"{name} must be one of {', '.join(map(repr, options))}, got {shown(value)}"
        )
    return str(value)


def flag(name: str, value: Any) -> bool:
    """`value` if it is True or False, or ValueError: texts and numbers say neither."""
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def whole_array(
    name: str, values: Any, low: int, high: int, dtype: type = np.int64
) -> NDArray[Any]:
    """`values` as a new, contiguous array (n,) of whole numbers in low … high, or ValueError."""
    try:
        array = np.asarray(values)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a row of whole numbers, got {shown(values)}") from None
    if array.ndim != 1:
        raise ValueError(f"{name} must be a row of whole numbers, got shape {array.shape}")
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must be whole numbers, got {array.dtype} values")
    if array.size and not (low <= array.min() and array.max() <= high):
        k = int(np.argmax((array < low) | (array > high)))
        raise ValueError(f"{name} must lie in {low} … {high}, got {array[k]} at place {k}")
    return np.array(array, dtype, order="C")


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A view of a contiguous `array` that cannot be written to, and not be made writeable either.

    A view whose flag alone says so could be: it would be enough to set the flag.
    """
    return np.asarray(array.data.toreadonly())


def generator(name: str, value: Any) -> np.random.Generator:
    """`value` if it is a NumPy Generator, else ValueError."""
    if not isinstance(value, np.random.Generator):
        raise ValueError(
            f"{name} must be a numpy.random.Generator, got {shown(value)}; "
            "use numpy.random.default_rng(seed)"
        )
    return value


def bytes_there() -> float:
    """Memory of this machine, or of its container; infinite where the system does not tell."""
    try:
        there = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf
        return math.inf
    try:
        return min(there, float(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no container, or one without a limit ("max")
        return there


def require_memory(name: str, n_bytes: float, remedy: str) -> None:
    """ValueError, before anything is allocated, if `name` of `n_bytes` exceeds the memory."""
    if n_bytes > SMALL_BYTES and n_bytes > bytes_there():
        raise ValueError(
            f"{name} needs {n_bytes / 2**30:,.1f} GiB, "
            f"this machine has {bytes_there() / 2**30:,.1f}: {remedy}"
        )
