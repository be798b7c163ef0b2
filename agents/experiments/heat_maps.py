"""F3, F4 and F5: noisy performance over the whole plane of α and η, and what is read off it.

Unless a claim's rule says otherwise its number is a mean over pattern seeds of the noisy
performance, with the 95 % percentile bootstrap interval over seeds. With five seeds that interval
is narrow rather than wide: the rules therefore compare it with generous bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import (
    PER_THOUSAND,
    bootstrap,
    by_seed,
    counts_of,
    mean,
    means,
    mistake_rates,
    score,
    typical_rate,
)
from agents.experiments.training import (
    RUN,
    alpha_axis,
    class_counts,
    eta_axis,
    pattern_seeds,
    training,
)
from agents.experiments.verdict import (
    Claim,
    Finding,
    Forest,
    Mark,
    Results,
    Tried,
    from_both_starts,
)
from agents.plotting import BINS, BLUE, INK, MAP, RED, WIDE, band, letter, panels, silent_line
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

_COARSE = (0, 1, 2, 3, 4, 6, 8, 10, 12, 16, 20, 24, 28, 32, 36, 40)
ALPHA = {"quick": tuple(k / 40 for k in _COARSE), "paper": tuple(k / 40 for k in range(41))}
ETA = {"quick": tuple(k / 10 for k in range(11)), "paper": ALPHA["paper"]}
SEEDS = {"quick": range(2), "paper": range(5)}

READOUT = Axis.named(
    "readout",
    # D = αV has to reach the threshold, which bounded weights would forbid at small α.
    {"V": {"readout": "V"}, "D": {"readout": "D", "weight_bounds": None}},
    long_name="variable that is compared with the readout threshold",
)


def _plane(size: str, seeds: tuple[int, ...] | None) -> tuple[Axis, Axis, Axis]:
    # Three columns of η a block: some ten seconds of work, and enough neurons side by side.
    return (
        pattern_seeds(seeds or SEEDS[size]),
        eta_axis(ETA[size], chunk=3),
        alpha_axis(ALPHA[size]),
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

CAP = RUN["cap"]
CAP_OF_A = 1_000
"""The cap of the paper's figure 3a."""

MST_PAPER = 377.0
BEST_PAPER = 200.0
"""Bins: the paper's MST on one class, and its best cell at four."""

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
    held, words, marks = {}, [], []
    for start, row in MST_ROWS.items():
        for cap in (CAP, CAP_OF_A):
            value = mean(by_seed(score(table.sel(learner=row), cap)))
            held[start, cap] = MST_PAPER / 2 <= value.value <= MST_PAPER * 2
            words.append(f"{start}, cap {cap:,}: {value:,.0f} bins")
            marks.append(Mark(f"{start}, cap {cap:,}", value, held[start, cap]))
    conditions = {
        f"the initial weights are the {start} ones and the cap is {cap:,}": holds
        for (start, cap), holds in held.items()
    }
    holds = held["matched", CAP] and held["wide", CAP]
    forest = Forest("bins", MST_PAPER / 2, MST_PAPER * 2, tuple(marks), MST_PAPER, logarithmic=True)
    return Finding(holds, conditions, tuple(words), forest=forest)


def _judge_classes(results: Results) -> Finding:
    """F4: more classes."""
    four = score(results["F4"]).sel(readout="V")
    maps = {1: _one_class(results, "matched")} | {c: four.sel(classes=c) for c in (2, 3, 4)}
    tops = {c: best(_average(scores)) for c, scores in maps.items()}
    last = maps[4].sel(eta=tops[4].eta, alpha=tops[4].alpha)
    interval = mean(by_seed(last))
    falls = all(tops[c + 1].score < tops[c].score for c in (1, 2, 3))
    number = "best cell: " + ", ".join(f"{top.score:,.0f}" for top in tops.values())
    holds = falls and 100 <= interval.value <= 400
    marks = (Mark("matched", interval, holds),)
    return Finding(
        holds,
        {},
        (f"{number} bins for 1, 2, 3, 4 classes", f"at four: {interval:,.0f}"),
        forest=Forest("bins at four classes", 100, 400, marks, BEST_PAPER, logarithmic=True),
    )


def _judge_low_cap(results: Results) -> Finding:
    """F3f: the map at the cap of figure 3a, both readouts."""
    low = {f"readout V, {start}": _one_class(results, start, CAP_OF_A) for start in _MAPS}
    low["readout D, matched"] = score(results["SPIKINESS"], CAP_OF_A).sel(classes=1, readout="D")
    found = {name: _low_cap(scores) for name, scores in low.items()}
    marks = tuple(Mark(name, one.value, one.holds) for name, one in found.items() if one.value)
    return Finding.of(
        {name: one.holds for name, one in found.items()},
        (f"{name}: {one.words}" for name, one in found.items()),
        "it is {} initial weights",
        Forest("score at η = 0, α = 0.3 / best cell", NEAR_BEST, 1.0, marks),
    )


NEAR_BEST = 0.95


def _low_cap(scores: xr.DataArray) -> Tried:
    """Whether a map fails at its edge, falls to α = 1, and is best near η = 0, α = 0.3."""
    column = scores.sel(eta=0.0)
    edge = mean(by_seed(column.sel(alpha=0.05)))
    fall = mean(by_seed(column.sel(alpha=0.3) - column.sel(alpha=1.0)))
    cells = by_seed(scores, "eta", "alpha")
    at = int(np.flatnonzero(np.isclose(scores["alpha"], 0.3))[0])

    def near_best(sample: NDArray[np.float64]) -> float:
        average = sample.mean(axis=0)
        return float(average[0, at] / average.max())

    near = bootstrap(near_best, cells)
    return Tried(
        edge.below(FAILURE) and fall.above(0.0) and near.value >= NEAR_BEST,
        f"{edge:,.0f} bins at α = 0.05; fall from α = 0.3 to 1: {fall:,.0f}; (0, 0.3) has "
        f"{near:.0%} of the best cell's {float(_average(scores).max()):,.0f}",
        value=near,
    )


def _judge_eta_zero(results: Results) -> Finding:
    """F5a: η = 0 among the best."""
    four = score(results["F4"]).sel(readout="V")

    def share(sample: NDArray[np.float64]) -> float:
        average = sample.mean(axis=0)
        return float(average[0].max() / average.max())

    found = {c: bootstrap(share, by_seed(four.sel(classes=c), "eta", "alpha")) for c in (2, 3, 4)}
    held = {c: value.value >= 0.9 for c, value in found.items()}
    words = ", ".join(f"{c} classes {value:.0%}" for c, value in found.items())
    told = f"best at η = 0 as a share of the best at any η: {words}"
    return Finding.of(held, (told,), "the task has {} classes")


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
        "F3f",
        "Fig. 3a",
        "One class, counted up to 1,000 bins: failure at α, η ≈ 0, a fall as α → 1, the best at "
        "η = 0, α ≈ 0.3",
        "GNM, ALL, 60,000 trials, cap 1,000; readout V from matched and wide initial weights, on "
        "the maps of figure 3; readout D with unbounded weights from matched ones, on the coarse "
        "map of D6",
        f"reproduced if at η = 0 the score at α = 0.05 has an interval below {FAILURE:.0f} bins, "
        "the paired fall from α = 0.3 to α = 1 one above 0, and α = 0.3 has at least "
        f"{NEAR_BEST:.0%} of the best cell, for both readouts and, with V, from both starts; "
        "conditional on them",
        ("F3", "F3-wide", "SPIKINESS"),
        _ONE,
        _judge_low_cap,
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
    """Maps for one class at two caps and as mistake rates, and performance against α."""
    from matplotlib.figure import Figure

    maps = results[_MAPS[start]].sel(classes=1)
    mst = _mst(results, 1, start)
    figure = Figure(figsize=(WIDE, 6.6))
    rows = figure.add_gridspec(2, 1, height_ratios=(1.25, 1))
    top = rows[0].subgridspec(1, 3)
    for column, (name, cap) in enumerate((("a", CAP_OF_A), ("b", CAP), ("d", None))):
        axes = figure.add_subplot(top[column])
        if cap is None:
            rate_map(axes, maps, _mst_rate(mst))
            letter(axes, f"{name}   mistakes")
        else:
            levels = [*_mst_score(mst, cap), PAPER_LEVELS["MST"]]
            scores = _average(score(maps, cap))
            line = optimal_line(scores) if cap == CAP else None
            score_map(axes, scores, levels, line)
            letter(axes, f"{name}   capped at {cap:,}")
        axes.set_ylabel(_ALPHA_LABEL if name == "a" else "")
    curves(axes := figure.add_subplot(rows[1]), score(maps))
    letter(axes, "c")
    return figure


def _draw_more_classes(results: Results, readout: str) -> Figure:
    """Maps for two, three and four classes: capped score above mistake rate."""
    maps = results["F4"].sel(readout=readout)
    figure, grid = panels(2, 3, width=WIDE, height=7.2)
    for column, classes in enumerate(counts_of(maps)):
        one = maps.sel(classes=classes)
        mst = _mst(results, classes, "matched")
        levels = [PAPER_LEVELS["best"]] if classes == 4 else []
        scores = _average(score(one))
        line = optimal_line(scores) if readout == "V" else None
        score_map(grid[0, column], scores, [*_mst_score(mst), *levels], line)
        rate_map(grid[1, column], one, _mst_rate(mst))
        for row, name in enumerate(("abc"[column], "def"[column])):
            grid[row, column].set_ylabel("" if column else _ALPHA_LABEL)
            letter(grid[row, column], f"{name}   {CLASS_NAMES[classes]}")
    return figure


def _edge_note(maps: xr.Dataset) -> str:
    """For a caption: which α* lie at an end of the range in which they were sought, if any do."""
    lines = {c: optimal_line(_average(score(maps.sel(classes=c)))) for c in counts_of(maps)}
    ends = [f"{line.alpha:g} ({CLASS_NAMES[c]})" for c, line in lines.items() if line.at_edge]
    if not ends:
        return ""
    return (
        f" Found at an end of that range, so that the best may lie beyond: α* = {', '.join(ends)}."
    )


class Level(NamedTuple):
    """A number to be marked on a colour bar: whose it is, in the bar's units, and its colour."""

    name: str
    value: float
    colour: str


PAPER_LEVELS = {"MST": Level("paper", MST_PAPER, INK), "best": Level("paper", BEST_PAPER, INK)}

_ALPHA_LABEL = "α (decay per bin)"


def score_map(axes: Axes, scores: xr.DataArray, levels: Sequence[Level], line: Line | None) -> None:
    """Scores (eta, alpha) in bins, with the best cell and the optimal line."""
    top = best(scores)
    mesh = _plane_of_colours(axes, scores, cmap=MAP, vmin=0)
    axes.plot(top.eta, top.alpha, "X", ms=7, mfc=RED, mec="white", mew=1.0, clip_on=False, zorder=5)
    if line is not None:
        height = np.linspace(line.alpha, float(scores["alpha"][-1]), 100)
        for colour, width in (("white", 2.6), (INK, 1.3)):
            axes.plot(1 - line.alpha / height, height, "--", color=colour, lw=width)
    _colour_bar(axes, mesh, levels).set_label(BINS)


def rate_map(axes: Axes, maps: xr.Dataset, levels: Sequence[Level]) -> None:
    """Mistake rates of a map (pattern_seed, eta, alpha, run), the typical one over the seeds."""
    from matplotlib.colors import LogNorm

    rates = typical_rate(mistake_rates(maps))
    # The few neurons that never stop erring would take half of the colours for themselves.
    lowest = min([float(rates.min()), *(level.value for level in levels)])
    ends = lowest, float(rates.quantile(0.98))
    # Bright is good in every map: here few mistakes.
    mesh = _plane_of_colours(axes, rates, cmap=f"{MAP}_r", norm=LogNorm(*ends))
    bar = _colour_bar(axes, mesh, levels)
    steps = (1, 2, 5) if ends[1] < 100 * ends[0] else (1,)
    ticks = [step * 10.0**power for power in range(-4, 4) for step in steps]
    bar.set_ticks([tick for tick in ticks if ends[0] <= tick <= ends[1]])
    bar.ax.xaxis.set_major_formatter("{x:g}")
    bar.ax.minorticks_off()
    bar.set_label(PER_THOUSAND)


def _mst(results: Results, classes: int, start: str) -> xr.Dataset | None:
    """The MSTs of many pattern seeds on the same task; None where the experiment has none."""
    neurons = results["NEURONS"]
    if classes not in neurons["classes"]:
        return None
    return neurons.sel(classes=classes, start=start, learner="MST")


def _mst_score(mst: xr.Dataset | None, cap: int | None = None) -> list[Level]:
    return [] if mst is None else [Level("MST", float(score(mst, cap).mean()), BLUE)]


def _mst_rate(mst: xr.Dataset | None) -> list[Level]:
    return [] if mst is None else [Level("MST", float(typical_rate(mistake_rates(mst))), BLUE)]


def _plane_of_colours(axes: Axes, values: xr.DataArray, **how: Any) -> QuadMesh:
    etas, alphas = values["eta"].to_numpy(), values["alpha"].to_numpy()
    mesh = axes.pcolormesh(
        _edges(etas), _edges(alphas), values.transpose("alpha", "eta").to_numpy(),
        rasterized=True, **how,
    )  # fmt: skip
    axes.set(xlabel="η (model choice)", ylabel=_ALPHA_LABEL, xlim=(etas[0], etas[-1]))
    axes.set_ylim(alphas[-1], alphas[0])  # α = η = 0 at the top left, as in the paper
    return mesh


def _colour_bar(axes: Axes, mesh: QuadMesh, levels: Sequence[Level]) -> Colorbar:
    """A colour bar below the map, with levels marked on it and named above it."""
    bar = axes.figure.colorbar(mesh, ax=axes, location="bottom", pad=0.07, fraction=0.05, aspect=22)
    bar.ax.tick_params(length=2)
    bar.outline.set_linewidth(0.5)
    low, high = (float(end) for end in mesh.get_clim())
    shown = sorted(levels, key=lambda level: level.value)
    at = np.clip([level.value for level in shown], low, high)
    places = [float(place) for place in np.asarray(mesh.norm(at))]
    for level, place, side in zip(shown, places, sides(places), strict=True):
        for colour, width in (("white", 3.6), (level.colour, 1.8)):
            bar.ax.axvline(min(max(level.value, low), high), color=colour, lw=width)
        bar.ax.annotate(
            f"{level.name} {_short_number(level.value)}{' →' if level.value > high else ''}",
            (place, 1.0), xycoords="axes fraction", xytext=(_NUDGE[side], 1.5),
            textcoords="offset points", ha=side, va="bottom", fontsize=6, color=level.colour,
            annotation_clip=False,
        )  # fmt: skip
    return bar


_NUDGE = {"right": 4, "center": 0, "left": -4}
"""Points by which a name is moved along its bar: it still begins or ends above its mark."""


def sides(places: Sequence[float]) -> list[str]:
    """How to align names at these places of a bar, in order, so that none hides another."""
    if len(places) == 2 and places[1] - places[0] < 0.35:
        return ["right", "left"]
    return ["left" if at < 0.15 else "right" if at > 0.85 else "center" for at in places]


def _short_number(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def curves(axes: Axes, scores: xr.DataArray) -> None:
    """Scores (pattern_seed, eta, alpha) against α, one line per η.

    η = 0 and the best η > 0 stand out, with 95 % intervals over the pattern seeds.
    """
    from matplotlib.collections import LineCollection

    alphas = scores["alpha"].to_numpy()
    rows = _average(scores).transpose("eta", "alpha")
    spiky = rows.sel(eta=rows["eta"] > 0)
    lines = [np.column_stack([alphas, row]) for row in spiky.to_numpy()]
    label = f"{len(lines)} values of η > 0"
    axes.add_collection(LineCollection(lines, colors=BLUE, linewidths=0.6, alpha=0.3, label=label))
    ahead = best(spiky).eta
    for eta, colour, look in ((ahead, BLUE, "s--"), (0.0, RED, "o-")):
        found = means(by_seed(scores.sel(eta=eta), "alpha"))
        band(axes, alphas, found, look, color=colour, lw=1.6, ms=2.5, label=f"η = {eta:g}")
    axes.set(xlabel=_ALPHA_LABEL, ylabel=BINS, xlim=(0, 1))
    axes.set_ylim(0, 1.05 * float(scores.max()))
    silent_line(axes, SILENT)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=3, handlelength=2)


def _draw_against_alpha(results: Results) -> Figure:
    """Performance against α for two, three and four classes."""
    maps = results["F4"].sel(readout="V")
    figure, grid = panels(3, 1, width=WIDE, height=6.4, sharex=True)
    for axes, classes, name in zip(grid[:, 0], counts_of(maps), "abc", strict=True):
        curves(axes, score(maps.sel(classes=classes)))
        letter(axes, f"{name}   {CLASS_NAMES[classes]}")
        axes.label_outer()
    return figure


def _edges(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Borders of cells around values that need not be evenly spaced."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


EXPERIMENTS = {"F3": one_class, "F3-wide": one_class_wide, "F4": more_classes}
_MARKS = (
    "The cross marks the best cell, the dashed curve the best line (1−η)α = α*, sought in α* = "
    "0.05 … 0.5. On the colour bars: blue, what the MST reaches on the same task (on the "
    "pattern seeds of D7, those of the map among them); black, the paper's own number"
)
_RATES = (
    "mistakes per 1,000 bins on a logarithmic scale, geometric mean over pattern seeds, which no "
    "cap holds; bright is good here too"
)
_BANDS = (
    "red is η = 0, dashed the η > 0 with the best cell, both with 95 % bootstrap intervals over "
    "pattern seeds"
)

PICTURES = {
    "F3": Picture(
        lambda results: draw_one_class(results, "matched"),
        ("F3", "NEURONS"),
        "One class, matched initial weights. Mean over pattern seeds of the noisy performance, "
        f"counted up to 1,000 bins (a) and up to 10,000 (b). {_MARKS}, 377 for its MST. (c) The "
        f"numbers of b against α; {_BANDS}. (d) The same neurons: {_RATES}.",
        lambda results: _edge_note(results["F3"]),
    ),
    "F3-wide": Picture(
        lambda results: draw_one_class(results, "wide"),
        ("F3-wide", "NEURONS"),
        "As the figure before, from the wide initial weights (GNM 0.3, MST 0.2).",
        lambda results: _edge_note(results["F3-wide"]),
    ),
    "F4": Picture(
        lambda results: _draw_more_classes(results, "V"),
        ("F4", "NEURONS"),
        "Two, three and four classes, read out from the membrane potential V. (a–c) Noisy "
        f"performance, capped at 10,000 bins, mean over pattern seeds. {_MARKS}, ≈ 200 for its "
        f"best cell at four classes. (d–f) The same neurons: {_RATES}. Every colour bar has its "
        "own scale.",
        lambda results: _edge_note(results["F4"].sel(readout="V")),
    ),
    "F4-D": Picture(
        lambda results: _draw_more_classes(results, "D"),
        ("F4", "NEURONS"),
        "As the figure before, read out from the decay D, with unbounded weights.",
    ),
    "F5a": Picture(
        _draw_against_alpha,
        ("F4",),
        "Noisy performance against α for two, three and four classes, readout V; " + _BANDS + ".",
    ),
}
