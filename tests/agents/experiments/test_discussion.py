"""D1, D2, D3, D6, D7, F6c, S2: each rule on made-up numbers for and against it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents.experiments import discussion
from agents.experiments.design import Setting
from agents.experiments.listing import claims, experiment
from agents.experiments.training import train_and_score
from agents.experiments.verdict import NOT_REPRODUCED, REPRODUCED
from tests.agents.experiments.worlds import world

BY_ID = {claim.id: claim for claim in claims()}


def verdict(id_: str, score: Callable[[Setting], float], seeds: int = 8) -> str:
    claim = BY_ID[id_]
    finding = claim.finding(world(score, claim.needs, seeds))
    assert finding is not None
    return finding.verdict


def by_alpha(setting: Setting) -> float:
    return {0.0: 40.0, 1.0: 900.0}.get(setting.get("alpha", 0.3), 2_000.0)


def test_some_learning_remains_at_alpha_1_and_none_at_0() -> None:
    assert verdict("D1", by_alpha) == REPRODUCED
    assert verdict("D1", lambda s: 148.0) == NOT_REPRODUCED
    wide = verdict("D1", lambda s: by_alpha(s) if s["start"] == "wide" else 2_000.0)
    assert wide == f"{REPRODUCED} if the initial weights are the wide ones"


def test_time_is_judged_by_the_order_over_alpha() -> None:
    assert verdict("D2", lambda s: 1_000.0 + 500.0 * s["alpha"]) == REPRODUCED

    def opposite(setting: Setting) -> float:
        sign = -1.0 if setting["neuron"] == "continuous" else 1.0
        return 3_000.0 + sign * 2_000.0 * setting["alpha"]

    assert verdict("D2", opposite) == NOT_REPRODUCED


def momentum_world(error: Callable[[str], float]) -> dict[str, xr.Dataset]:
    wanted = experiment("MOMENTUM", "quick", tuple(range(8)))
    names = list(discussion.MOMENTUM)
    rates = np.array([error(name) for name in names])
    noise = 1e-3 * np.random.default_rng(0).standard_normal((*wanted.shape[:-1], 1))
    values = np.broadcast_to(rates, wanted.shape) + noise
    dims = [axis.name for axis in wanted.axes]
    coordinates = {axis.name: list(axis.values) for axis in wanted.axes}
    return {"MOMENTUM": xr.Dataset({"error_rate": (dims, values)}, coordinates)}


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ((0.2, 0.3, 0.3), REPRODUCED),
        ((0.2, 0.3, 0.2), f"{REPRODUCED} if compared at the same λ"),
        ((0.3, 0.2, 0.2), NOT_REPRODUCED),
    ],
)
def test_momentum_has_to_beat_a_larger_rate_as_well(errors: Any, expected: str) -> None:
    by_name = dict(zip(discussion.MOMENTUM, errors, strict=True))
    finding = BY_ID["D3"].judge(momentum_world(by_name.__getitem__))
    assert finding.verdict == expected


def test_spiking_that_pays_for_one_readout_is_a_condition() -> None:
    assert verdict("D6", lambda s: 1_000.0) == REPRODUCED
    pays = verdict("D6", lambda s: 1_000.0 + 900.0 * (s["eta"] > 0) * (s["readout"] == "D"))
    assert pays == f"{REPRODUCED} if the readout is V"
    assert verdict("D6", lambda s: 1_000.0 + 900.0 * (s["eta"] > 0)) == NOT_REPRODUCED


def test_the_best_cells_are_compared_on_seeds_that_did_not_choose_them() -> None:
    table = np.zeros((40, 2, 3))
    table[::2, 1, 2] = 1_000.0  # luck on the seeds that choose
    assert discussion._gain_on_other_seeds(table).value == 0.0
    table[1::2, 1, 2] = 300.0
    assert discussion._gain_on_other_seeds(table).value == 300.0


def test_residuals_of_the_supplement_are_judged_for_each_number_of_classes() -> None:
    assert verdict("S2", lambda s: 1_000.0 - s["eta"], 16) == REPRODUCED
    assert verdict("S2", lambda s: 1_000.0 + 900.0 * s["eta"], 16) == NOT_REPRODUCED
    two = verdict("S2", lambda s: 1_000.0 + 900.0 * s["eta"] * (s["classes"] == 1), 16)
    assert two == f"{REPRODUCED} if there are 2 classes"  # the quick size has no more


def lif_world(setting: Setting) -> float:
    if setting["neuron"] != "lif":
        return 2_000.0
    return {0: 1_500.0, 10: 900.0, 25: 300.0}[setting["refractory"]]


def test_a_worse_lif_and_its_reasons() -> None:
    assert verdict("F6c", lif_world) == REPRODUCED
    assert verdict("D7", lif_world) == REPRODUCED
    equal = lambda s: lif_world(s) * (4 / 3 if s["neuron"] == "lif" else 1.0)  # noqa: E731
    assert verdict("D7", equal).startswith(f"{REPRODUCED} if it is the refractory period alone")
    assert "refractory period 0" not in verdict("F6c", equal)
    assert verdict("D7", lambda s: 2_000.0) == NOT_REPRODUCED
    assert verdict("F6c", lambda s: 2_000.0) == NOT_REPRODUCED


@pytest.mark.parametrize("name", discussion.EXPERIMENTS)
def test_every_block_trains_and_is_scored(name: str) -> None:
    block = discussion.EXPERIMENTS[name]("quick", (3,)).blocks()[0]
    short = tuple({**setting, "trials": 60, "cap": 200} for setting in block.settings)
    made = train_and_score(replace(block, settings=short))
    assert made["survived"].shape == (*block.shape, 100)


def test_the_gain_of_spiking_is_drawn_for_both_readouts() -> None:
    figure = discussion.PICTURES["D6"].draw(world(lambda s: 1_000.0, ("SPIKINESS",), 4))
    assert len(figure.axes) == 2


def test_the_figure_has_three_panels() -> None:
    data = world(lambda s: 1_000.0, ("NEURONS", "TIMES"), 4)
    figure = discussion.PICTURES["D"].draw({**data, **momentum_world(lambda name: 0.2)})
    assert [axes.get_xlabel() for axes in figure.axes] == [
        "α (1/bin)", "trials of training", "classes"
    ]  # fmt: skip
