from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from agents.experiments.store import read
from agents.experiments.two_peaks import (
    ARC_SEED,
    AROUND,
    PICTURES,
    deepest,
    dips,
    potential,
    second_peak,
    second_peaks,
)
from agents.plotting import GAP, styled

STORES = Path(__file__).resolve().parents[3] / "docs" / "reproduction" / "quick" / "stores"


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> dict[str, xr.Dataset]:
    folder = tmp_path_factory.mktemp("stores")
    for name in ("F3", "PEAKS"):
        with zipfile.ZipFile(STORES / f"{name}.zip") as archive:
            archive.extractall(folder / name)
    return {name: read(folder / name) for name in ("F3", "PEAKS")}


def test_the_second_peak_is_told_from_the_slopes_of_the_first() -> None:
    assert second_peak(np.array([0, 0.9, 1.0, 0.95, 0.2, 0.8, 0.1, 0])) == pytest.approx(0.8)
    assert second_peak(np.array([0, 0.5, 1.0, 0.5, 0])) == 0.0


def test_a_dip_is_what_both_neighbours_are_ahead_by() -> None:
    scores = np.full((2, 9), 9_000.0)
    scores[1, 4], scores[0, 5:] = 300.0, 2_000.0  # a dip, and a fall that is none
    assert dips(scores).max() == 8_700.0
    assert dips(scores)[0].max() <= 0.0
    assert deepest(scores)[1] == 4
    assert dips(scores).shape == (2, 9 - 2 * AROUND)


def test_the_arc_of_the_map_is_one_seed_whose_two_peaks_are_level(
    stored: dict[str, xr.Dataset],
) -> None:
    data = stored["PEAKS"]
    scores = data["survived"].mean("run").sel(classes=1).transpose("pattern_seed", "alpha")
    place = deepest(scores.to_numpy())[ARC_SEED]
    assert float(data["alpha"][place]) == 0.525
    assert second_peaks(data)[ARC_SEED, place] > 0.99
    before, after = (potential(data, ARC_SEED, alpha).argmax() - GAP for alpha in (0.475, 0.575))
    assert (before, after) == (3, 24)


def test_the_picture_says_how_many_seeds_are_hit(stored: dict[str, xr.Dataset]) -> None:
    assert "In 1 of 6 seeds a dip costs" in PICTURES["F3-arc"].full_caption(stored)
    with styled():
        figure = PICTURES["F3-arc"].draw(stored)
    assert len(figure.axes) == 4
