"""Forest plots: our number under each condition, with its interval, beside the paper's."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from agents.experiments.verdict import Forest
from agents.plotting import BLUE, GREY, INK, RED, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_OF_A_RATIO = 3.0
"""Where the axis of a ratio ends; a point beyond stands at the end, as a triangle."""


def draw_forest(axes: Axes, forest: Forest, *, names: bool = True) -> None:
    """The band in which the claim holds, shaded; the paper's number, a line; ours, a row each.

    A row with a number of the paper's own has a short line at it.

    Blue agrees, red does not. `names` says whether the rows are labelled.
    """
    values = [mark.value for mark in forest.marks]
    ends = [end for value in values for end in value if math.isfinite(end)]
    if forest.logarithmic:
        axes.set_xscale("log")
        wanted = [end for end in (*ends, forest.low, forest.at) if end]
        axes.set_xlim(0.7 * min(wanted), 1.4 * max(wanted))
        axes.minorticks_off()
        steps = [step * 10.0**power for power in range(5) for step in (1, 2, 5)]
        axes.set_xticks([step for step in steps if axes.get_xlim()[0] < step < axes.get_xlim()[1]])
        axes.xaxis.set_major_formatter("{x:,g}")
    else:
        axes.set_xlim(0, min(max(*ends, 1.05 * min(forest.high, 1.5)), MOST_OF_A_RATIO))
    left, right = axes.get_xlim()
    axes.axvspan(max(forest.low, left), min(forest.high, right), color=GREY, alpha=0.25, lw=0)
    if forest.at is not None:
        axes.axvline(forest.at, color=INK, lw=0.9)
    for row, mark in enumerate(forest.marks):
        if mark.at is not None:
            axes.vlines(mark.at, row - 0.4, row + 0.4, color=INK, lw=0.9)
        colour, inside = BLUE if mark.holds else RED, mark.value.value <= right
        if math.isfinite(mark.value.low):
            axes.hlines(row, mark.value.low, mark.value.high, color=colour, lw=1.2)
        axes.plot(
            min(mark.value.value, right), row, "o" if inside else ">", ms=3.2, color=colour,
            clip_on=False,
        )  # fmt: skip
    axes.set_ylim(len(forest.marks) - 0.5, -0.5)
    rows = range(len(forest.marks))
    axes.set_yticks(rows, [mark.label if names else "" for mark in forest.marks])
    axes.tick_params(labelsize=6)


def small(forest: Forest) -> Figure:
    """One forest plot as a small figure, to stand beside its claim."""
    figure, grid = panels(1, 1, width=3.0, height=0.55 + 0.16 * len(forest.marks))
    draw_forest(grid[0, 0], forest)
    grid[0, 0].set_xlabel(forest.unit, fontsize=6)
    return figure


def described(forest: Forest) -> dict[str, Any]:
    """A forest plot for JSON, and for those who cannot see it."""

    def plain(number: float | None) -> float | None:
        return None if number is None or not math.isfinite(number) else float(number)

    return {
        "unit": forest.unit,
        "paper": plain(forest.at),
        "band": [plain(forest.low), plain(forest.high)],
        "ours": [
            {
                "under": mark.label,
                "value": [plain(end) for end in mark.value],
                "holds": mark.holds,
                **({} if mark.at is None else {"paper": mark.at}),
            }
            for mark in forest.marks
        ],
    }
