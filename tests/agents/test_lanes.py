"""One formula serves one neuron and many: every operator gives each lane NumPy's float64 bits."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from agents.simd import (
    WHOLE,
    any_lane,
    full,
    lanes_of,
    like,
    load,
    multiply_add,
    negated,
    next_lane,
    pack,
    power,
    repeated,
    seldom,
    store,
    times_two_to_the,
    unpack,
    where,
)

WIDTHS = (1, 8, 32)
ROWS = 64


class Triple(NamedTuple):
    a: Any
    b: Any
    c: Any


# One entry per row that `_operators` writes; x, y are the lanes, s a plain float, n a whole number.
EXPECTED: dict[str, Any] = {
    "x + y": lambda x, y, s, n: x + y,
    "x - y": lambda x, y, s, n: x - y,
    "x * y": lambda x, y, s, n: x * y,
    "x / y": lambda x, y, s, n: x / y,
    "x + s": lambda x, y, s, n: x + s,
    "s - x": lambda x, y, s, n: s - x,
    "x * n": lambda x, y, s, n: x * n,
    "n / x": lambda x, y, s, n: n / x,
    "x += y": lambda x, y, s, n: x + y,
    "x -= s": lambda x, y, s, n: x - s,
    "x *= y": lambda x, y, s, n: x * y,
    "x /= n": lambda x, y, s, n: x / n,
    "x >= y": lambda x, y, s, n: x >= y,
    "x > y": lambda x, y, s, n: x > y,
    "x <= s": lambda x, y, s, n: x <= s,
    "s < x": lambda x, y, s, n: s < x,
    "x == y": lambda x, y, s, n: x == y,
    "x != y": lambda x, y, s, n: x != y,
    "x == n": lambda x, y, s, n: x == n,
    "and": lambda x, y, s, n: (x > s) & (y > s),
    "or": lambda x, y, s, n: (x > s) | (y > s),
    "negated": lambda x, y, s, n: ~(x >= y),
    "where lanes": lambda x, y, s, n: np.where(x > y, x, y),
    "where plain": lambda x, y, s, n: np.where(x > y, s, y),
    "where both plain": lambda x, y, s, n: np.where(x > y, s, float(n)),
    "like": lambda x, y, s, n: np.full_like(x, s),
    "any_lane": lambda x, y, s, n: np.full_like(x, np.any(x > y)),
    "seldom lanes": lambda x, y, s, n: np.where(x > y, x, y),
    "seldom plain": lambda x, y, s, n: np.where(x > y, s, float(n)),
    "formula": lambda x, y, s, n: (x + s - 0.3 * y) * x / (1.0 + y),
}


def _operators(width: int) -> Any:
    @njit(error_model="numpy")
    def run(X: NDArray[Any], Y: NDArray[Any], s: float, n: int, out: NDArray[Any]) -> None:
        zero = full(0.0, width)
        for r in range(len(X)):
            x, y, o = load(X, r, zero), load(Y, r, zero), out[r]
            store(o, 0, x + y)
            store(o, 1, x - y)
            store(o, 2, x * y)
            store(o, 3, x / y)
            store(o, 4, x + s)
            store(o, 5, s - x)
            store(o, 6, x * n)
            store(o, 7, n / x)
            z = x
            z += y
            store(o, 8, z)
            z = x
            z -= s
            store(o, 9, z)
            z = x
            z *= y
            store(o, 10, z)
            z = x
            z /= n
            store(o, 11, z)
            store(o, 12, where(x >= y, 1.0, zero))
            store(o, 13, where(x > y, 1.0, zero))
            store(o, 14, where(x <= s, 1.0, zero))
            store(o, 15, where(s < x, 1.0, zero))
            store(o, 16, where(x == y, 1.0, zero))
            store(o, 17, where(x != y, 1.0, zero))
            store(o, 18, where(x == n, 1.0, zero))
            store(o, 19, where((x > s) & (y > s), 1.0, zero))
            store(o, 20, where((x > s) | (y > s), 1.0, zero))
            store(o, 21, where(negated(x >= y), 1.0, zero))
            store(o, 22, where(x > y, x, y))
            store(o, 23, where(x > y, s, y))
            store(o, 24, where(x > y, s, float(n)))
            store(o, 25, like(s, x))
            store(o, 26, like(1.0 if any_lane(x > y) else 0.0, x))
            store(o, 27, seldom(x > y, x, y))
            store(o, 28, seldom(x > y, s, float(n)))
            store(o, 29, (x + s - 0.3 * y) * x / (1.0 + y))

    return run


def _containers(width: int) -> Any:
    @njit(error_model="numpy")
    def run(block: NDArray[Any], out: NDArray[Any], exponents: NDArray[Any]) -> None:
        zero = full(0.0, width)
        t = unpack(Triple, block, zero)
        pack(out, Triple(t.c, t.a, t.b))
        pack(out[3:], repeated(Triple, t.b))
        store(out, 6, power(t.a * t.a, load(exponents, 0, zero)))

    return run


@pytest.fixture(scope="module", params=WIDTHS)
def width(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def numbers(width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two tables of ordinary and of awkward numbers, many of them equal in both."""
    rng = np.random.default_rng(width)
    awkward = np.array([0.0, -0.0, 1.0, -1.0, 5e-324, 1e308, -1e308, np.inf, -np.inf, np.nan, 0.7])
    x = rng.standard_normal((ROWS, width)) * 10.0 ** rng.integers(-5, 5, (ROWS, width))
    y = np.where(rng.random(x.shape) < 0.2, x, rng.standard_normal(x.shape))
    x = np.where(rng.random(x.shape) < 0.3, rng.choice(awkward, x.shape), x)
    y = np.where(rng.random(x.shape) < 0.3, rng.choice(awkward, x.shape), y)
    return x, y


@pytest.fixture(scope="module")
def results(width: int, numbers: Any) -> NDArray[np.float64]:
    out = np.empty((ROWS, len(EXPECTED), width))
    _operators(width)(*numbers, 0.7, 3, out)
    return out


def _same_bits(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    both_nan = np.isnan(a) & np.isnan(b)
    return bool(np.all(both_nan | (a.view(np.int64) == b.view(np.int64))))


@pytest.mark.parametrize("name", EXPECTED)
def test_an_operator_gives_each_lane_the_bits_of_numpy(
    name: str, results: NDArray[np.float64], numbers: Any
) -> None:
    place = list(EXPECTED).index(name)
    for r, (x, y) in enumerate(zip(*numbers, strict=True)):
        with np.errstate(all="ignore"):
            expected = np.asarray(EXPECTED[name](x, y, 0.7, 3), np.float64)
        assert _same_bits(results[r, place], expected), (x, y)


def test_named_tuples_are_packed_and_unpacked_row_by_row_also_from_a_slice_of_lanes(
    width: int,
) -> None:
    """Blocks are cut into pieces of lanes: rows of a piece do not follow each other in memory."""
    rng = np.random.default_rng(3)
    whole, out = rng.random((3, 2 * width + 1)), np.zeros((7, 2 * width))
    part = whole[:, 1 : 1 + width]
    exponents = rng.uniform(0.3, 250.0, (1, width))
    _containers(width)(part, out[:, width:], exponents)
    assert np.array_equal(out[:6, width:], part[[2, 0, 1, 1, 1, 1]])
    # The C library's pow; NumPy may use another on processors with wide vectors.
    powers = [math.pow(x * x, y) for x, y in zip(part[0], exponents[0], strict=True)]
    assert np.array_equal(out[6, width:], powers)
    assert not out[:, :width].any()


def _bits(width: int) -> Any:
    @njit(error_model="numpy")
    def run(block: NDArray[Any], out: NDArray[Any], lanes: NDArray[Any]) -> int:
        zero = full(0.0, width)
        x, y, z = load(block, 0, zero), load(block, 1, zero), load(block, 2, zero)
        store(out, 0, multiply_add(x, y, z))
        store(out, 1, multiply_add(x, 0.7, 3.0))
        store(out, 2, times_two_to_the(x, load(block, 3, zero) + WHOLE))
        left, found = lanes_of(y > z), 0
        while left != 0:
            lanes[found] = next_lane(left)
            found += 1
            left &= left - 1
        return found

    return run


def test_a_product_and_sum_is_rounded_once_powers_of_two_are_exact_and_lanes_are_named(
    width: int,
) -> None:
    run, rng = _bits(width), np.random.default_rng(5)
    for _ in range(20):
        block = rng.standard_normal((4, width))
        block[2] = -block[0] * block[1] * (1.0 + 1e-16)  # what is left is rounding
        block[3] = rng.integers(-60, 61, width)
        out, lanes = np.empty((3, width)), np.empty(width, np.int64)
        found = run(block, out, lanes)
        x, y, z, n = ([Fraction(float(value)) for value in row] for row in block)
        once = [float(a * b + c) for a, b, c in zip(x, y, z, strict=True)]
        assert np.array_equal(out[0], once)
        plain = [float(a * Fraction(0.7) + 3) for a in x]
        assert np.array_equal(out[1], plain)
        assert np.array_equal(
            out[2], [math.ldexp(float(a), int(k)) for a, k in zip(x, n, strict=True)]
        )
        assert lanes[:found].tolist() == np.flatnonzero(block[1] > block[2]).tolist()
