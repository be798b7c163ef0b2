"""F3, F4 and F5: noisy performance over the whole plane of α and η, and what is read off it.

Unless a claim's rule says otherwise its number is a mean over pattern seeds of the noisy
performance, with the 95 % percentile bootstrap interval over seeds. With five seeds that interval
is narrow rather than wide: the rules therefore compare it with generous bounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import bootstrap, by_seed, mean, score
from agents.experiments.training import class_counts, pattern_seeds, training
from agents.experiments.verdict import Claim, Finding, Results, Tried, from_both_starts
from agents.plotting import (
    BINS,
    BLUE,
    INK,
    MAP,
    RED,
    WIDE,
    letter,
    panels,
    silent_line,
)
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

_COARSE = (0, 1, 2, 3, 4, 6, 8, 10, 12, 16, 20, 24, 28, 32, 36, 40)
ALPHA = {
    "quick": tuple(k / 40 for k in _COARSE),
    "paper": tuple(k / 40 for k in range(41)),
}
ETA = {"quick": tuple(k / 10 for k in range(11)), "paper": ALPHA["paper"]}
SEEDS = {"quick": range(2), "paper": range(5)}

READOUT = Axis(
    "readout",
    ("V", "D"),
    # D = αV has to reach the threshold, which bounded weights would forbid at small α.
    settings=({"readout": "V"}, {"readout": "D", "weight_bounds": None}),
    long_name="variable that is compared with the readout threshold",
)


def _plane(size: str, seeds: tuple[int, ...] | None) -> tuple[Axis, Axis, Axis]:
    # Three columns of η a block: some ten seconds of work, and enough neurons side by side.
    return (
        pattern_seeds(seeds or SEEDS[size]),
        Axis("eta", ETA[size], chunk=3, long_name="η, model choice"),
        Axis("alpha", ALPHA[size], chunk=0, units="1/bin", long_name="α, decay per bin"),
    )


def one_class(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The map for one class."""
    axes = (class_counts(1), *_plane(size, seeds))
    return training("F3", "Noisy performance over α and η, one class", axes, keep_weights=True)


def one_class_wide(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The same map from the wide initial weights."""
    axes = (class_counts(1), *_plane(size, seeds))
    title = "Noisy performance over α and η, one class, wide initial weights"
    return training("F3-wide", title, axes, keep_weights=True, start="wide")


def more_classes(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The maps for two, three and four classes, read out by V and by D."""
    axes = (READOUT, class_counts(2, 3, 4), *_plane(size, seeds))
    title = "Noisy performance over α and η, two to four classes, readouts V and D"
    return training("F4", title, axes, keep_weights=True)


# --- what is read off a map ----------------------------------------------------------------------

LINES = np.arange(0.05, 0.501, 0.005)
"""Candidates for α*, 0.05 … 0.5; each line runs from (η = 0, α = α*) to α = 1.

A best line at either end says only that α* lies there or beyond.
"""

Weights = NDArray[np.float64]

_POINTS = 60
"""Points at which a line is looked up, evenly spaced in α."""


class Cell(NamedTuple):
    """A cell of the map, and its score in bins."""

    eta: float
    alpha: float
    score: float


class Line(NamedTuple):
    """The best line (1−η)α = α*, and the mean score along it."""

    alpha: float
    score: float

    @property
    def at_edge(self) -> bool:
        """Whether α* is the smallest or the largest candidate: the best may lie beyond."""
        return self.alpha in (float(LINES[0]), float(LINES[-1]))


def best(scores: xr.DataArray) -> Cell:
    """The best cell of a map (eta, alpha)."""
    at = scores.isel(scores.argmax(["eta", "alpha"]))
    return Cell(float(at["eta"]), float(at["alpha"]), float(at))


def optimal_line(scores: xr.DataArray) -> Line:
    """The line (1−η)α = α* with the highest mean score from α = α* to α = 1."""
    plane = scores.transpose("eta", "alpha")
    # Scores between cells are interpolated, so that a mean along a line is a sum over cells.
    points = np.linspace(LINES, 1.0, _POINTS, axis=1)
    on_line = interpolation(1 - LINES[:, None] / points, plane["eta"].to_numpy())
    at_alpha = interpolation(points, plane["alpha"].to_numpy())
    means = np.einsum("lpe,lpa,ea->l", on_line, at_alpha, plane.to_numpy()) / _POINTS
    place = int(means.argmax())
    return Line(float(LINES[place]), float(means[place]))


def interpolation(at: Weights, grid: Weights) -> Weights:
    """Weights (…, grid) of linear interpolation between grid values."""
    right = np.clip(np.searchsorted(grid, at), 1, len(grid) - 1)
    share = (at - grid[right - 1]) / (grid[right] - grid[right - 1])
    weights = np.zeros((*at.shape, len(grid)))
    np.put_along_axis(weights, right[..., None], share[..., None], -1)
    np.put_along_axis(weights, right[..., None] - 1, 1 - share[..., None], -1)
    return weights


# --- the claims ----------------------------------------------------------------------------------

SILENT = Task().silent_score
FAILURE = 2 * SILENT
"""A region fails if its mean is below twice the score of a neuron that never spikes."""

MST_PAPER = 377.0
MST_ROWS = {"matched": "MST, ALL", "wide": "wide: MST 0.2, ALL"}

_MAPS = {"matched": "F3", "wide": "F3-wide"}
_ONE = "gnm/PatternStream-v0, 1 class"
_MORE = "gnm/PatternStream-v0, 2, 3 and 4 classes"
_MAP_PROTOCOL = (
    "GNM, ALL, 60,000 trials, readout V; noisy performance over 100 streams, capped at 10,000; "
    "matched and wide initial weights"
)


def _one_class(results: Results, start: str, cap: int | None = None) -> xr.DataArray:
    return score(results[_MAPS[start]], cap).squeeze("classes", drop=True)


def _average(scores: xr.DataArray) -> xr.DataArray:
    return scores.mean("pattern_seed")


def _judge_edges(results: Results) -> Finding:
    """F3a: failure at the edges."""

    def judge(start: str) -> Tried:
        scores = _one_class(results, start)
        corner = scores.sel(alpha=scores["alpha"] <= 0.05, eta=scores["eta"] <= 0.05)
        spiky = scores.sel(eta=scores["eta"] >= 0.975)
        low, high = (mean(by_seed(part.mean(["eta", "alpha"]))) for part in (corner, spiky))
        return Tried(
            low.below(FAILURE) and high.below(FAILURE),
            f"{start}: α, η ≤ 0.05 {low:,.0f}; η ≥ 0.975 {high:,.0f} bins",
        )

    return from_both_starts(judge)


RISE_END = 0.08
LATE_RISE_END = 0.2


def _judge_rise(results: Results) -> Finding:
    """F3b: the steep rise."""

    def judge(start: str) -> Tried:
        scores = _one_class(results, start)
        column = scores.sel(eta=0.0)
        low = mean(by_seed(column.sel(alpha=0.05)))
        top = best(_average(scores)).score
        means = _average(column)
        reached = means["alpha"][(means >= 0.9 * top) & (means["alpha"] > 0.05)]
        end = float(reached.min()) if reached.size else np.inf
        fails = low.below(FAILURE)
        return Tried(
            fails and end <= RISE_END,
            f"{start}: {low:,.0f} bins at α = 0.05, {float(means.sel(alpha=0.075)):,.0f} at 0.075; "
            f"90 % of the best cell's {top:,.0f} from α = {end:g}",
            fails and end <= LATE_RISE_END,
        )

    return from_both_starts(judge, f"the rise may take until α = {LATE_RISE_END:g}")


def _judge_best(results: Results) -> Finding:
    """F3c: the best cell."""

    def judge(start: str) -> Tried:
        scores = _one_class(results, start)
        column = by_seed(scores.sel(eta=0.0, alpha=[0.3, 1.0]))
        fall = mean(column[:, 0] - column[:, 1])
        top = best(_average(scores))
        share = float(_average(scores).sel(eta=0.0, alpha=0.3)) / top.score
        falls = fall.above(0.0)
        return Tried(
            falls and top.eta == 0.0 and 0.2 <= top.alpha <= 0.4,
            f"{start}: best cell η = {top.eta:g}, α = {top.alpha:g} with {top.score:,.0f} bins; "
            f"(0, 0.3) has {share:.0%} of it; fall from α = 0.3 to 1: {fall:,.0f}",
            falls and share >= 0.95,
        )

    return from_both_starts(judge, "“best” means within 5 % of the best cell")


def _judge_mst(results: Results) -> Finding:
    """F3e: the MST's mark."""
    table = results["table"].sel(classes=1)
    held, words = {}, []
    for start, row in MST_ROWS.items():
        for cap in (10_000, 1_000):
            value = mean(by_seed(score(table.sel(learner=row), cap)))
            held[start, cap] = MST_PAPER / 2 <= value.value <= MST_PAPER * 2
            words.append(f"{start}, cap {cap:,}: {value:,.0f} bins")
    conditions = {
        f"the initial weights are the {start} ones and the cap is {cap:,}": holds
        for (start, cap), holds in held.items()
    }
    holds = held["matched", 10_000] and held["wide", 10_000]
    return Finding(holds, conditions, tuple(words))


def _judge_classes(results: Results) -> Finding:
    """F4: more classes."""
    four = score(results["F4"]).sel(readout="V")
    maps = {1: _one_class(results, "matched")} | {c: four.sel(classes=c) for c in (2, 3, 4)}
    tops = {c: best(_average(scores)) for c, scores in maps.items()}
    last = maps[4].sel(eta=tops[4].eta, alpha=tops[4].alpha)
    interval = mean(by_seed(last))
    falls = all(tops[c + 1].score < tops[c].score for c in (1, 2, 3))
    number = "best cell: " + ", ".join(f"{top.score:,.0f}" for top in tops.values())
    return Finding(
        falls and 100 <= interval.value <= 400,
        {},
        (f"{number} bins for 1, 2, 3, 4 classes", f"at four: {interval:,.0f}"),
    )


def _judge_eta_zero(results: Results) -> Finding:
    """F5a: η = 0 among the best."""
    four = score(results["F4"]).sel(readout="V")

    def share(sample: NDArray[np.float64]) -> float:
        average = sample.mean(axis=0)
        return float(average[0].max() / average.max())

    found = {
        c: bootstrap(share, by_seed(four.sel(classes=c).transpose("pattern_seed", "eta", "alpha")))
        for c in (2, 3, 4)
    }
    held = {c: value.value >= 0.9 for c, value in found.items()}
    words = [f"{c} classes {value:.0%}" for c, value in found.items()]
    return Finding(
        all(held.values()),
        {f"the task has {c} classes": holds for c, holds in held.items()},
        ("best at η = 0 as a share of the best at any η: " + ", ".join(words),),
    )


CLAIMS = (
    Claim(
        "F3a",
        "Fig. 3a, b",
        "One class, 41 × 41 values of α and η, 5 pattern seeds: the neuron fails at α, η ≈ 0 and "
        "as η → 1",
        _MAP_PROTOCOL,
        "reproduced if the mean over α, η ≤ 0.05 and the mean over η ≥ 0.975 both have intervals "
        f"below {FAILURE:.0f} bins, twice the silent score, from both starts",
        ("F3", "F3-wide"),
        _ONE,
        _judge_edges,
    ),
    Claim(
        "F3b",
        "Fig. 3, text",
        "At η = 0, going from α = 0.05 to 0.08 takes it from about 0 to the global best",
        _MAP_PROTOCOL,
        f"reproduced if at η = 0 the interval at α = 0.05 is below {FAILURE:.0f} bins and 90 % of "
        f"the best cell's mean is reached by α = {RISE_END:g}, from both starts; conditional if it "
        f"is reached by α = {LATE_RISE_END:g}",
        ("F3", "F3-wide"),
        _ONE,
        _judge_rise,
    ),
    Claim(
        "F3c",
        "Fig. 3c",
        "Performance falls again as α → 1; the best lies at η = 0, α ≈ 0.3",
        _MAP_PROTOCOL,
        "reproduced if the paired fall from α = 0.3 to α = 1 at η = 0 has an interval above 0 and "
        "the best cell has η = 0 and 0.2 ≤ α ≤ 0.4, from both starts; conditional if it falls so "
        "and (0, 0.3) reaches 95 % of the best cell",
        ("F3", "F3-wide"),
        _ONE,
        _judge_best,
    ),
    Claim(
        "F3e",
        "Fig. 3, caption",
        f"The MST averages ≈ {MST_PAPER:.0f} on one class",
        "MST, ALL, 60,000 trials; matched and wide initial weights; caps 10,000 and 1,000",
        f"reproduced if the mean lies within a factor of 2 of {MST_PAPER:.0f} at cap 10,000 from "
        "both starts; conditional on start and cap",
        ("table",),
        _ONE,
        _judge_mst,
    ),
    Claim(
        "F4",
        "Fig. 4",
        "The same map for 2, 3 and 4 classes: a quick fall with the number of classes, at best ≈ "
        "200 bins at four",
        _MAP_PROTOCOL.replace("; matched and wide initial weights", "; matched initial weights"),
        "reproduced if the best cell's mean falls with every class added and lies in 100 … 400 "
        "bins at four classes",
        ("F3", "F4"),
        _MORE,
        _judge_classes,
    ),
    Claim(
        "F5a",
        "Fig. 5a",
        "η = 0 is among the best whatever α",
        "the data of F4, readout V",
        "reproduced if for 2, 3 and 4 classes the best mean over α at η = 0 is at least 90 % of "
        "the best mean over all cells; conditional on the number of classes",
        ("F4",),
        _MORE,
        _judge_eta_zero,
    ),
)

# --- the figures ---------------------------------------------------------------------------------

CLASS_NAMES = {1: "one class", 2: "two classes", 3: "three classes", 4: "four classes"}


def draw_one_class(results: Results, start: str) -> Figure:
    """Maps for one class at two caps, and performance against α."""
    from matplotlib.figure import Figure

    maps, table = results[_MAPS[start]], results["table"]
    figure = Figure(figsize=(WIDE, 5.6))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1))
    row = table.sel(classes=1, learner=MST_ROWS[start])
    line = optimal_line(_average(score(maps.sel(classes=1))))
    for column, (name, cap) in enumerate((("a", 1_000), ("b", 10_000))):
        axes = figure.add_subplot(grid[0, column])
        mst = float(score(row, cap).mean())
        scores = _average(score(maps.sel(classes=1), cap))
        heat_map(axes, scores, mst, line if cap == 10_000 else None, gap=0.05)
        letter(axes, f"{name}   cap {cap:,} bins")
    curves(axes := figure.add_subplot(grid[1, :]), _average(score(maps.sel(classes=1))))
    letter(axes, "c")
    return figure


def _draw_more_classes(results: Results) -> Figure:
    """Maps for two, three and four classes, readout V above readout D."""
    maps, table = results["F4"], results["table"]
    figure, grid = panels(2, 3, width=WIDE, height=5.0)
    for column, classes in enumerate(maps["classes"].to_numpy()):
        mst = float(score(table.sel(classes=classes, learner=MST_ROWS["matched"])).mean())
        for row, readout in enumerate(("V", "D")):
            axes, scores = (
                grid[row, column],
                _average(score(maps.sel(classes=classes, readout=readout))),
            )
            line = optimal_line(scores) if readout == "V" else None
            heat_map(axes, scores, mst, line, gap=0.09)
            name = "abcdef"[3 * row + column]
            letter(axes, f"{name}   {CLASS_NAMES[int(classes)]}, {readout}")
    return figure


def _edge_note(maps: xr.Dataset) -> str:
    """For a caption: which α* lie at an end of the range in which they were sought, if any do."""
    lines = {int(c): optimal_line(_average(score(maps.sel(classes=c)))) for c in maps["classes"]}
    ends = [f"{line.alpha:g} ({CLASS_NAMES[c]})" for c, line in lines.items() if line.at_edge]
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
        cmap=MAP, vmin=0, rasterized=True,
    )  # fmt: skip
    axes.set(xlabel="η (model choice)", ylabel="α (decay per bin)", xlim=(etas[0], etas[-1]))
    axes.set_ylim(alphas[-1], alphas[0])  # α = η = 0 at the top left, as in the paper
    axes.plot(top.eta, top.alpha, "X", ms=8, mfc=RED, mec="white", mew=1.0, clip_on=False, zorder=5)
    if line is not None:
        height = np.linspace(line.alpha, alphas[-1], 100)
        for colour, width in (("white", 2.6), (INK, 1.3)):
            axes.plot(1 - line.alpha / height, height, "--", color=colour, lw=width)
    _colour_bar(axes, mesh, mst, gap)


def _colour_bar(axes: Axes, mesh: QuadMesh, mst: float, gap: float) -> None:
    """The colour bar, with the MST's mark beside it."""
    bar = axes.figure.colorbar(mesh, ax=axes, pad=gap, fraction=0.06, aspect=30)
    bar.ax.tick_params(length=2)
    bar.set_label(BINS)
    bar.outline.set_linewidth(0.5)
    high = mesh.get_clim()[1]
    bar.ax.axhline(min(mst, high), color="white", lw=4)
    bar.ax.axhline(min(mst, high), color=BLUE, lw=2.2)
    bar.ax.annotate(
        f"MST\n{mst:,.0f}" + (" ↑" if mst > high else ""), (0.0, min(mst, high)),
        xycoords=("axes fraction", "data"), xytext=(-2, 0), textcoords="offset points",
        ha="right", va="center", fontsize=6, color=BLUE, annotation_clip=False,
    )  # fmt: skip


def curves(axes: Axes, scores: xr.DataArray) -> None:
    """Scores against α, one line per η; η = 0 stands out."""
    from matplotlib.collections import LineCollection

    alphas = scores["alpha"].to_numpy()
    rows = scores.transpose("eta", "alpha")
    others = rows.sel(eta=rows["eta"] > 0).to_numpy()
    lines = [np.column_stack([alphas, row]) for row in others]
    label = f"{len(others)} values of η > 0"
    axes.add_collection(LineCollection(lines, colors=BLUE, linewidths=0.7, alpha=0.45, label=label))
    axes.plot(alphas, rows.sel(eta=0.0), color=RED, lw=2.0, marker="o", ms=2.5, label="η = 0")
    axes.set(xlabel="α (decay per bin)", ylabel=BINS, xlim=(0, 1))
    axes.set_ylim(0, 1.08 * float(scores.max()))
    silent_line(axes, SILENT)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, handlelength=1.5)


def _draw_against_alpha(results: Results) -> Figure:
    """Performance against α for two, three and four classes."""
    maps = results["F4"].sel(readout="V")
    figure, grid = panels(1, 3, width=WIDE, height=2.4)
    for axes, classes, name in zip(grid[0], maps["classes"].to_numpy(), "abc", strict=True):
        curves(axes, _average(score(maps.sel(classes=classes))))
        letter(axes, f"{name}   {CLASS_NAMES[int(classes)]}")
        axes.get_legend().remove()
    grid[0, 0].legend(loc="upper left", fontsize=6)
    for axes in grid[0, 1:]:
        axes.set_ylabel("")
    return figure


def _edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Borders of cells around values that need not be evenly spaced."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


EXPERIMENTS = {"F3": one_class, "F3-wide": one_class_wide, "F4": more_classes}
PICTURES = {
    "F3": Picture(
        lambda results: draw_one_class(results, "matched"),
        ("F3", "table"),
        "One class, matched initial weights. Mean over pattern seeds of the noisy performance, "
        "counted up to 1,000 bins (a) and up to 10,000 (b). The cross marks the best cell, the "
        "blue line on the colour bar what the MST reaches on the same task, the dashed curve the "
        "best line (1−η)α = α*, sought in α* = 0.05 … 0.5. (c) The same numbers against α; red is "
        "η = 0.",
        lambda results: _edge_note(results["F3"]),
    ),
    "F3-wide": Picture(
        lambda results: draw_one_class(results, "wide"),
        ("F3-wide", "table"),
        "As the figure before, from the wide initial weights (GNM 0.3, MST 0.2).",
        lambda results: _edge_note(results["F3-wide"]),
    ),
    "F4": Picture(
        _draw_more_classes,
        ("F4", "table"),
        "Two, three and four classes, read out from the membrane potential V (upper row) and from "
        "the decay D with unbounded weights (lower row). Marks as before; every colour bar has its "
        "own scale.",
        lambda results: _edge_note(results["F4"].sel(readout="V")),
    ),
    "F5a": Picture(
        _draw_against_alpha,
        ("F4",),
        "Noisy performance against α for two, three and four classes, readout V. Red is η = 0.",
    ),
}
