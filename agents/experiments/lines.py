"""F3d: whether the best neurons lie along (1−η)α = α*, and not along some other line.

The paper's line is compared with other families that begin on the same axis, each at its own best
α*: no η at all, a straight line between the same ends, and lines that bend less and more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Axis, Experiment
from agents.experiments.figures import Picture
from agents.experiments.heat_maps import ALPHA, CLASS_NAMES, ETA, interpolation
from agents.experiments.statistics import Interval, bootstrap, by_seed, counts_of, score
from agents.experiments.training import (
    STARTS,
    alpha_axis,
    class_counts,
    eta_axis,
    pattern_seeds,
    training,
)
from agents.experiments.verdict import Claim, Finding, Results
from agents.plotting import INK, METHOD_COLOURS, METHOD_MARKS, WIDE, legend_above, letter, panels

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

SEEDS = {"quick": range(200, 202), "paper": range(200, 216)}


def planes(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Coarse maps over α and η for one to three classes, from both starts, many pattern seeds."""
    axes = (
        class_counts(1, 2, 3),
        pattern_seeds(seeds or SEEDS[size]),
        Axis("start", STARTS, long_name="initial weights"),
        eta_axis(ETA["quick"]),
        alpha_axis(ALPHA["quick"]),
    )
    return training("LINES", "Noisy performance over α and η, coarse, many runs", axes)


# --- lines through a map -------------------------------------------------------------------------

Array = NDArray[np.float64]
STARS = np.arange(0.05, 0.501, 0.01)
"""Candidates for α*."""
RANGE = np.linspace(0.5, 1.0, 26)
"""The α over which all lines are compared: where each of them, whatever its α*, has an η."""

PAPER = "(1−η)α = α*"
FAMILIES: dict[str, Callable[[Array, Array], Array]] = {
    PAPER: lambda star, alpha: 1 - star / alpha,
    "η = 0": lambda star, alpha: 0 * star * alpha,
    "α − η = α*": lambda star, alpha: alpha - star,
    "(1−η)²α = α*": lambda star, alpha: 1 - np.sqrt(star / alpha),
    "(1−η)α² = α*": lambda star, alpha: 1 - star / alpha**2,
}
"""η of each line, for α* and α; below 0 it is 0."""
RIVALS = [name for name in FAMILIES if name != PAPER]


def weights(family: str) -> Array:
    """Weights (α*, cells) with which the cells of a map make the mean along each line."""
    etas, alphas = np.array(ETA["quick"]), np.array(ALPHA["quick"])
    on_line = np.clip(FAMILIES[family](STARS[:, None], RANGE), 0.0, 1.0)
    at_alpha = interpolation(np.broadcast_to(RANGE, on_line.shape), alphas)
    made = np.einsum("lpe,lpa->lea", interpolation(on_line, etas), at_alpha) / len(RANGE)
    flat: Array = made.reshape(len(STARS), -1)
    return flat


def gains(scores: xr.DataArray) -> tuple[float, Interval, dict[str, Interval]]:
    """α* of the paper's line, the mean along it, and that over each rival's best, in bins.

    `scores` is (pattern_seed, eta, alpha); every line is sought anew in every resample.
    """
    cells = by_seed(scores, "eta", "alpha")
    cells = cells.reshape(len(cells), -1)
    paper = weights(PAPER)

    def best(sample: Array) -> float:
        return float((paper @ sample.mean(axis=0)).max())

    found = {}
    for name in RIVALS:
        other = weights(name)

        def gain(sample: Array, other: Array = other) -> float:
            average = sample.mean(axis=0)
            return float((paper @ average).max() - (other @ average).max())

        found[name] = bootstrap(gain, cells)
    star = float(STARS[int((paper @ cells.mean(axis=0)).argmax())])
    return star, bootstrap(best, cells), found


# --- the claim -----------------------------------------------------------------------------------

FLAT = 1e-6
"""Differences up to this many bins are rounding."""


def _judge(results: Results) -> Finding:
    scores = score(results["LINES"])
    held, words = {}, []
    for classes in counts_of(results["LINES"]):
        for start in STARTS:
            name = f"{CLASS_NAMES[classes]}, {start} initial weights"
            star, mean, found = gains(scores.sel(classes=classes, start=start))
            beaten = any(gain.below(-FLAT) for gain in found.values())
            held[name] = found["η = 0"].above(FLAT) and not beaten
            over = "; ".join(f"{rival} {gain:+,.0f}" for rival, gain in found.items())
            words.append(f"{name}: α* = {star:.2f}, {mean:,.0f} bins; over {over}")
    one = all(holds for name, holds in held.items() if name.startswith(CLASS_NAMES[1]))
    return Finding(one, {f"the task has {name}": h for name, h in held.items()}, tuple(words))


CLAIMS = (
    Claim(
        "F3d",
        "Fig. 3b",
        "An optimal line (1−η)α = α*",
        "GNM, ALL, 60,000 trials, readout V; one, two and three classes; matched and wide "
        "initial weights; 11 values of η and 16 of α; pattern seeds 200 to 215",
        "reproduced if, for one class and from both starts, the mean over α = 0.5 … 1 along the "
        "best line (1−η)α = α* exceeds that at η = 0 with an interval above 0, and is not below "
        "that of the best line of any other family (α − η = α*, (1−η)²α = α*, (1−η)α² = α*) with "
        "an interval below 0 (bootstrap over seeds; α* is the best of 0.05 … 0.5 for each family, "
        "estimated anew each time); conditional on the number of classes and the start",
        ("LINES",),
        "gnm/PatternStream-v0, 1 to 3 classes",
        _judge,
    ),
)

# --- the figure ----------------------------------------------------------------------------------


def _draw(results: Results) -> Figure:
    """What the paper's line gains over each rival, for every task and start."""
    scores, counts = score(results["LINES"]), counts_of(results["LINES"])
    figure, grid = panels(1, len(STARTS), width=WIDE, height=3.2, sharey=True)
    for axes, start, name in zip(grid[0], STARTS, "ab", strict=True):
        for place, classes in enumerate(counts):
            _, mean, found = gains(scores.sel(classes=classes, start=start))
            for k, (rival, gain) in enumerate(found.items()):
                y = place + 0.18 * (k - 1.5)
                share = 100 * np.array(gain) / mean.value
                axes.hlines(y, share[1], share[2], color=METHOD_COLOURS[k + 1], lw=1.4)
                axes.plot(
                    share[0], y, METHOD_MARKS[k + 1], color=METHOD_COLOURS[k + 1], ms=4.5,
                    label=f"over {rival}" if place == 0 else None,
                )  # fmt: skip
        axes.axvline(0, color=INK, lw=0.9, ls="--", zorder=1)
        axes.set_yticks(range(len(counts)), [CLASS_NAMES[c] for c in counts])
        axes.set_xlabel("gain of (1−η)α = α* (% of its score)")
        letter(axes, f"{name}   {start} initial weights")
    grid[0, 0].invert_yaxis()
    legend_above(figure, grid[0, 0], 4)
    return figure


EXPERIMENTS = {"LINES": planes}
PICTURES = {
    "F3d": Picture(
        _draw,
        ("LINES",),
        "Mean score along the best line (1−η)α = α* (α = 0.5 … 1), less that along the best line "
        "of each other family, as a share of the former, with 95 % bootstrap intervals over "
        "pattern seeds. Right of the dashed line the paper's line is the better one.",
    )
}
