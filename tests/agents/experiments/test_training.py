from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from agents import GNM, AggregateLabel, NeuronAgent, noisy_performance, train_many
from agents.experiments.design import Axis
from agents.experiments.methods import F7_LEARNERS, GNM_ALL, MST_ALL, NETWORKS
from agents.experiments.table import TABLE_LEARNERS
from agents.experiments.training import (
    class_counts,
    evaluation_seed,
    learners,
    make_agent,
    pattern_seeds,
    training,
    training_seed,
)
from gnm_env import Patterns, Task

SHORT = {"trials": 300, "runs": 3, "cap": 400}


def test_a_block_gives_each_neuron_what_it_gets_alone() -> None:
    rows = {"GNM": GNM_ALL, "MST": MST_ALL, "GNM, wide": {**GNM_ALL, "start": "wide"}}
    axes = (class_counts(2), pattern_seeds((3,)), learners(rows))
    (block,) = training("toy", "", axes, keep_weights=True, **SHORT).blocks()
    values = training("toy", "", axes, keep_weights=True, **SHORT).compute(block)

    task = Task(n_classes=2)
    patterns = Patterns.draw(task, 3)
    alone = NeuronAgent(GNM(), AggregateLabel(), 100, seed=3, initial_weight=0.3)
    train_many([alone], task, patterns, 300, training_seed(2, 3))
    survived = noisy_performance(alone, task, patterns, 3, 400, evaluation_seed(2, 3))

    np.testing.assert_array_equal(values["weights"][0, 0, 2], alone.weights)
    np.testing.assert_array_equal(values["survived"][0, 0, 2], survived)
    assert values["survived"].shape == (1, 1, 3, 3)
    assert values["error_rate"].shape == (1, 1, 3)


def test_networks_of_several_sizes_share_a_block() -> None:
    rows = {name: NETWORKS[name] for name in ("none hidden", "1 hidden", "2 hidden")}
    axes = (class_counts(1), pattern_seeds((3,)), learners(rows))
    wanted = training("toy", "", axes, **SHORT)
    (block,) = wanted.blocks()
    values = wanted.compute(block)

    assert values["survived"].shape == (1, 1, 3, 3)
    assert "weights" not in values


@pytest.mark.parametrize("name", [*TABLE_LEARNERS])
def test_rows_of_the_table_are_the_neurons_that_they_name(name: str) -> None:
    setting = {"classes": 1, "pattern_seed": 0, "start": "matched", **TABLE_LEARNERS[name]}
    agent = make_agent(setting, Task())

    assert agent.neuron.name.upper() in name
    assert ("ET" in name) == (agent.rule.name == "et")
    assert ("modulated" in name) == bool(getattr(agent.rule, "modulate", False))
    assert getattr(agent.neuron, "refractory", 0) == (25 if "refractory 25" in name else 0)
    highest = {"gnm": (0.1, 0.3), "mst": (0.02, 0.2), "lif": (0.1, 0.5)}[agent.neuron.name]
    assert agent.weights.max() == pytest.approx(highest["wide" in name], rel=0.05)


def test_matched_and_wide_rows_of_the_table_mirror_figure_7() -> None:
    assert set(F7_LEARNERS) <= set(TABLE_LEARNERS)


def test_readout_d_goes_without_weight_bounds() -> None:
    setting = {"neuron": "gnm", "rule": "all", "pattern_seed": 0, "readout": "D"}

    assert make_agent({**setting, "weight_bounds": None}, Task()).weight_bounds is None
    assert make_agent(setting, Task()).weight_bounds == (0.0, 1.0)


AXES = (class_counts(1), pattern_seeds((0,)))


def test_an_axis_that_nothing_takes_is_refused_when_it_is_declared() -> None:
    told = r"nothing takes the setting 'refractory': neither the task \(.*rate.*\), nor GNM \(alpha"
    with pytest.raises(ValueError, match=told):
        training("mine", "", (*AXES, Axis("refractory", (0, 3))))
    training("mine", "", (*AXES, Axis("refractory", (0, 3))), neuron="lif")


def test_an_axis_is_checked_against_every_neuron_that_it_meets() -> None:
    rows = learners({"LIF": {"neuron": "lif"}, "GNM": {"neuron": "gnm"}})
    with pytest.raises(ValueError, match=r"'refractory': .* nor GNM"):
        training("mine", "", (*AXES, rows, Axis("refractory", (0, 3))))
    training("mine", "", (*AXES, rows, Axis("alpha", (0.1, 0.3))))


@pytest.mark.parametrize(
    ("axis", "common", "complaint"),
    [
        (Axis("alpha", (0.3, 1.3)), {}, "alpha must be in 0 … 1, got 1.3"),
        (Axis("rate", (0.01, 2.0)), {}, "rate must be in 0 … 1, got 2.0"),
        (Axis("rate", (0.01, 0.02), chunk=0), {}, "axis rate must have chunk=1"),
        (Axis("start", ("matched", "warm")), {}, "start must be matched or wide"),
        (Axis("neuron", ("gnm", "gmn")), {}, "no neuron 'gmn'"),
        (Axis("runs", (10, 20)), {}, "runs cannot be set by an axis"),
        (Axis("trials", (0,)), {}, "trials must be >= 1, got 0"),
        (Axis("alpha", (0.1,)), {"runs": 2.5}, "runs must be a whole number, got 2.5"),
        (Axis("alpha", (0.1,)), {"cap": "x"}, "cap must be a whole number, got 'x'"),
        (Axis("alpha", (0.1,)), {"rule": 3}, "a rule must be given by its name, .* got 3"),
        (Axis("alpha", (0.1,)), {"keep_weights": "no"}, "keep_weights must be True or False"),
        (Axis("classes", (1,)), {}, "an Axis with a name of its own, got classes, "),
        (3, {}, "an Axis with a name of its own, got 3"),
        (Axis("alpha", (0.1,)), {"neuron": "continuous", "start": "wide"}, "wide init"),
    ],
)
def test_values_out_of_range_are_refused_when_they_are_declared(
    axis: Any, common: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        training("mine", "", (*AXES, axis), **common)


@pytest.mark.parametrize("counts", [(0,), (2.5,), ("3",), (None,), (True,), (10**30,)])
def test_a_number_of_classes_is_a_whole_number(counts: Any) -> None:
    with pytest.raises(ValueError, match="classes must be"):
        class_counts(*counts)


@pytest.mark.parametrize("seeds", [3, None, "x", (0.5,), (-1,)])
def test_pattern_seeds_are_whole_numbers(seeds: Any) -> None:
    with pytest.raises(ValueError, match="pattern seeds must be"):
        pattern_seeds(seeds)


def test_classes_and_pattern_seeds_are_asked_for() -> None:
    with pytest.raises(ValueError, match="the axes must hold pattern_seed, as pattern_seeds"):
        training("mine", "", (class_counts(1), Axis("alpha", (0.1, 0.3))))


def test_fields_of_the_task_may_be_axes() -> None:
    axes = (*AXES, Axis("jitter_bins", (0, 5)), Axis("n_inputs", (50, 100)))
    wanted = training("mine", "", axes, **SHORT)
    values = [wanted.compute(block) for block in wanted.blocks()]

    task = Task(n_inputs=50, jitter_bins=5)
    alone = NeuronAgent(GNM(), AggregateLabel(), 50, seed=0)
    train_many([alone], task, Patterns.draw(task, 0), 300, training_seed(1, 0))
    survived = noisy_performance(alone, task, Patterns.draw(task, 0), 3, 400, evaluation_seed(1, 0))
    np.testing.assert_array_equal(values[2]["survived"].ravel(), survived)
    assert [value["weights"].shape[-1] for value in values] == [50, 100, 50, 100]


def test_the_settings_of_the_task_are_in_the_protocol() -> None:
    settings = training("mine", "", AXES, rate=0.01, targets=(3,)).settings()
    assert settings["protocol"]["task"]["rate"] == 0.01
    assert settings["protocol"]["task"]["targets"] == [3]


def test_copies_differ_in_their_initial_weights_and_copy_0_is_the_neuron_without_copies() -> None:
    setting = {**GNM_ALL, "pattern_seed": 3}
    plain, first, second = (
        make_agent({**setting, **copy}, Task()).weights for copy in ({}, {"copy": 0}, {"copy": 1})
    )
    np.testing.assert_array_equal(plain, first)
    assert not np.array_equal(first, second)


def test_a_rule_with_a_field_of_the_name_rule_can_be_trained() -> None:
    agent = make_agent({"neuron": "gnm", "rule": "chronotron", "pattern_seed": 0}, Task())
    assert (agent.rule.name, agent.rule.rule) == ("chronotron", "E")
