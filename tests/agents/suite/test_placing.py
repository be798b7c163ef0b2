"""The place in the league: own rows among the published ones, with intervals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from agents.commands import report
from agents.commands.terminal import parse
from agents.suite import league_rows, place
from agents.suite.league import level_of
from gnm_env import suite
from gnm_env.results import Result, Score

pytest.importorskip("xarray")
pytest.importorskip("matplotlib")

DOCS = Path(__file__).parents[3] / "docs"


def write(folder: Path, learner: str, level: str, seed: int, *scores: tuple[int, int]) -> None:
    """A result whose scores are the same on every stream: (bins heard, bins survived)."""
    entered = tuple(Score(heard, 1.5, (bins,) * suite().runs) for heard, bins in scores)
    Result(level, seed, learner, entered, parameters=12).write(folder)


def test_own_agents_stand_among_the_leagues_best_first(tmp_path: Path) -> None:
    for seed, bins in ((100, 9_000), (101, 5_000), (102, 7_000)):
        write(tmp_path, "mine", "1class", seed, (1_500_000, bins - 1_000), (2_000_000, bins))
    placing = place(tmp_path)
    (own,) = [row for row in placing.rows if row["own"]]
    assert own["last"]["mean"] == own["last"]["median"] == 7_000
    low, high = own["last"]["ci95"]
    assert 5_000 <= low < 7_000 < high <= 9_000
    assert own["at_equal_experience"]["mean"] == 6_000  # 1.5 of 1.6 million bins
    assert (own["seeds"], own["heard"], own["parameters"]) == (3, 2_000_000, 12)
    means = [row["last"]["mean"] for row in placing.rows]
    assert means == sorted(means, reverse=True)
    assert len(placing.rows) == 1 + len(league_rows("1class"))
    assert placing.notes == ("mine on 1class: 3 of 10 pattern seeds (100 … 109).",)


def test_the_table_marks_own_rows_and_is_markdown(tmp_path: Path) -> None:
    write(tmp_path, "mine", "2class", 100, (5, 300))
    lines = place(tmp_path).text().splitlines()
    assert lines[0].startswith("2class: two patterns")
    (own,) = [line for line in lines if "→ mine" in line]
    assert "| 300" in own.replace("  ", " ").replace("  ", " ") or " 300 |" in own
    table = [line for line in lines if line.startswith("|")]
    assert len({len(line) for line in table}) == 1
    assert any("oracle" in line for line in table)


def test_levels_without_a_league_stand_beside_silence(tmp_path: Path) -> None:
    write(tmp_path, "mine", "sparse", 100, (5, 300))
    write(tmp_path, "mine", "distractors", 100, (5, 300))
    placing = place(tmp_path)
    assert [row["learner"] for row in placing.of(suite()["sparse"])] == ["mine", "silent"]
    assert [row["learner"] for row in placing.of(suite()["distractors"])] == ["mine"]


def test_pattern_seeds_for_tuning_do_not_count(tmp_path: Path) -> None:
    write(tmp_path, "mine", "1class", 3, (5, 9_000))
    with pytest.raises(ValueError, match="pattern seeds 3 only, and scores are reported on 100"):
        place(tmp_path)
    write(tmp_path, "mine", "1class", 100, (5, 200))
    placing = place(tmp_path)
    (own,) = [row for row in placing.rows if row["own"]]
    assert own["last"]["mean"] == 200
    assert placing.notes[0] == "Left out: pattern seeds 3, on which settings may be chosen."


def test_the_command_prints_the_table_and_draws_the_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, "mine", "1class", 100, (5, 300))
    told = report.main(parse(report, [tmp_path]))
    assert "→ mine" in capsys.readouterr().out
    assert json.loads(json.dumps(told))["rows"]
    for path in told["pictures"]:
        assert Path(path).stat().st_size > 5_000


def test_two_folders_are_compared_bin_by_bin(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, same, other = (tmp_path / name for name in ("one", "same", "other"))
    for folder in (one, same, other):
        write(folder, "mine", "1class", 100, (5, 301 if folder == other else 300))
    assert report.differing(one, same) == []
    write(other, "mine", "2class", 100, (5, 300))
    told = report.main(parse(report, [one, "--same-as", other]))
    assert told["failed"] is True
    assert told["differences"] == [
        "mine, 1class, pattern seed 100: other scores, 300.00 and 301.00 bins at last",
        f"mine, 2class, pattern seed 100: only in {other}",
    ]
    assert "\n".join(told["differences"]) in capsys.readouterr().out


def test_what_is_compared_with_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="name that folder too"):
        report.main(parse(report, ["--same-as", "x"]))


def test_the_rows_that_are_kept_are_those_of_the_page() -> None:
    """`gnm league --so-far --keep` makes them anew; its table goes onto the page."""
    from agents.experiments.league import text_table

    assert text_table(league_rows()) in (DOCS / "reinforcement-learning.md").read_text("utf-8")


def test_every_row_of_the_league_is_of_a_level() -> None:
    assert {level_of(row) for row in league_rows()} <= set(suite())
