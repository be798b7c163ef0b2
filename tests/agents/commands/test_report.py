from __future__ import annotations

import json
import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from agents.commands import check_report
from agents.commands.terminal import parse
from agents.experiments.listing import claims, pictures
from agents.experiments.report import page, record, shown_forensics, write
from agents.experiments.store import Summary
from tests.agents.experiments.worlds import as_in_the_paper, world

COSTS = {
    name: Summary(done=4, blocks=4, seconds=20.0 * k, wall=10.0 * k, commits=("0123456789abcdef+",))
    for k, name in enumerate(("F1", "F7", "table"), 1)
}


@pytest.fixture(scope="module")
def html() -> str:
    results = world(as_in_the_paper, ("F1", "F7", "table"), 5)
    svg = "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'></svg>"
    figure = {"name": "F7", "caption": pictures()["F7"].caption, "source": svg}
    return page(record(results, COSTS, "quick"), [figure])


def test_the_page_loads_nothing_from_elsewhere(html: str) -> None:
    assert check_report.outside(html) == []
    assert check_report.outside('<img src="https://example.org/a.png">') == [
        "https://example.org/a.png"
    ]


def test_every_claim_has_its_row_number_and_verdict(html: str) -> None:
    assert len(check_report.ids(html)) == len(claims())
    assert "MST ahead of GNM in 0 of 5" in html
    assert html.count("– missing") == len(claims()) - 5
    assert "no data: F3, F3-wide" in html


def test_the_page_tells_size_rules_commands_and_cost(html: str) -> None:
    assert "Quick size." in html
    assert "two-sided sign test p &lt; 0.01" in html
    assert "gnm sweep F7 --size quick" in html
    assert "20 s" in html
    assert "0123456789+" in html
    assert pictures()["F7"].caption[:40] in html


def test_the_reference_table_stands_beside_the_prototype(html: str) -> None:
    assert "prototype 8,388 / 9,881" in html
    assert re.search(r"LIF refractory 25, ALL", html)


def testminus_signs_areminus_signs() -> None:
    from agents.experiments.report import minus

    assert minus("gain -12 [-20 … -3], F3-wide, sub-threshold") == (
        "gain −12 [−20 … −3], F3-wide, sub-threshold"
    )


def test_a_report_over_no_data_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no finished experiment in"):
        write(tmp_path / "results", "quick", tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_a_missing_page_is_said(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no report at .*run gnm reproduce first"):
        check_report.check(tmp_path / "index.html", "chromium")


def test_without_chromium_the_check_is_skipped_with_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(check_report, "browser", lambda: None)

    assert check_report.main(parse(check_report, [str(tmp_path)])) == {"skipped": True}
    assert "skipped, Chromium is not installed" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(check_report.browser() is None, reason="Chromium is not installed")
def test_the_page_opens_sorts_and_complains_of_nothing(html: str, tmp_path: Path) -> None:
    path = tmp_path / "index.html"
    path.write_text(html, encoding="utf-8")
    chromium = str(check_report.browser())

    found = check_report.check(path, chromium)

    assert found["claims"] == len(claims())
    for shot in found["screenshots"].values():
        pixels = plt.imread(shot)
        assert pixels.std() > 0.05, "a picture of something"

    path.write_text(html.replace("</body>", "<script>nothing.there()</script></body>"), "utf-8")
    with pytest.raises(ValueError, match=r"wrote to its console: .*nothing is not defined"):
        check_report.check(path, chromium)


def test_what_the_forensics_found_is_shown_if_it_is_of_that_size(tmp_path: Path) -> None:
    found = {
        "size": "quick",
        "tried": {
            "ways of training": 72,
            "protocols": 576,
            "pattern seeds": {"coarse": "0", "fine": "1", "confirmed": "500–501"},
        },
        "numbers": [{}] * 17,
        "protocols": [{"name": "authors, cap 1,000", "points": "11.6", "back": 10}],
        "unexplained": ["α 0.08"],
        "hypotheses": [{"words": "it explains", "verdict": "holds", "numbers": "+1"}],
        "caption": "Each number.",
    }
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "FORENSICS.svg").write_text("<svg></svg>")
    (tmp_path / "forensics.json").write_text(json.dumps(found))
    assert shown_forensics(tmp_path, "paper") is None
    assert shown_forensics(tmp_path / "nowhere", "quick") is None

    told = record(world(as_in_the_paper, ("F1",), 2), COSTS, "quick")
    html = page(told, [], {}, shown_forensics(tmp_path, "quick"))
    assert "authors, cap 1,000</td><td>11.6</td><td>10 of 17" in html
    assert "under none of these: α 0.08." in html
    assert "data:image/svg+xml;base64" in html


def test_a_forest_plot_stands_beside_its_claim() -> None:
    results = world(as_in_the_paper, ("CONDITIONS",), 4)
    told = record(results, COSTS, "quick")
    html = page(told, [], {"F7a+": "data:image/svg+xml,<svg></svg>"})
    assert html.count('class="forest"') == 1
    rows = {row["id"]: row["forest"] for row in told["claims"]}
    assert rows["F7a+"]["paper"] == 0.06
    assert rows["F7a"] is None
