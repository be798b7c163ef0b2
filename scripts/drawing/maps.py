"""Figures 3 to 5: maps of noisy performance over α and η, and what is read off them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drawing import style
from experiments.map_analysis import Line, best, optimal_line, residuals
from experiments.map_claims import MST_ROWS, SILENT
from experiments.statistics import score
from experiments.verdict import Results

_CLASS_NAMES = {1: "one class", 2: "two classes", 3: "three classes", 4: "four classes"}


def one_class(results: Results) -> Figure:
    """Maps for one class at two caps, and performance against α."""
    return _one_class(results["F3"], results["table"], "matched")


def one_class_published(results: Results) -> Figure:
    """The same from the published initial weights."""
    return _one_class(results["F3-published"], results["table"], "published")


def _one_class(maps: xr.Dataset, table: xr.Dataset, start: str) -> Figure:
    figure = style.plt.figure(figsize=(style.WIDE, 5.6))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1))
    row = table.sel(classes=1, learner=MST_ROWS[start])
    line = optimal_line(_average(maps.sel(classes=1)))
    for column, (name, cap) in enumerate((("a", 1_000), ("b", 10_000))):
        axes = figure.add_subplot(grid[0, column])
        mst = float(score(row, cap).mean())
        scores = _average(maps.sel(classes=1), cap)
        heat_map(axes, scores, mst, line if cap == 10_000 else None, gap=0.05)
        style.letter(axes, f"{name}   cap {cap:,} bins")
    curves(axes := figure.add_subplot(grid[1, :]), _average(maps.sel(classes=1)))
    style.letter(axes, "c")
    return figure


def more_classes(results: Results) -> Figure:
    """Maps for two, three and four classes, readout V above readout D."""
    maps, table = results["F4"], results["table"]
    figure, grid = style.panels(2, 3, width=style.WIDE, height=5.0)
    for column, classes in enumerate(maps["classes"].to_numpy()):
        mst = float(score(table.sel(classes=classes, learner=MST_ROWS["matched"])).mean())
        for row, readout in enumerate(("V", "D")):
            axes, scores = grid[row, column], _average(maps.sel(classes=classes, readout=readout))
            line = optimal_line(scores) if readout == "V" else None
            heat_map(axes, scores, mst, line, gap=0.09)
            name = "abcdef"[3 * row + column]
            style.letter(axes, f"{name}   {_CLASS_NAMES[int(classes)]}, {readout}")
    return figure


def edge_note(maps: xr.Dataset) -> str:
    """For a caption: which α* lie at an end of the range in which they were sought, if any do."""
    lines = {int(c): optimal_line(_average(maps.sel(classes=c))) for c in maps["classes"]}
    ends = [f"{line.alpha:g} ({_CLASS_NAMES[c]})" for c, line in lines.items() if line.at_edge]
    if not ends:
        return ""
    return (
        f" Found at an end of that range, so that the best may lie beyond: α* = {', '.join(ends)}."
    )


def heat_map(
    axes: Axes, scores: xr.DataArray, mst: float, line: Line | None, *, gap: float
) -> None:
    """Scores (eta, alpha); best cell, optimal line, and the MST's score on the colour bar.

    `gap` is the space between map and colour bar, as a share of the panel's width.
    """
    etas, alphas = scores["eta"].to_numpy(), scores["alpha"].to_numpy()
    top = best(scores)
    mesh = axes.pcolormesh(
        _edges(etas), _edges(alphas), scores.transpose("alpha", "eta").to_numpy(),
        cmap=style.MAP, vmin=0, rasterized=True,
    )  # fmt: skip
    axes.set(xlabel="η (model choice)", ylabel="α (decay per bin)", xlim=(etas[0], etas[-1]))
    axes.set_ylim(alphas[-1], alphas[0])  # α = η = 0 at the top left, as in the paper
    axes.plot(
        top.eta, top.alpha, "X", ms=8, mfc=style.RED, mec="white", mew=1.0, clip_on=False, zorder=5
    )
    if line is not None:
        height = np.linspace(line.alpha, alphas[-1], 100)
        for colour, width in (("white", 2.6), (style.INK, 1.3)):
            axes.plot(1 - line.alpha / height, height, "--", color=colour, lw=width)
    _colour_bar(axes, mesh, mst, gap)


def _colour_bar(axes: Axes, mesh: QuadMesh, mst: float, gap: float) -> None:
    """The colour bar, with the MST's mark beside it."""
    bar = axes.figure.colorbar(mesh, ax=axes, pad=gap, fraction=0.06, aspect=30)
    bar.ax.tick_params(length=2)
    bar.set_label(style.BINS)
    bar.outline.set_linewidth(0.5)
    high = mesh.get_clim()[1]
    bar.ax.axhline(min(mst, high), color="white", lw=4)
    bar.ax.axhline(min(mst, high), color=style.BLUE, lw=2.2)
    bar.ax.annotate(
        f"MST\n{mst:,.0f}" + (" ↑" if mst > high else ""), (0.0, min(mst, high)),
        xycoords=("axes fraction", "data"), xytext=(-2, 0), textcoords="offset points",
        ha="right", va="center", fontsize=6, color=style.BLUE, annotation_clip=False,
    )  # fmt: skip


def curves(axes: Axes, scores: xr.DataArray) -> None:
    """Scores against α, one line per η; η = 0 stands out."""
    alphas = scores["alpha"].to_numpy()
    rows = scores.transpose("eta", "alpha")
    others = rows.sel(eta=rows["eta"] > 0).to_numpy()
    lines = [np.column_stack([alphas, row]) for row in others]
    label = f"{len(others)} values of η > 0"
    axes.add_collection(
        LineCollection(lines, colors=style.BLUE, linewidths=0.7, alpha=0.45, label=label)
    )
    axes.plot(alphas, rows.sel(eta=0.0), color=style.RED, lw=2.0, marker="o", ms=2.5, label="η = 0")
    axes.set(xlabel="α (decay per bin)", ylabel=style.BINS, xlim=(0, 1))
    axes.set_ylim(0, 1.08 * float(scores.max()))
    style.silent_line(axes, SILENT)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, handlelength=1.5)


def against_alpha(results: Results) -> Figure:
    """Performance against α for two, three and four classes."""
    maps = results["F4"].sel(readout="V")
    figure, grid = style.panels(1, 3, width=style.WIDE, height=2.4)
    for axes, classes, name in zip(grid[0], maps["classes"].to_numpy(), "abc", strict=True):
        curves(axes, _average(maps.sel(classes=classes)))
        style.letter(axes, f"{name}   {_CLASS_NAMES[int(classes)]}")
        axes.get_legend().remove()
    grid[0, 0].legend(loc="upper left", fontsize=6)
    for axes in grid[0, 1:]:
        axes.set_ylabel("")
    return figure


def residual_plot(results: Results) -> Figure:
    """Best over α at each η minus the best at η = 0, run by run, for one to four classes."""
    figure, grid = style.panels(2, 2, width=style.WIDE, height=4.6, sharex=True)
    maps: Mapping[int, xr.Dataset] = {1: results["F3"].sel(classes=1)} | {
        c: results["F4"].sel(readout="V", classes=c) for c in (2, 3, 4)
    }
    for axes, (classes, data), name in zip(grid.flat, maps.items(), "abcd", strict=True):
        _residuals(axes, data)
        style.letter(axes, f"{name}   {_CLASS_NAMES[classes]}")
    for axes in grid[1]:
        axes.set_xlabel("η (model choice)")
    for axes in grid[:, 0]:
        axes.set_ylabel("residual (bins)")
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(),
        loc="outside lower center", ncols=5, title="pattern seed", title_fontsize=7,
    )  # fmt: skip
    return figure


def _residuals(axes: Axes, data: xr.Dataset) -> None:
    residual, error = residuals(data)
    seeds = residual["pattern_seed"].to_numpy()
    etas = residual["eta"].to_numpy()
    # So that runs do not hide each other; more than five share the room of five.
    places = max(len(seeds), 5)
    apart, middle = 0.6 / places * np.diff(etas).min(), (places - 1) / 2
    for place, seed in enumerate(seeds):
        run, turn = {"pattern_seed": seed}, place // len(_MARKS)
        mark = _MARKS[place % len(_MARKS)]
        colour = style.METHOD_COLOURS[(place + turn) % len(style.METHOD_COLOURS)]
        axes.errorbar(
            etas + (place - middle) * apart, residual.sel(run), error.sel(run),
            fmt=mark, ms=3.2, lw=0.6, color=colour, mfc="white" if mark in "sD" else colour,
            mew=0.8, label=str(seed),
        )  # fmt: skip
    axes.axhline(0, color=style.INK, lw=0.9, ls="--", zorder=1)


_MARKS = ("o", "s", "^", "D", "v")


def _average(data: xr.Dataset, cap: int | None = None) -> xr.DataArray:
    return score(data, cap).mean("pattern_seed")


def _edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Borders of cells around values that need not be evenly spaced."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
