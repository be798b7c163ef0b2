"""CAPACITY and LOAD: what is heard, how a capacity is read off, and that the blocks train."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents import MST, NeuronAgent, Tempotron
from agents.experiments.capacity import (
    LOADS,
    PICTURES,
    PRESENTATIONS,
    SITUATIONS,
    TOLERATED,
    crossing,
    growth,
    latency_patterns,
    load_at,
    mistakes,
    scaled,
    share_right,
    task_of,
)
from agents.experiments.design import Experiment
from agents.experiments.listing import experiment
from agents.plotting import styled


def filled(wanted: Experiment, values: dict[str, Any]) -> xr.Dataset:
    """A finished store of the experiment; `values` gives each cell's value from its setting."""
    dims = [axis.name for axis in wanted.axes]
    coords = {axis.name: list(axis.values) for axis in wanted.axes}
    arrays = {}
    for variable in wanted.variables:
        lengths = tuple(wanted.lengths[dim] for dim in variable.dims)
        table = np.empty((*wanted.shape, *lengths))
        for block in wanted.blocks():
            cells = [np.broadcast_to(values[variable.name](s), lengths) for s in block.settings]
            table[block.region] = np.reshape(cells, (*block.shape, *lengths))
        arrays[variable.name] = ((*dims, *variable.dims), table)
    return xr.Dataset(arrays, coords, {"settings": wanted.settings()})


def test_a_trial_has_as_many_presentations_however_many_the_patterns() -> None:
    for situation in SITUATIONS.values():
        for load in LOADS:
            task = task_of({**situation, "load": load})
            assert task.n_classes == round(load * task.n_inputs)
            assert set(task.owed) == {1}
            assert task.mean_occurrences * task.n_classes == pytest.approx(PRESENTATIONS)


def test_a_step_moves_the_potential_as_much_at_every_number_of_inputs() -> None:
    for fields in ({}, {"n_inputs": 500}, {"rate": 0.02}):
        task = task_of({**fields, "load": 0.1})
        own = scaled({"neuron": "gnm", "base_rate": 0.03}, task)
        assert own["learning_rate"] * task.n_inputs * task.rate == pytest.approx(0.015)
        assert own["initial_weight"] / own["learning_rate"] == pytest.approx(0.1 / 0.03)


def test_in_a_latency_pattern_every_input_spikes_once_and_half_are_owed_a_spike() -> None:
    trials = latency_patterns(20, 50, 300, seed=3)
    assert all((trial.dense().sum(0) == 1).all() for trial in trials[:20])
    labels = np.array([trial.label for trial in trials])
    assert set(labels) == {0, 1}
    assert labels.mean() == pytest.approx(0.5, abs=0.1)
    again = latency_patterns(20, 50, 300, seed=3)
    assert np.array_equal(trials[7].dense(), again[7].dense())


def test_any_number_of_spikes_is_right_where_one_is_owed() -> None:
    trials = latency_patterns(20, 50, 100, seed=3)
    owed = np.mean([trial.label for trial in trials])
    silent, eager = (
        NeuronAgent(MST(), Tempotron(), n_inputs=20, seed=0, weight_bounds=None) for _ in range(2)
    )
    silent.weights[:], eager.weights[:] = 0.0, 3.0
    assert share_right([silent, eager], trials) == pytest.approx([1 - owed, owed])


def test_the_capacity_is_where_mistakes_reach_the_line() -> None:
    loads = np.array([1.0, 2.0, 4.0])
    rates = TOLERATED * np.array([[0.5, 0.5, 2.0], [0.5, 0.5, 2.0]])
    assert crossing(rates, loads) == pytest.approx(np.sqrt(8.0))
    assert crossing(rates * 0.1, loads) == 4.0
    assert crossing(rates * 10.0, loads) == 1.0


@pytest.fixture(scope="module")
def results() -> dict[str, xr.Dataset]:
    """Neurons that hold one pattern for five inputs at any N, and tempotrons right up to 3."""

    def survived(setting: dict[str, Any]) -> int:
        return round(149 / (TOLERATED * setting["load"] / 0.2))

    return {
        "CAPACITY": filled(experiment("CAPACITY", "quick"), {"survived": survived}),
        "LOAD": filled(
            experiment("LOAD", "quick"), {"right": lambda s: 1.0 - 0.02 * max(s["load"] - 2.5, 0)}
        ),
    }


def test_capacity_in_proportion_to_the_inputs_has_an_exponent_of_one(
    results: dict[str, xr.Dataset],
) -> None:
    data = results["CAPACITY"]
    at = mistakes(data, "N 100", "GNM, PeakError")[:, list(LOADS).index(0.16)]
    assert at == pytest.approx(TOLERATED * 0.8, rel=0.02)
    assert growth(data, "GNM, PeakError").value == pytest.approx(1.0, abs=0.02)


def test_the_load_is_read_off_between_two_loads(results: dict[str, xr.Dataset]) -> None:
    assert load_at(results["LOAD"], "MST, Tempotron").value == pytest.approx(3.0)


def test_the_picture_is_drawn_from_stores(results: dict[str, xr.Dataset]) -> None:
    with styled():
        figure = PICTURES["CAPACITY"].draw(results)
    assert [axes.get_title(loc="left")[0] for axes in figure.axes] == list("abcdef")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["CAPACITY", "LOAD"])
def test_a_block_of_the_quick_size_trains_and_is_scored(name: str) -> None:
    wanted = experiment(name, "quick", (3,))
    block = wanted.blocks()[0]
    short = {"least_trials": 40, "heard": 1, "cap": 200, "cycles": 2, "n_inputs": 100}
    settings = tuple(
        {**one, **{k: v for k, v in short.items() if k in one}} for one in block.settings
    )
    (made,) = wanted.compute(replace(block, settings=settings)).values()
    assert np.isfinite(made).all()
    assert (made >= 0).all()
