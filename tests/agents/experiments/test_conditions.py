from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from agents import GNM, LIF, MST, AggregateLabel, NeuronAgent
from agents.experiments.conditions import (
    AUTHORS,
    CONDITIONS,
    D_READING,
    MATCHED,
    NEURONS,
    WIDE,
    Condition,
    Treatment,
    condition,
    table,
)
from agents.experiments.training import (
    class_counts,
    learners,
    make_agent,
    pattern_seeds,
    training,
)
from gnm_env import Task

PAGE = Path(__file__).parents[3] / "docs" / "reproduction.md"


@pytest.mark.parametrize("name", CONDITIONS)
@pytest.mark.parametrize("rule", ["all", "et"])
def test_an_experiment_takes_the_settings_of_every_condition(name: str, rule: str) -> None:
    rows = {neuron: condition(name).settings(neuron, rule) for neuron in NEURONS}
    training("toy", "", (class_counts(1), pattern_seeds((0,)), learners(rows)), trials=10)


@pytest.mark.parametrize("neuron", [GNM(), LIF(), MST()])
def test_matched_is_what_neurons_and_rule_do_by_default(neuron: Any) -> None:
    ours = make_agent({"pattern_seed": 4, **MATCHED.settings(neuron.name)}, Task())
    usual = NeuronAgent(neuron, AggregateLabel(), 100, 4)

    assert (ours.neuron, ours.rule) == (usual.neuron, usual.rule)
    assert ours.weight_bounds == usual.weight_bounds
    assert (ours.weights == usual.weights).all()


@pytest.mark.parametrize("neuron", NEURONS)
def test_wide_is_the_start_of_that_name(neuron: str) -> None:
    named = make_agent(
        {"pattern_seed": 4, "neuron": neuron, "rule": "all", "start": "wide"}, Task()
    )

    assert (
        make_agent({"pattern_seed": 4, **WIDE.settings(neuron)}, Task()).weights == named.weights
    ).all()


def test_the_d_reading_reads_d_and_takes_the_formula_literally() -> None:
    assert D_READING.settings("gnm")["readout"] == "D"
    assert "readout" not in D_READING.settings("mst")
    assert {D_READING.settings(neuron)["trace_decay"] for neuron in NEURONS} == {0.0}
    assert D_READING.settings("gnm", "et")["modulate"] is True


def test_every_value_of_the_authors_says_where_it_stands() -> None:
    for neuron in NEURONS:
        one = AUTHORS.treatment(neuron)
        assert set(one.sources) == {f.name for f in fields(one)} - {"sources"}


def test_further_settings_go_before() -> None:
    found = MATCHED.settings("gnm", "all", alpha=0.1, learning_rate=1e-3)
    assert (found["alpha"], found["learning_rate"]) == (0.1, 1e-3)


def test_the_page_holds_the_table_of_conditions() -> None:
    assert "\n".join(table()) in PAGE.read_text("utf-8")


def test_an_unknown_condition_is_told_which_there_are() -> None:
    with pytest.raises(ValueError, match="no condition 'published': choose one of matched, wide"):
        condition("published")


def test_a_condition_says_nothing_of_other_neurons() -> None:
    with pytest.raises(ValueError, match="how gnm, lif, mst are trained, not 'network'"):
        MATCHED.settings("network", "bp")


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"initial_weight": 0.0}, "initial_weight must be > 0"),
        ({"weight_bounds": (1.0, 0.0)}, "weight_bounds must ascend"),
        ({"trace_decay": 1.5}, "trace_decay must be in 0 … 1"),
        ({"fraction": 0.0}, "fraction must be > 0"),
        ({"trials": 0}, "trials must be >= 1"),
        ({"sources": {"omega": "a.py:1"}}, "sources must name fields of a treatment, got 'omega'"),
    ],
)
def test_a_treatment_checks_itself(values: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        replace(Treatment(0.1), **values)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"readout": "R"}, "readout must be"),
        ({"caps": ()}, "caps must hold"),
        ({"caps": (0,)}, "caps must be"),
    ],
)
def test_a_condition_checks_itself(values: dict[str, Any], told: str) -> None:
    one = Treatment(0.1)
    given: dict[str, Any] = {"readout": "V", "modulate": False, **values}
    with pytest.raises(ValueError, match=told):
        Condition("mine", "", gnm=one, lif=one, mst=one, **given)
