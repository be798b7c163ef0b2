from __future__ import annotations

import json
import math

import pytest
from matplotlib.colors import to_hex

from agents.experiments.forest import MOST_OF_A_RATIO, described, draw_forest, small
from agents.experiments.statistics import Interval
from agents.experiments.verdict import Forest, Mark
from agents.plotting import BLUE, RED, WIDE, panels

MARKS = (
    Mark("matched", Interval(1.0, 0.9, 1.1), True),
    Mark("wide", Interval(9.0, 8.0, 10.0), False),
    Mark("authors", Interval(0.5, math.nan, math.nan), False),
)
RATIO = Forest("LIF / GNM", 0.8, 1.25, MARKS)


def drawn(forest: Forest) -> tuple[list[float], list[str]]:
    """Where the points stand, and their colours."""
    _, grid = panels(1, 1, width=WIDE, height=2.0)
    draw_forest(grid[0, 0], forest)
    points = [line for line in grid[0, 0].lines if line.get_marker() in ("o", ">")]
    return [float(p.get_xdata()[0]) for p in points], [to_hex(p.get_color()) for p in points]


def test_what_agrees_is_blue_and_what_lies_beyond_stands_at_the_end() -> None:
    places, colours = drawn(RATIO)
    assert places == [1.0, MOST_OF_A_RATIO, 0.5]
    assert colours == [to_hex(BLUE), to_hex(RED), to_hex(RED)]


def test_bins_are_drawn_where_they_are_on_a_logarithmic_axis() -> None:
    marks = (Mark("matched", Interval(8_000.0, 7_000.0, 9_000.0), False),)
    assert drawn(Forest("bins", 188, 754, marks, 377, logarithmic=True))[0] == [8_000.0]


def test_a_plot_is_told_in_numbers_too() -> None:
    told = json.loads(json.dumps(described(RATIO), allow_nan=False))
    assert told["band"] == [0.8, 1.25]
    assert told["paper"] is None
    assert told["ours"][2] == {"under": "authors", "value": [0.5, None, None], "holds": False}


@pytest.mark.parametrize("forest", [RATIO, RATIO._replace(marks=MARKS[:1])])
def test_a_small_figure_grows_with_its_rows(forest: Forest) -> None:
    assert small(forest).get_figheight() == pytest.approx(0.55 + 0.16 * len(forest.marks))


def test_a_row_may_have_a_number_of_the_papers_own() -> None:
    own = RATIO._replace(marks=(MARKS[0]._replace(at=0.81), MARKS[1]))
    assert [row.get("paper") for row in described(own)["ours"]] == [0.81, None]
    _, grid = panels(1, 1, width=WIDE, height=2.0)
    draw_forest(grid[0, 0], own)
    lines = [part for part in grid[0, 0].collections if hasattr(part, "get_segments")]
    ends = [part.get_segments()[0][:, 0].tolist() for part in lines]
    assert [0.81, 0.81] in ends
