from __future__ import annotations

import json
from typing import Any

import pytest

from agents.experiments.design import Axis
from agents.experiments.listing import SIZES, experiment, experiments
from agents.experiments.training import evaluation_seed, training_seed
from tests.agents.experiments.toys import toy


def test_blocks_tile_the_grid_without_gap_or_overlap() -> None:
    wanted = toy(seeds=2)
    cells = [tuple(setting.items()) for block in wanted.blocks() for setting in block.settings]

    assert len(cells) == len(set(cells)) == wanted.cells == 3 * 2 * 5
    assert [block.shape for block in wanted.blocks()][:2] == [(1, 1, 3), (1, 1, 2)]
    assert [block.number for block in wanted.blocks()] == list(range(12))


def test_the_last_axis_runs_fastest() -> None:
    block = toy().blocks()[0]

    assert [setting["alpha"] for setting in block.settings] == [0.0, 0.25, 0.5]
    assert block.where == "classes 1, pattern_seed 0, alpha 0.0 … 0.5"


@pytest.mark.parametrize(
    ("values", "settings", "complaint"),
    [
        ((), (), "axis a must have at least one value"),
        ((1, 1), (), "axis a must not repeat a value"),
        ((1, 2), ({"b": 1},), "one mapping in `settings` per value, got 1 for 2 values"),
        ((1,), (3,), "axis a must have mappings in `settings`"),
        (3, (), "an axis needs a name and a tuple of values, got 'a' and 3"),
        (([1],), (), "axis a must have numbers or names as values"),
    ],
)
def test_an_axis_that_makes_no_sense_is_refused(values: Any, settings: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        Axis("a", values, settings=settings)


@pytest.mark.parametrize("chunk", [-1, 0.5, "x", None])
def test_a_block_takes_a_whole_number_of_values(chunk: Any) -> None:
    with pytest.raises(ValueError, match="chunk of the axis a must be"):
        Axis("a", (1, 2), chunk)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", experiments())
def test_settings_of_every_experiment_survive_json_and_tell_the_protocol(
    name: str, size: str
) -> None:
    wanted = experiment(name, size)
    settings = wanted.settings()

    assert json.loads(json.dumps(settings)) == settings
    assert settings["experiment"] == wanted.name == name
    if name not in ("F1", "BALANCE", "AS-LIF"):  # in which something is trained
        assert settings["protocol"]["task"]["rate"] == 0.005
        common = settings["common"]
        assert common.get("trials", max(common.get("checkpoints", [0]))) == 60_000
        assert set(settings["protocol"]["seeds"]) >= {"patterns", "initial weights", "training"}
    lanes = {len(block.settings) for block in wanted.blocks()}
    assert max(lanes) <= 256, "a block is a small part of the work"


def test_the_paper_size_is_the_papers() -> None:
    assert experiment("F3", "paper").cells == 41 * 41 * 5
    assert experiment("F4", "paper").cells == 2 * 3 * 41 * 41 * 5
    assert experiment("F7", "paper").axes[1].values == tuple(range(50))
    assert experiment("table", "paper").axes[1].values == tuple(range(48))
    refractory = [name for name in experiment("F6", "paper").axes[-1].values if name != "GNM"]
    assert refractory == [f"LIF {n}" for n in range(26)]


def test_seeds_may_be_chosen_and_are_checked() -> None:
    assert experiment("F3", "quick", (7, 9)).axes[1].values == (7, 9)
    with pytest.raises(ValueError, match=r"pattern seeds must be in 0 … 8999, got 9000"):
        experiment("F3", "quick", (9_000,))


def test_no_stream_is_heard_twice() -> None:
    """Training streams and the 100 streams of every evaluation have seeds of their own."""
    seeds = [training_seed(c, s) for c in range(1, 5) for s in range(9_000)]
    streams = {
        evaluation_seed(c, s) + k for c in range(1, 5) for s in range(200) for k in range(100)
    }

    assert len(set(seeds)) == len(seeds)
    assert len(streams) == 4 * 200 * 100
    assert not streams & set(seeds)
    assert max(seeds) < min(streams)
