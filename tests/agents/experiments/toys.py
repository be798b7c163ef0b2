"""A cheap experiment for tests of the machinery: the numbers depend on the settings alone."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Block, Experiment, Variable


def toy(
    *, seeds: int = 3, pause: float = 0.0, bonus: float = 0.0, compute: Any = None
) -> Experiment:
    """3 × `seeds` × 5 cells in 6 · seeds blocks; each block sleeps `pause` seconds."""
    axes = (
        Axis("classes", (1, 2, 3)),
        Axis("pattern_seed", tuple(range(seeds))),
        Axis("alpha", (0.0, 0.25, 0.5, 0.75, 1.0), chunk=3, units="1/bin"),
    )
    variables = (
        Variable("survived", "int32", "bins", "bins survived", ("run",)),
        Variable("error_rate", "float64", "1", "error rate"),
    )
    common = {"pause": pause, "bonus": bonus}
    return Experiment(
        "toy", "A toy", axes, common, compute or work, variables, {"run": 4}, {"trials": 10}
    )


def work(block: Block) -> dict[str, NDArray[Any]]:
    """Numbers that a seed makes of each setting."""
    time.sleep(block.settings[0]["pause"])
    rows = [_numbers(setting) for setting in block.settings]
    return {
        "survived": np.array([row[:4] * 1e4 for row in rows])
        .astype(np.int64)
        .reshape(*block.shape, 4),
        "error_rate": np.array([row[4] for row in rows]).reshape(block.shape),
    }


def _numbers(setting: dict[str, Any]) -> NDArray[np.float64]:
    seed = (setting["classes"], setting["pattern_seed"], int(100 * setting["alpha"]))
    return np.random.default_rng(seed).random(5) + setting["bonus"]
