"""The findings beyond the paper: judged from the stores that are kept, they are what is told."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents.experiments.leaky_theory import naive_trap, trap
from agents.experiments.listing import BEYOND, hypotheses, pictures
from agents.experiments.report import minus
from agents.experiments.store import read
from agents.experiments.verdict import MISSING
from gnm_env import Task

DOCS = Path(__file__).resolve().parents[3] / "docs" / "findings"
IDS = (
    *("M1", "M2", "M3", "M4", "W1", "W2", "W3", "C1", "C2", "C3"),
    *("U1", "U2", "U3", "U4", "N1", "N2", "N3", "N4", "N5", "N6", "N7"),
    *("K1", "K2", "K3", "K4", "G1", "G2", "G3", "G4"),
)


def told(size: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DOCS / size / "findings.json").read_text("utf-8"))
    return found


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, xr.Dataset]:
    folder, found = tmp_path_factory.mktemp("stores"), {}
    for archive in sorted((DOCS / "quick" / "stores").glob("*.zip")):
        with zipfile.ZipFile(archive) as file:
            file.extractall(folder / archive.stem)
        found[archive.stem] = read(folder / archive.stem)
    return found


@pytest.mark.parametrize("id_", IDS)
def test_what_is_told_at_quick_size_follows_from_the_kept_stores(
    id_: str, results: dict[str, xr.Dataset]
) -> None:
    (one,) = [one for one in hypotheses() if one.id == id_]
    (row,) = [row for row in told("quick")["findings"] if row["id"] == id_]
    finding = one.finding(results)
    assert finding is not None
    assert one.verdict(results) == row["verdict"]
    assert [minus(words) for words in finding.numbers] == row["numbers"]


@pytest.mark.parametrize("size", ["quick", "paper"])
def test_what_is_told_was_judged_by_the_rules_that_stand_here(size: str) -> None:
    found = told(size)
    assert [row["id"] for row in found["findings"]] == [one.id for one in hypotheses()]
    for row, one in zip(found["findings"], hypotheses(), strict=True):
        assert (row["words"], row["rule"]) == (one.words, one.rule)
        assert row["verdict"] != MISSING
    assert set(found["figures"]) == set(pictures(BEYOND))
    for name in found["figures"]:
        assert (DOCS / size / "figures" / f"{name}.png").exists()


def test_without_its_stores_a_hypothesis_is_not_judged() -> None:
    assert {one.verdict({}) for one in hypotheses()} == {MISSING}


def test_the_trap_is_where_a_trial_has_as_many_crossings_as_its_label() -> None:
    task, weights = Task(n_classes=2), np.full(100, 0.05)
    assert naive_trap(weights, task.rate) == pytest.approx(0.005 * 5)
    assert 0 < trap(weights, task) < naive_trap(weights, task.rate)
    assert trap(2 * weights, task) > trap(weights, task)
