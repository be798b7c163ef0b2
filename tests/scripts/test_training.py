from __future__ import annotations

import numpy as np
import pytest

from agents import GNM, AggregateLabel, NeuronAgent, noisy_performance, train_many
from experiments.methods import F7_LEARNERS, GNM_ALL, MST_ALL, TABLE_LEARNERS
from experiments.training import (
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
    rows = {"GNM": GNM_ALL, "MST": MST_ALL, "GNM, published": {**GNM_ALL, "start": "published"}}
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


@pytest.mark.parametrize("name", [*TABLE_LEARNERS])
def test_rows_of_the_table_are_the_neurons_that_they_name(name: str) -> None:
    setting = {"classes": 1, "pattern_seed": 0, "start": "matched", **TABLE_LEARNERS[name]}
    agent = make_agent(setting, Task())

    assert agent.neuron.name.upper() in name
    assert ("ET" in name) == (agent.rule.name == "et")
    assert ("modulated" in name) == bool(getattr(agent.rule, "modulate", False))
    assert getattr(agent.neuron, "refractory", 0) == (25 if "refractory 25" in name else 0)
    highest = {"gnm": (0.1, 0.3), "mst": (0.02, 0.2), "lif": (0.1, 0.5)}[agent.neuron.name]
    assert agent.weights.max() == pytest.approx(highest["published" in name], rel=0.05)


def test_matched_and_published_rows_of_the_table_mirror_figure_7() -> None:
    assert set(F7_LEARNERS) <= set(TABLE_LEARNERS)


def test_readout_d_goes_without_weight_bounds() -> None:
    setting = {"neuron": "gnm", "rule": "all", "pattern_seed": 0, "readout": "D"}

    assert make_agent({**setting, "weight_bounds": None}, Task()).weight_bounds is None
    assert make_agent(setting, Task()).weight_bounds == (0.0, 1.0)


def test_a_setting_that_nothing_takes_is_refused() -> None:
    setting = {"neuron": "gnm", "rule": "all", "pattern_seed": 0, "refractory": 3}

    with pytest.raises(ValueError, match="'refractory' fits neither GNM nor its rule"):
        make_agent(setting, Task())
