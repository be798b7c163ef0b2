from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from agents.experiments.response import (
    CLAIMS,
    HEARD,
    OWED,
    described,
    draw_response,
    exact,
    example,
)
from agents.experiments.verdict import NOT_REPRODUCED, REPRODUCED
from agents.plotting import WIDE, panels


def heard(*right: float) -> xr.Dataset:
    """Neurons, one a seed and the same from both starts, that answer so many trials exactly."""
    given = np.tile(OWED, (1, len(right), 2, HEARD, 1))
    astray = np.zeros((1, len(right), 2, HEARD), int)
    for seed, part in enumerate(right):
        wrong = round((1 - part) * HEARD)
        given[:, seed, :, : wrong // 2, 0] = 2
        astray[:, seed, :, wrong // 2 : wrong] = 1
    dims = ("classes", "pattern_seed", "start")
    return xr.Dataset(
        {
            "given": ((*dims, "heard", "target"), given),
            "astray": ((*dims, "heard"), astray),
            "weights": ((*dims, "channel"), np.full((1, len(right), 2, 100), 0.02)),
        },
        {
            "classes": [3],
            "pattern_seed": range(len(right)),
            "start": np.array(["matched", "wide"], object),
        },
    )


def test_a_wrong_count_and_a_spike_in_noise_both_spoil_a_trial() -> None:
    assert exact(heard(0.7)).to_numpy().ravel().tolist() == [0.7, 0.7]


@pytest.mark.parametrize(
    ("right", "verdict"), [((0.9, 0.4), REPRODUCED), ((0.9, 0.5, 0.1), NOT_REPRODUCED)]
)
def test_half_of_the_neurons_have_to_answer_most_trials(
    right: tuple[float, ...], verdict: str
) -> None:
    finding = CLAIMS[0].finding({"F1b": heard(*right)})
    assert finding is not None
    assert finding.verdict == verdict


def test_the_first_neuron_that_does_so_is_drawn_and_named() -> None:
    data = heard(0.3, 0.8, 0.9)
    _, trial, seed = example(data)
    assert seed == 1
    assert trial.classes.tolist() == [0, 1, 2]
    assert "pattern seed 1 and answers 80% of" in described(data)
    _, grid = panels(1, 1, width=WIDE, height=2.0)
    draw_response(grid[0, 0], data)
    assert grid[0, 0].texts[0].get_text().startswith("class 0")
    assert example(heard(0.3, 0.4))[2] == 1
