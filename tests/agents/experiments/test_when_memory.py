"""WHEN and HIDDEN: what is heard in each situation, and that their blocks train."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agents.experiments.listing import experiment
from agents.experiments.when_memory import SITUATIONS, patterns_of, silent_score, task_of
from gnm_env import Patterns, Task


def test_the_wanted_pattern_is_the_same_in_every_situation() -> None:
    wanted = Patterns.draw(Task(n_classes=2), 7).dense()[0]
    for name, situation in SITUATIONS.items():
        assert np.array_equal(patterns_of(situation, 7).dense()[0], wanted), name


def test_a_second_pattern_is_owed_nothing_and_shares_what_it_should() -> None:
    backwards = patterns_of(SITUATIONS["backwards"], 7).dense()
    assert np.array_equal(backwards[1], backwards[0][::-1])
    assert task_of(SITUATIONS["backwards"]).targets == (1, 0)
    shares, rates = [], []
    for seed in range(60):
        wanted, other = patterns_of(SITUATIONS["overlap 80 %"], seed).dense()
        shares.append((wanted & other).sum() / wanted.sum())
        rates.append(other.mean())
    assert np.mean(shares) == pytest.approx(0.8, abs=0.03)
    assert np.mean(rates) == pytest.approx(0.005, rel=0.06)


def test_silence_survives_longer_where_some_patterns_are_owed_nothing() -> None:
    """Drawn by the definition: noise, a pattern, until a wanted one has ended."""
    rng, task = np.random.default_rng(1), Task()
    bins = []
    for _ in range(20_000):
        heard = 0
        while True:
            heard += rng.geometric(task.onset_probability) - 1 + task.pattern_bins
            if rng.random() < 0.5:
                break
        bins.append(heard - 1)
    assert silent_score(SITUATIONS["backwards"]) == pytest.approx(np.mean(bins), rel=0.03)
    assert silent_score(SITUATIONS["jitter 8"]) == task.silent_score


@pytest.mark.slow
@pytest.mark.parametrize("name", ["WHEN", "HIDDEN"])
def test_every_block_of_the_quick_size_trains_and_is_scored(name: str) -> None:
    wanted = experiment(name, "quick", (3,))
    for block in wanted.blocks():
        short = tuple({**one, "trials": 40, "cap": 200} for one in block.settings)
        made = wanted.compute(replace(block, settings=short))
        assert (made["survived"] >= 0).all()
