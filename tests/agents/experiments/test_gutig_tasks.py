"""TASKS: what each of Gütig's five tasks owes, what counts as right, and that a block trains."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents.experiments.gutig_tasks import (
    LEARNERS,
    OWED,
    PICTURES,
    POINTS,
    error_of,
    share_right,
    task_of,
)
from agents.experiments.listing import experiment
from agents.plotting import styled
from agents.training.batch import Answers
from tests.agents.experiments.test_capacity import filled


def test_the_tasks_owe_what_their_names_say() -> None:
    for name in OWED:
        task = task_of(name)
        clues, spikes = int(name[0]), name[2]
        owed = [one for one in task.owed if one]
        assert (task.n_classes, task.n_inputs, len(owed)) == (10, 500, clues)
        assert owed == (list(range(1, 6)) if spikes == "m" else [int(spikes)] * clues)


def test_a_presentation_is_right_if_it_was_given_just_what_it_is_owed() -> None:
    table = np.zeros((1, 2, 11), np.int64)
    table[0, 0, 5], table[0, 0, 4] = 6, 2  # owed five: right, one too few
    table[0, 1, 0], table[0, 1, 1] = 9, 3  # owed none: right, one too many
    none = np.zeros(1)
    told = Answers(table, none, 100, none, none, 10)
    assert share_right(told, (5, 0)) == pytest.approx([15 / 20])


def test_the_picture_is_drawn_from_a_store() -> None:
    def error(setting: dict[str, Any]) -> float:
        return 0.01 if setting["rule"] == "peak-error" else 0.2

    values = {
        "curve": lambda s: np.linspace(1.0, error(s), POINTS),
        "error": error,
        "right": lambda s: 1 - error(s),
        "false_positives": lambda s: 0.0,
    }
    data = filled(experiment("TASKS", "quick"), values)
    with styled():
        figure = PICTURES["TASKS"].draw({"TASKS": data})
    assert [axes.get_title(loc="left")[4:] for axes in figure.axes[:2]] == ["1F1S", "5F5S"]
    assert error_of(data, "5F5S", "MST, ALL").value == pytest.approx(0.2)


@pytest.mark.slow
def test_a_block_trains_and_is_asked() -> None:
    wanted = experiment("TASKS", "quick", (3,))
    block = wanted.blocks()[0]
    short = tuple({**one, "trials": POINTS, "answered": 5} for one in block.settings)
    made = wanted.compute(replace(block, settings=short))
    assert made["curve"].shape == (1, 1, len(LEARNERS), POINTS)
    assert all(np.isfinite(one).all() for one in made.values())
