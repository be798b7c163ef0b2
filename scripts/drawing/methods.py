"""Figures 6 and 7: other neurons and other learning rules."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drawing import style
from experiments.map_claims import SILENT
from experiments.method_claims import paired, ratio, ratios
from experiments.methods import F7_LEARNERS, REFRACTORY
from experiments.statistics import bootstrap, by_seed, mean, median, score, wins
from experiments.training import STARTS
from experiments.verdict import Results


def refractory(results: Results) -> Figure:
    """Score of the LIF over that of the GNM against the refractory period."""
    figure, grid = style.panels(1, 2, width=style.WIDE, height=2.7, sharey=True)
    for axes, start, name in zip(grid[0], STARTS, "ab", strict=True):
        for classes, colour, mark in ((1, style.BLUE, "o"), (3, style.RED, "s")):
            lif, gnm = ratios(results["F6"], classes, start)
            band = np.array([
                bootstrap(lambda a, b, k=k: float(ratio(a[:, [k]], b)[0]), lif, gnm, resamples=500)
                for k in range(len(REFRACTORY))
            ])  # fmt: skip
            words = "one class" if classes == 1 else "three classes"
            axes.fill_between(REFRACTORY, band[:, 1], band[:, 2], color=colour, alpha=0.18, lw=0)
            axes.plot(REFRACTORY, band[:, 0], color=colour, marker=mark, ms=3, lw=1.2, label=words)
        axes.axhline(1.0, color=style.INK, lw=0.9, ls="--", zorder=1)
        axes.set(xlabel="refractory period (bins)", xlim=(-0.5, REFRACTORY[-1] + 0.5))
        axes.set_yscale("log")
        axes.set_yticks((0.05, 0.1, 0.2, 0.5, 1, 2, 5), minor=False)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.minorticks_off()
        style.letter(axes, f"{name}   {start} initial weights")
    grid[0, 0].set_ylabel("noisy performance, LIF / GNM")
    grid[0, 0].legend(loc="lower left")
    return figure


def comparison(results: Results) -> Figure:
    """Scores of all methods on two classes, seed by seed, and the paired differences."""
    figure, grid = style.panels(2, 2, width=style.WIDE, height=5.4)
    for column, start in enumerate(STARTS):
        values = _by_method(results, start)
        _points(grid[0, column], values)
        _differences(grid[1, column], values)
        style.letter(grid[0, column], f"{'ab'[column]}   {start} initial weights")
        style.letter(grid[1, column], "cd"[column])
    grid[0, 0].set_ylabel(style.BINS)
    grid[1, 0].set_ylabel("paired difference (bins)")
    for row in grid:
        low, high = min(a.get_ylim()[0] for a in row), max(a.get_ylim()[1] for a in row)
        for axes in row:
            axes.set_ylim(low, high)
    return figure


def _by_method(results: Results, start: str) -> dict[str, tuple[NDArray[Any], NDArray[Any]]]:
    """Seeds and scores of each method."""
    data = results["F7"]
    seeds = data["pattern_seed"].to_numpy()
    values = {name: (seeds, paired(data, start, name)) for name in F7_LEARNERS}
    if "BP" in results:
        network = results["BP"].sel(classes=2)
        values["BP"] = network["pattern_seed"].to_numpy(), by_seed(score(network))
    return values


def _points(axes: Axes, values: dict[str, tuple[NDArray[Any], NDArray[Any]]]) -> None:
    """One point per seed; mean with its interval, and the median as a bar."""
    jitter = np.random.default_rng(0)
    styles = zip(values.items(), style.METHOD_COLOURS, style.METHOD_MARKS, strict=False)
    for place, ((_, (_, scores)), colour, mark) in enumerate(styles):
        x = place + jitter.uniform(-0.22, 0.22, len(scores))
        axes.plot(x, scores, mark, ms=2.8, color=colour, alpha=0.55, mew=0)
        centre = mean(scores)
        axes.hlines(median(scores).value, place - 0.3, place + 0.3, color=style.INK, lw=1.6)
        axes.errorbar(
            place + 0.36, centre.value, [[centre.value - centre.low], [centre.high - centre.value]],
            fmt="D", ms=4, color=style.INK, mfc="white", lw=1.2,
        )  # fmt: skip
    axes.set_xticks(
        range(len(values)), [name.replace(", ", "\n").replace("ulated", ".") for name in values]
    )
    axes.set_xlim(-0.6, len(values) - 0.4)
    style.silent_line(axes, SILENT)


def _differences(axes: Axes, values: dict[str, tuple[NDArray[Any], NDArray[Any]]]) -> None:
    """Differences between methods on the same seed, mean with interval, and the count of wins."""
    pairs = [
        ("MST, ALL", "GNM, ALL"),
        ("GNM, ET", "GNM, ALL"),
        ("GNM, ET modulated", "GNM, ALL"),
        ("BP", "GNM, ET"),
        ("BP", "GNM, ET modulated"),
    ]
    shown = [pair for pair in pairs if pair[0] in values]
    jitter = np.random.default_rng(0)
    for place, (first, second) in enumerate(shown):
        a, b = _common(values[first], values[second])
        if not len(a):  # BP may have seeds of its own
            continue
        difference, found = a - b, wins(a, b)
        x = place + jitter.uniform(-0.2, 0.2, len(difference))
        ahead = difference > 0
        axes.plot(x[ahead], difference[ahead], "^", ms=3, color=style.BLUE, alpha=0.6, mew=0)
        axes.plot(x[~ahead], difference[~ahead], "v", ms=3, color=style.RED, alpha=0.6, mew=0)
        centre = mean(difference)
        axes.errorbar(
            place + 0.33, centre.value, [[centre.value - centre.low], [centre.high - centre.value]],
            fmt="D", ms=4, color=style.INK, mfc="white", lw=1.2,
        )  # fmt: skip
        axes.annotate(
            f"{found.wins}/{found.pairs}", (place, 0.99), xycoords=("data", "axes fraction"),
            ha="center", va="top", fontsize=7,
        )  # fmt: skip
    axes.axhline(0, color=style.INK, lw=0.9, ls="--", zorder=1)
    labels = [f"{_short(a)}\n− {_short(b)}" for a, b in shown]
    axes.set_xticks(range(len(shown)), labels, fontsize=6)
    axes.set_xlim(-0.6, len(shown) - 0.4)
    axes.margins(y=0.14)


def _short(name: str) -> str:
    return {"MST, ALL": "MST", "GNM, ALL": "ALL", "GNM, ET": "ET",
            "GNM, ET modulated": "ET mod."}.get(name, name)  # fmt: skip


def _common(
    first: tuple[NDArray[Any], NDArray[Any]], second: tuple[NDArray[Any], NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The scores of both on the seeds that both have."""
    _, a, b = np.intersect1d(first[0], second[0], return_indices=True)
    return first[1][a], second[1][b]
