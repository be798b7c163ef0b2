"""`scripts/same_neuron.py`: every way to teach the neuron, at equal experience."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")

import same_neuron
from agents.commands.terminal import parse


@pytest.mark.slow
def test_each_way_is_trained_and_scored_on_each_pattern_seed() -> None:
    told = same_neuron.main(parse(same_neuron, ["--seeds", "50,51", "--bins", 20_000]))
    assert set(told["scores"]) == {
        *same_neuron.RULES,
        *(f"{kind}, {feedback}" for kind, feedback in same_neuron.RL),
    }
    assert all(len(scores) == 2 and min(scores) > 0 for scores in told["scores"].values())
