"""WHEN-RL: policies train in each situation, and one training has one result."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents.experiments.design import Block
from agents.experiments.listing import experiment

pytest.importorskip("stable_baselines3")


def short_blocks() -> list[Block]:
    """One training of each kind, in the first and the last situation."""
    wanted = experiment("WHEN-RL", "quick", (3,))
    blocks = [*wanted.blocks()]
    return [
        replace(block, settings=({**block.settings[0], "bins": 4_096, "cap": 100, "runs": 5},))
        for block in (blocks[0], blocks[2], blocks[-2])
    ]


@pytest.mark.slow
def test_a_training_gives_the_same_alone_and_beside_others() -> None:
    compute: Any = experiment("WHEN-RL", "quick").compute
    blocks = short_blocks()
    alone = [compute(block)["survived"] for block in blocks]
    with ThreadPoolExecutor(len(blocks)) as threads:
        beside = [made["survived"] for made in threads.map(compute, blocks)]
    for one, other in zip(alone, beside, strict=True):
        assert (one >= 0).all()
        assert np.array_equal(one, other)
