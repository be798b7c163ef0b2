"""The direct search on weights: the same whatever else its process does, and no worse than ALL."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from agents.experiments.ceiling import NEURONS, evaluator, search

pytest.importorskip("cma")

SETTING: dict[str, Any] = {
    **NEURONS["GNM"],
    "classes": 1,
    "pattern_seed": 0,
    "weight_bounds": (0.0, 1.0),
    "candidates": 8,
    "streams": 4,
    "search_cap": 300,
}
START = np.full(100, 0.05)


def found(seed: int, generations: int = 6) -> NDArray[np.float64]:
    return search({**SETTING, "pattern_seed": seed}, START, 0.05, generations)


def test_searches_side_by_side_find_what_each_finds_alone() -> None:
    alone = [found(seed) for seed in range(4)]
    with ThreadPoolExecutor(4) as threads:
        np.testing.assert_array_equal(list(threads.map(found, range(4))), alone)


def test_what_is_found_keeps_its_bounds_and_survives_longer_than_the_start() -> None:
    weights = found(0, generations=60)
    assert weights.min() >= 0 and weights.max() <= 1
    before, after = evaluator(SETTING, 2)([START, weights], 50, 2_000, 7).mean(axis=1)
    assert after > 2 * before
