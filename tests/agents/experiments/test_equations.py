"""D4 and D5: decay beside potential, and the LIF beside the GNM that should be one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents import GNM
from agents.experiments import equations
from agents.experiments.design import Experiment
from agents.experiments.listing import claims
from agents.experiments.verdict import NOT_REPRODUCED, REPRODUCED

BY_ID = {claim.id: claim for claim in claims()}


def computed(wanted: Experiment) -> xr.Dataset:
    """What an experiment gives, block by block."""
    dims = [axis.name for axis in wanted.axes]
    values: dict[str, Any] = {
        v.name: np.empty((*wanted.shape, *(wanted.lengths[d] for d in v.dims)))
        for v in wanted.variables
    }
    for block in wanted.blocks():
        for name, part in wanted.compute(block).items():
            values[name][block.region] = part
    return xr.Dataset(
        {v.name: ([*dims, *v.dims], values[v.name]) for v in wanted.variables},
        {axis.name: list(axis.values) for axis in wanted.axes},
    )


@pytest.fixture(scope="module")
def results() -> dict[str, xr.Dataset]:
    return {
        "BALANCE": computed(equations.balance("quick", (0, 1))),
        "AS-LIF": computed(equations.as_lif("quick", (0, 1, 2))),
    }


def test_without_eta_the_decay_never_takes_more_than_there_is(results: Any) -> None:
    without = results["BALANCE"].sel(eta=0.0)
    assert (without["overdraft"] <= 0.0).all()
    assert np.allclose(without["share"], 0.3)


def test_conservation_holds_only_where_the_share_of_the_decay_stays_below_one(results: Any) -> None:
    finding = BY_ID["D4"].finding(results)
    assert finding is not None
    assert finding.verdict == f"{REPRODUCED} if ηγR + (1−η)α never exceeds 1"
    calm = {"BALANCE": results["BALANCE"].sel(eta=[0.0, 0.1])}
    assert BY_ID["D4"].judge(calm).verdict == REPRODUCED


def test_a_decay_that_takes_too_much_at_a_small_share_is_not_conservation(results: Any) -> None:
    wrong = results["BALANCE"].copy(deep=True)
    wrong["overdraft"][:] = 1.0
    assert BY_ID["D4"].judge({"BALANCE": wrong}).verdict == NOT_REPRODUCED


def test_the_gnm_is_the_lif_up_to_the_threshold_and_resets_two_bins_later(results: Any) -> None:
    finding = BY_ID["D5"].finding(results)
    assert finding is not None
    assert finding.verdict == f"{REPRODUCED} if the reset may come 2 bins late"


def test_potentials_that_differ_before_the_threshold_are_told_apart(results: Any) -> None:
    other = results["AS-LIF"].copy(deep=True)
    other["gnm"] += 0.01
    assert BY_ID["D5"].judge({"AS-LIF": other}).verdict == NOT_REPRODUCED
    same = results["AS-LIF"].copy(deep=True)
    same["gnm"][:] = same["lif"]
    assert BY_ID["D5"].judge({"AS-LIF": same}).verdict == REPRODUCED


def test_the_gnm_that_should_be_a_lif_has_its_leak() -> None:
    step = equations.STEP
    assert (1.0 - step.eta) * step.alpha == pytest.approx(equations.LEAK)
    assert (step.gamma, step.h, step.zeta) == (1.0 / step.eta, np.inf, GNM().zeta)


def test_the_figure_shows_both(results: Any) -> None:
    figure = equations.draw(results)
    assert len(figure.axes) == 2
