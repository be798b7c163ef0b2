"""The logistic function beside SciPy's, and the same bits at every width."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray
from scipy.special import expit

from agents.learning.logistic import logistic
from agents.simd import full, load, store

X = np.concatenate([np.linspace(-40.0, 40.0, 4_001), np.linspace(-1.0, 1.0, 1_007)])


def _side_by_side(width: int) -> Any:
    @njit(error_model="numpy")
    def run(x: NDArray[Any], out: NDArray[Any]) -> None:
        for row in range(len(x)):
            store(out, row, logistic(load(x, row, full(0.0, width))))

    return run


def test_it_is_right_to_a_part_in_a_million_million() -> None:
    np.testing.assert_allclose([logistic(x) for x in X], expit(X), rtol=1e-12)
    assert logistic(0.0) == 0.5


def test_beyond_40_it_stays_what_it_is_there() -> None:
    assert logistic(-1e300) == logistic(-40.0) > 0.0
    assert logistic(1e300) == logistic(40.0) == 1.0
    assert np.isnan(logistic(np.nan))


@pytest.mark.parametrize("width", [8, 32])
def test_every_lane_has_the_bits_of_one_number_alone(width: int) -> None:
    x = np.resize(X, (200, width))
    out = np.empty_like(x)
    _side_by_side(width)(x, out)
    assert np.array_equal(out, [[logistic(one) for one in row] for row in x])
