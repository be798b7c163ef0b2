"""The comparison of constant, averaged and falling: its grid trains, and its table says which."""

from __future__ import annotations

from dataclasses import replace

from agents.experiments.averaging import ENDINGS, RULES, averaging, table
from agents.experiments.store import read
from agents.experiments.sweep import sweep
from agents.experiments.workers import threads


def test_a_small_one_runs_and_its_table_has_a_row_for_each_ending(tmp_path) -> None:
    wanted = averaging("quick", (200, 201))
    assert wanted.cells == 2 * len(RULES) * len(ENDINGS)
    small = replace(wanted, common={**wanted.common, "trials": 200, "cap": 300, "runs": 100})
    with threads(1) as executor:
        sweep(small, tmp_path / "store", executor)
    lines = table(read(tmp_path / "store")).splitlines()
    assert len(lines) == 2 + len(RULES) * len(ENDINGS)
    assert all(("of 2" in line) == ("| constant |" not in line) for line in lines[2:])


def test_weights_are_averaged_over_the_last_third_of_the_training() -> None:
    assert ENDINGS["averaged"] == {"average_over": (40_001, 60_000)}
