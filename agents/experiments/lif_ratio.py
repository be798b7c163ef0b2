"""F6: LIF neurons of every refractory period beside the GNM."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.methods import GNM_ALL, LIF_ALL, initial_weights
from agents.experiments.statistics import Interval, bootstrap, by_seed, rate, score
from agents.experiments.training import STARTS, class_counts, learners, pattern_seeds, training
from agents.experiments.verdict import Claim, Finding, Forest, Results, Tried, from_both_starts
from agents.plotting import BLUE, INK, RED, WIDE, band, letter, panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

REFRACTORY = tuple(range(26))
"""Refractory periods, in bins."""

SEEDS = {"quick": 6, "paper": 48}


def refractory(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """LIF neurons of every refractory period beside a GNM, one and three classes."""
    rows = {"GNM": GNM_ALL, **{f"LIF {n}": {**LIF_ALL, "refractory": n} for n in REFRACTORY}}
    axes = (
        class_counts(1, 3),
        pattern_seeds(seeds or range(SEEDS[size])),
        initial_weights(),
        learners(rows),
    )
    return training("F6", "LIF against GNM, by refractory period", axes)


# --- the claims ----------------------------------------------------------------------------------

COMPARABLE = (0.8, 1.25)
FLAT = 1e-9
"""Slopes up to this are rounding."""

_LIF = [f"LIF {n}" for n in REFRACTORY]


def ratios(results: xr.Dataset, classes: int, start: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Scores of the LIF neurons (seeds, refractory periods) and of the GNM (seeds, 1)."""
    scores = score(results).sel(classes=classes, start=start)
    return by_seed(scores.sel(learner=_LIF)), by_seed(scores.sel(learner=["GNM"]))


def ratio(lif: NDArray[Any], gnm: NDArray[Any]) -> Any:
    """Mean score of the LIF neurons over that of the GNM, one per refractory period."""
    return lif.mean(axis=0) / gnm.mean(axis=0)


def _slope(lif: NDArray[Any], gnm: NDArray[Any]) -> float:
    """Change of the ratio per bin of refractory period, by least squares."""
    return float(np.polyfit(REFRACTORY, ratio(lif, gnm), 1)[0])


def mistakes(
    results: xr.Dataset, classes: int, start: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mistakes and bins survived of GNM, LIF 0, LIF 1, … by pattern seed, (seeds, neurons, 2)."""
    cell = results["survived"].sel(classes=classes, start=start)
    cap = results.attrs["settings"]["common"]["cap"]
    lif, gnm = (by_seed(cell.sel(learner=names), "learner", "run") for names in (_LIF, ["GNM"]))
    counts = [
        np.stack([(part < cap).sum(-1), part.sum(-1)], axis=-1).astype(float) for part in (lif, gnm)
    ]
    return counts[0], counts[1]


def fewer_mistakes(lif: NDArray[np.float64], gnm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mistakes per bin heard of the GNM over those of the LIF, one per refractory period.

    Seeds and runs are pooled, and half a mistake is added, so that a neuron without any has a rate.
    """
    rates = [rate(*part.sum(0).T) for part in (gnm, lif)]
    found: NDArray[np.float64] = rates[0] / rates[1]
    return found


def _growth(lif: NDArray[np.float64], gnm: NDArray[np.float64]) -> float:
    """Factor by which `fewer_mistakes` grows over all refractory periods, by least squares."""
    slope = np.polyfit(REFRACTORY, np.log(fewer_mistakes(lif, gnm)), 1)[0]
    return float(np.exp(slope * REFRACTORY[-1]))


def _ratio_at(refractory: int, lif: NDArray[Any], gnm: NDArray[Any]) -> Interval:
    return bootstrap(lambda a, b: float(ratio(a, b)[refractory]), lif, gnm)


def _ratio_words(start: str, lif: NDArray[Any], gnm: NDArray[Any]) -> str:
    slope = bootstrap(_slope, lif, gnm)
    first, last = _ratio_at(0, lif, gnm), _ratio_at(REFRACTORY[-1], lif, gnm)
    scaled = Interval(*(25 * end for end in slope))
    return (
        f"{start}: ratio {first:.2f} at 0, {last:.2f} at 25 bins, trend over 25 bins {scaled:+.2f}"
    )


def _judge_comparable(results: Results) -> Finding:
    def judge(start: str) -> Tried:
        values = ratio(*ratios(results["F6"], 1, start))
        held = bool(np.all((values >= COMPARABLE[0]) & (values <= COMPARABLE[1])))
        words = _ratio_words(start, *ratios(results["F6"], 1, start))
        return Tried(
            held,
            f"{words}, all in {values.min():.2f} … {values.max():.2f}",
            value=_ratio_at(0, *ratios(results["F6"], 1, start)),
        )

    return from_both_starts(judge, forest=Forest("LIF / GNM at 0 bins", *COMPARABLE, ()))


def _judge_rise(results: Results) -> Finding:
    def judge(start: str) -> Tried:
        lif, gnm = mistakes(results["F6"], 1, start)
        ends = [
            bootstrap(lambda a, b, k=k: float(fewer_mistakes(a, b)[k]), lif, gnm) for k in (0, -1)
        ]
        growth = bootstrap(_growth, lif, gnm)
        return Tried(
            growth.above(1 + FLAT),
            f"{start}: the GNM errs {ends[0]:.2f} times as often as the LIF at 0, {ends[1]:.2f} "
            f"times at {REFRACTORY[-1]} bins; trend over {REFRACTORY[-1]} bins × {growth:.2f}",
            value=growth,
        )

    return from_both_starts(judge, forest=Forest("trend over 25 bins (×)", 1.0, 9.0, ()))


def _judge_three_classes(results: Results) -> Finding:
    def judge(start: str) -> Tried:
        lif, gnm = ratios(results["F6"], 3, start)
        slope = bootstrap(_slope, lif, gnm)
        first = _ratio_at(0, lif, gnm)
        held = first.below(1) and slope.below(-FLAT)
        return Tried(held, _ratio_words(start, lif, gnm), value=first)

    return from_both_starts(judge, forest=Forest("LIF / GNM at 0 bins", 0.0, 1.0, ()))


_PROTOCOL = (
    "GNM (η 0, α 0.3) and LIF (α 0.3, refractory 0 … 25), ALL, 60,000 trials; matched and "
    "wide initial weights"
)

CLAIMS = (
    Claim(
        "F6a1",
        "Fig. 6",
        "One class: LIF over GNM is comparable to 1 at every refractory period",
        _PROTOCOL,
        f"reproduced if the ratio of mean scores stays in {COMPARABLE[0]:g} … {COMPARABLE[1]:g} "
        "for every refractory period, from both starts; conditional on the start",
        ("F6",),
        "gnm/PatternStream-v0, 1 class",
        _judge_comparable,
    ),
    Claim(
        "F6a2",
        "Fig. 6",
        "One class: LIF over GNM rises with the refractory period",
        _PROTOCOL + "; mistakes per bin, since scores that reach their cap of 10,000 on both sides "
        "cannot show a rise",
        "reproduced if the mistakes per bin of the GNM over those of the LIF grow with the "
        "refractory period: least squares on the logarithm has a slope with an interval above 0 "
        "(bootstrap over seeds), from both starts; conditional on the start",
        ("F6",),
        "gnm/PatternStream-v0, 1 class",
        _judge_rise,
    ),
    Claim(
        "F6b",
        "Fig. 6",
        "Three classes: LIF over GNM is below 1 even without a refractory period, and falls with "
        "it",
        _PROTOCOL,
        "reproduced if the ratio at 0 has an interval below 1 and the slope one below 0 (bootstrap "
        "over seeds), from both starts; conditional on the start",
        ("F6",),
        "gnm/PatternStream-v0, 3 classes",
        _judge_three_classes,
    ),
)

# --- the figure ----------------------------------------------------------------------------------


def _draw(results: Results) -> Figure:
    """LIF beside GNM against the refractory period: ratio of scores, ratio of mistake rates."""
    figure, grid = panels(2, 2, width=WIDE, height=4.6, sharex=True, sharey="row")
    measures = ((ratios, ratio), (mistakes, fewer_mistakes))
    for row, (read, compare) in zip(grid, measures, strict=True):
        for axes, start in zip(row, STARTS, strict=True):
            for classes, colour, mark in ((1, BLUE, "o"), (3, RED, "s")):
                lif, gnm = read(results["F6"], classes, start)
                found = np.array([
                    bootstrap(
                        lambda a, b, k=k, f=compare: float(f(a[:, [k]], b)[0]), lif, gnm,
                        resamples=500,
                    )
                    for k in range(len(REFRACTORY))
                ])  # fmt: skip
                words = "one class" if classes == 1 else "three classes"
                band(
                    axes, REFRACTORY, found, f"{mark}-", dense=0.18, color=colour, ms=3, lw=1.2,
                    label=words,
                )  # fmt: skip
            axes.axhline(1.0, color=INK, lw=0.9, ls="--", zorder=1)
            axes.set(xlim=(-0.5, REFRACTORY[-1] + 0.5), yscale="log")
            axes.set_yticks((0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5), minor=False)
            axes.yaxis.set_major_formatter("{x:g}")
            axes.minorticks_off()
    for axes, name in zip(grid.flat, "abcd", strict=True):
        letter(axes, f"{name}   {STARTS['bd'.find(name) >= 0]} initial weights")
    for axes in grid[1]:
        axes.set_xlabel("refractory period (bins)")
    grid[0, 0].set_ylabel("score, LIF / GNM")
    grid[1, 0].set_ylabel("mistakes per bin, GNM / LIF")
    grid[0, 0].legend(loc="lower left")
    return figure


EXPERIMENTS = {"F6": refractory}
PICTURES = {
    "F6": Picture(
        _draw,
        ("F6",),
        "LIF neurons beside the GNM, by refractory period, from both kinds of initial weights; "
        "above the dashed line the LIF is ahead. (a, b) Ratio of mean scores, which a cap of "
        "10,000 bins holds near 1 where both are good. (c, d) Mistakes per bin of the GNM over "
        "those of the LIF, which no cap holds. Bands are 95 % bootstrap intervals over pattern "
        "seeds.",
    )
}
