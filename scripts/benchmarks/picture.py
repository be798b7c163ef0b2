"""The findings as one picture: targets reached, other software, growth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from statistics import median
from typing import Any, cast

from benchmarks.report import number, sections
from benchmarks.rows import BEST_ONLY, MET, MISSED, Curve, Findings, Row, Target

COLOURS = {MET: "#2a7f62", BEST_ONLY: "#d9a441", MISSED: "#b8433b"}
GREY = "#8a8a8a"
WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
"""Behind labels that the target's line runs through."""


def draw(found: Findings, path: str | os.PathLike[str]) -> None:
    """Draw to `path`, a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    sought = [(row, target) for row in found.rows for target in row.targets if _drawable(row)]
    beside = [rows for section, rows in sections(found.rows) if "beside" in section]
    height = max(8.0, 0.27 * len(sought) + 2.5)
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = plt.figure(figsize=(16, height), layout="constrained")
        left, right = cast(Any, figure.subfigures(1, 2))
        if sought:
            _targets(left.add_subplot(), sought)
        panels_of = _by_symbol(found.curves)
        n_rows = 1 + (len(panels_of) + 2) // 3
        panels = right.subplots(
            n_rows, 3, squeeze=False, gridspec_kw={"height_ratios": [1.3] + [1.0] * (n_rows - 1)}
        )
        grid = panels[0, 0].get_gridspec()
        for panel in panels.flat:
            panel.remove()
        if beside:
            _others(right.add_subplot(grid[0, :]), [row for rows in beside for row in rows])
        for k, curves in enumerate(panels_of):
            _growth(right.add_subplot(grid[1 + k // 3, k % 3]), curves)
        machine = found.machine
        title = f"{machine['processor']}, {machine['instructions']}; Python {machine['python']}"
        figure.suptitle(title, fontsize=9, color=GREY)
        figure.savefig(path, dpi=110)
        plt.close(figure)


def _drawable(row: Row) -> bool:
    """Counts that are to be 0 have no place on an axis of ratios."""
    return all(target.bound > 0 for target in row.targets)


def _targets(axes: Any, sought: Sequence[tuple[Row, Target]]) -> None:
    """One bar per target, on an axis where 1 is the target and more is better."""
    places = _places([row.section for row, _ in sought])
    for place, (row, target) in zip(places, sought, strict=True):
        reach = [_reach(row, target, value) for value in _values(row, target)]
        typical = median(reach)
        axes.barh(place, typical, height=0.72, color=COLOURS[row.reached(target)])
        axes.plot([min(reach), max(reach)], [place, place], color="black", lw=1)
        label = _label(row, target)
        axes.text(max(reach) * 1.04, place, label, va="center", fontsize=7.5, bbox=WHITE, zorder=5)
    axes.axvline(1.0, color="black", lw=1.2, ls=(0, (4, 2)))
    axes.set_xscale("log")
    reaches = [_reach(row, t, v) for row, t in sought for v in _values(row, t)]
    low, high = min(0.5, *reaches), max(2.0, *reaches)
    axes.set_xlim(low / 1.2, high * (high / low) ** 0.55)
    axes.set_yticks(places, [_name(row, target) for row, target in sought])
    axes.set_ylim(max(places) + 0.7, -1.6)
    first: dict[str, float] = {}
    for place, (row, _) in zip(places, sought, strict=True):
        first.setdefault(row.section, place)
    for section, place in first.items():
        axes.text(
            low / 1.15, place - 0.78, section, fontsize=8, fontweight="bold", va="center",
            bbox=WHITE, zorder=4,
        )  # fmt: skip
    axes.set_xlabel("times the target (dashed), further right is better; line: all repeats")
    axes.tick_params(axis="y", length=0)
    ticks = [t for t in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if low / 1.2 <= t <= high * 1.2]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()


def _places(names: Sequence[str]) -> list[float]:
    """Heights of the bars, with room for a heading where a new section begins."""
    places, height = [], 0.0
    for k, name in enumerate(names):
        height += 1.0 if k and name == names[k - 1] else 2.0 if k else 0.0
        places.append(height)
    return places


def _values(row: Row, target: Target) -> Sequence[float]:
    return row.ratios if target.of == "ratio" else row.values


def _reach(row: Row, target: Target, value: float) -> float:
    """`value` over the target, or the target over it where less is better."""
    more = target.of == "ratio" or row.more_is_better
    return value / target.bound if more else target.bound / max(value, 1e-12)


def _name(row: Row, target: Target) -> str:
    return f"{row.name}, ratio" if target.of == "ratio" else row.name


def _label(row: Row, target: Target) -> str:
    if target.of == "ratio":
        fast = number(median(row.ratios))
        return f"{fast} × as fast as {row.against} (≥ {number(target.bound)})"
    sign = "≥" if row.more_is_better else "≤"
    return f"{number(row.median)} {row.unit} ({sign} {number(target.bound)})"


def _others(axes: Any, rows: Sequence[Row]) -> None:
    """Speeds of ours and of other software, logarithmic."""
    places = _places([row.section for row in rows])
    for place, row in zip(places, rows, strict=True):
        ours = row.name.startswith("agents")
        axes.barh(place, row.median, height=0.7, color=COLOURS[MET] if ours else GREY)
        axes.plot([min(row.values), max(row.values)], [place, place], color="black", lw=1)
        text = number(row.median) + (f"  ({number(median(row.ratios))} ×)" if row.ratios else "")
        axes.text(max(row.values) * 1.1, place, text, va="center", fontsize=7.5)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xlim(low, high * 4)
    axes.set_yticks(places, [row.name for row in rows])
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set_xlabel(rows[0].unit)
    axes.set_title("The same arithmetic by other software, one core", fontsize=9)


def _by_symbol(curves: Sequence[Curve]) -> list[list[Curve]]:
    """Curves over the same quantity share a panel."""
    panels: dict[str, list[Curve]] = {}
    for curve in curves:
        panels.setdefault(curve.symbol, []).append(curve)
    return list(panels.values())


def _growth(axes: Any, curves: Sequence[Curve]) -> None:
    """Times against size; the times logarithmic too if they differ much."""
    lowest = min(min(v) for curve in curves for v in curve.values)
    highest = max(max(v) for curve in curves for v in curve.values)
    for curve, colour in zip(curves, (COLOURS[MET], "#4a6fa5", GREY), strict=False):
        middle = [median(values) for values in curve.values]
        if curve.flat:
            ends = [share * (max(middle) + min(middle)) / 2 for share in (0.8, 1.2)]
            axes.axhspan(*ends, color=colour, alpha=0.13, lw=0, zorder=0, label="±20 %")
        spread = ([min(v) for v in curve.values], [max(v) for v in curve.values])
        axes.fill_between(curve.sizes, *spread, color=colour, alpha=0.25, lw=0)
        axes.plot(curve.sizes, middle, "o-", color=colour, ms=3.5, lw=1.3, label=curve.label or "_")
    axes.set_xscale("log")
    if highest > 8 * lowest:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.3 * highest)
    if len(curves) > 1 or curves[0].flat:
        axes.legend(frameon=False, fontsize=7, loc="lower left").set_in_layout(False)
    axes.set_xlabel(curves[0].symbol)
    axes.set_ylabel(curves[0].unit, fontsize=8)
    axes.set_title(f"by {curves[0].name.partition(',')[0]}", fontsize=9)
