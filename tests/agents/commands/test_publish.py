"""What is kept of a report: the claims as a page, the figures, and stores that can be unpacked."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from agents.commands import publish
from agents.commands.terminal import parse
from agents.experiments.journal import StoreError
from agents.experiments.store import read
from agents.experiments.sweep import sweep
from agents.experiments.workers import threads
from tests.agents.experiments.toys import toy

CLAIM = {
    "id": "F3a",
    "words": "a | b",
    "numbers": ["one", "two"],
    "verdict": "reproduced",
}
STORE = {"name": "toy", "blocks": 18, "wall": "2 s", "work": "3 s", "commits": "0123456789"}


@pytest.fixture
def places(tmp_path: Path) -> list[str]:
    """Options for a report with one claim, one figure and one finished store."""
    report = tmp_path / "report"
    (report / "figures").mkdir(parents=True)
    for suffix in ("png", "pdf", "svg"):
        (report / "figures" / f"F3.{suffix}").write_text(suffix)
    record = {"size": "quick", "claims": [CLAIM], "stores": [STORE]}
    (report / "claims.json").write_text(json.dumps(record))
    with threads(1) as executor:
        sweep(toy(), tmp_path / "results" / "toy", executor)
    return ["--report", str(report), "--results", str(tmp_path / "results"),
            "--out", str(tmp_path / "docs")]  # fmt: skip


def run(places: list[str], *more: str) -> dict[str, Any]:
    return publish.main(parse(publish, [*places, *more]))


def test_claims_and_figures_are_kept(places: list[str], tmp_path: Path) -> None:
    run(places)
    kept = sorted(str(p.relative_to(tmp_path / "docs")) for p in tmp_path.glob("docs/**/*.*"))
    assert kept == [
        "quick/claims.json",
        "quick/claims.md",
        "quick/figures/F3.pdf",
        "quick/figures/F3.png",
    ]
    text = (tmp_path / "docs" / "quick" / "claims.md").read_text()
    assert "| F3a | a \\| b | one<br>two | **reproduced** |" in text
    assert "| toy | 18 | 2 s | 3 s | 0123456789 |" in text


def test_a_forest_plot_stands_beside_its_claim(places: list[str], tmp_path: Path) -> None:
    (tmp_path / "report" / "forests").mkdir()
    (tmp_path / "report" / "forests" / "F3a.svg").write_text("svg")
    run(places)
    text = (tmp_path / "docs" / "quick" / "claims.md").read_text()
    assert "one<br>two<br>![F3a: ours beside the paper's](forests/F3a.svg) |" in text
    assert (tmp_path / "docs" / "quick" / "forests" / "F3a.svg").exists()


def test_an_unpacked_store_is_the_store_that_it_was(places: list[str], tmp_path: Path) -> None:
    (archive,) = run(places, "--stores")["stores"]
    with zipfile.ZipFile(archive) as file:
        file.extractall(tmp_path / "again")
    xr.testing.assert_identical(read(tmp_path / "again"), read(tmp_path / "results" / "toy"))


def test_a_new_report_leaves_nothing_of_the_old_one(places: list[str], tmp_path: Path) -> None:
    old = tmp_path / "docs" / "quick" / "figures" / "F9.png"
    old.parent.mkdir(parents=True)
    old.touch()
    run(places)
    assert not old.exists()


def test_findings_have_a_folder_of_their_own_and_their_pictures_on_the_page(tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "TRAP.png").write_text("png")
    record = {
        "size": "paper",
        "findings": [{**CLAIM, "id": "M1", "verdict": "does not hold"}],
        "figures": {"TRAP": "What one sees."},
        "stores": [STORE],
    }
    (tmp_path / "findings.json").write_text(json.dumps(record))
    run(
        [
            "--findings",
            "--size",
            "paper",
            "--report",
            str(tmp_path),
            "--out",
            str(tmp_path / "docs"),
        ]
    )

    text = (tmp_path / "docs" / "paper" / "findings.md").read_text()
    assert "| M1 | a \\| b | one<br>two | **does not hold** |" in text
    assert "![TRAP](figures/TRAP.png)\n\n*TRAP: What one sees.*" in text
    assert (tmp_path / "docs" / "paper" / "figures" / "TRAP.png").exists()


def test_what_is_not_there_or_damaged_is_refused(places: list[str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is a report of size 'quick', not 'paper'"):
        run(places, "--size", "paper")
    with pytest.raises(ValueError, match=r"there is no report .* run gnm reproduce first"):
        run([*places, "--report", str(tmp_path)])
    chunk = max((tmp_path / "results" / "toy").rglob("c/**/*"), key=lambda p: p.is_file())
    chunk.write_bytes(b"nonsense")
    with pytest.raises(StoreError, match="damaged"):
        run(places, "--stores")


def test_what_is_kept_stays_whole_if_a_store_is_missing(places: list[str], tmp_path: Path) -> None:
    run(places, "--stores")
    kept = {path: path.read_bytes() for path in tmp_path.glob("docs/**/*.*")}
    (tmp_path / "results" / "toy").rename(tmp_path / "elsewhere")

    with pytest.raises(StoreError, match="there is no store"):
        run(places, "--stores")

    assert {path: path.read_bytes() for path in tmp_path.glob("docs/**/*.*")} == kept
    assert [path.name for path in (tmp_path / "docs").iterdir()] == ["quick"]


def test_forensics_have_a_folder_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "FORENSICS.png").write_text("png")
    record = {
        "size": "quick", "command": "gnm forensics --size quick", "work": "1 min",
        "tried": {
            "ways of training": 72, "protocols": 576, "ways that went on": 18,
            "pattern seeds": {"coarse": "0", "fine": "1", "confirmed": "500–501"},
        },
        "numbers": [{"claim": "F3e", "words": "MST", "paper": "≈ 377", "low": 300, "high": 475}],
        "protocols": [
            {"label": "search 1", "name": "readout V", "points": "1.0", "back": 1,
             "values": ["390"], "inside": [True]}
        ],
        "hypotheses": [], "unexplained": [], "search": [], "caption": "", "stores": [STORE],
    }  # fmt: skip
    (tmp_path / "forensics.json").write_text(json.dumps(record))
    out = tmp_path / "docs"
    run(["--forensics", "--report", str(tmp_path), "--out", str(out)])

    text = (out / "quick" / "forensics.md").read_text()
    assert "| search 1: readout V | 1.0 | 1 |" in text
    assert "| F3e | MST | ≈ 377 | 300 … 475 | **390** |" in text
    with pytest.raises(ValueError, match="one by one"):
        run(["--forensics", "--findings"])


def test_merged_keeps_what_the_report_could_not_judge(places: list[str], tmp_path: Path) -> None:
    row = {**CLAIM, "rule": "reproduced if a", "command": "gnm sweep F3"}
    report, docs = tmp_path / "report", tmp_path / "docs" / "quick"

    def told(*claims: dict[str, Any]) -> None:
        record = {"size": "quick", "claims": claims, "stores": []}
        (report / "claims.json").write_text(json.dumps(record))

    told(row)
    run(places)
    (report / "figures" / "F3.png").unlink()
    (report / "figures" / "D.png").write_text("new")
    missing = {**row, "verdict": "missing", "numbers": []}
    added = {**row, "id": "D1", "numbers": ["three"]}
    told(missing, added)
    run(places, "--merge")
    kept = json.loads((docs / "claims.json").read_text())["claims"]
    assert kept == [row, added]
    assert {path.name for path in docs.glob("figures/*.png")} == {"F3.png", "D.png"}
    told({**missing, "rule": "reproduced if b"}, added)
    with pytest.raises(ValueError, match="F3a has no verdict in this report, and was judged by an"):
        run(places, "--merge")
    with pytest.raises(ValueError, match="leave --merge out"):
        run(places, "--merge", "--forensics")
