"""F3-arc: why the map for one class has a dark arc along (1−η)α ≈ 0.53.

Below threshold a GNM depends on α and η through (1−η)α alone, so neurons of a pattern seed that
share it learn alike, and one that fails makes an arc of them. It fails where its pattern drives the
potential to two peaks of nearly the same height: on one side of the arc the one is the spike that
is owed, on the other side the other, and between them both of them cross. An average over five
pattern seeds shows what happens to one; over many seeds there is no arc.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from agents import GNM, AggregateLabel, NeuronAgent, record
from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import bootstrap, by_seed, means, score
from agents.experiments.training import alpha_axis, class_counts, pattern_seeds, training
from agents.experiments.verdict import Results
from agents.plotting import (
    BINS,
    BLUE,
    GAP,
    GREY,
    INK,
    METHOD_COLOURS,
    METHOD_MARKS,
    RED,
    WIDE,
    band,
    letter,
    panels,
)
from gnm_env import Patterns, Task, Trial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

SEEDS = {"quick": range(6), "paper": range(48)}
"""The first of them are those of the map."""

ARC_SEED = 3
"""The pattern seed whose neurons make the arc of the map at the paper's size."""

ALPHA = tuple(round(0.3 + 0.025 * k, 3) for k in range(21))


def column(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The middle of the map's column at η = 0, for many pattern seeds."""
    axes = (class_counts(1), pattern_seeds(seeds or SEEDS[size]), alpha_axis(ALPHA))
    title = "Noisy performance over α at η = 0, one class, many runs"
    return training("PEAKS", title, axes, keep_weights=True, eta=0.0)


# --- what is read off ----------------------------------------------------------------------------

TIED = 0.98
"""Two peaks are nearly the same if the second has at least this share of the first."""

AROUND = 2
"""A dip is measured against neurons so many steps of α away on either side."""


def potential(data: xr.Dataset, pattern_seed: int, alpha: float) -> NDArray[np.float64]:
    """V of a stored neuron over its pattern alone, with silence around."""
    task = Task(n_classes=1)
    pattern = Patterns.draw(task, pattern_seed).dense()[0]
    neuron = NeuronAgent(GNM(alpha=alpha), AggregateLabel(), n_inputs=task.n_inputs)
    stored = data["weights"].sel(classes=1, pattern_seed=pattern_seed, alpha=alpha)
    neuron.weights = stored.to_numpy()
    raster = np.pad(pattern, ((GAP, GAP), (0, 0)))
    return record(neuron, Trial.from_dense(raster, [GAP], [0], task)).V


def second_peak(V: NDArray[np.float64]) -> float:
    """Height of the second highest peak as a share of the highest; 0 if there is but one."""
    peaks = np.sort(V[1:-1][(V[1:-1] > V[:-2]) & (V[1:-1] >= V[2:])])
    return float(peaks[-2] / peaks[-1]) if len(peaks) > 1 else 0.0


def second_peaks(data: xr.Dataset) -> NDArray[np.float64]:
    """`second_peak` of every neuron, (pattern seeds, α)."""
    return np.array(
        [
            [second_peak(potential(data, int(seed), float(alpha))) for alpha in data["alpha"]]
            for seed in data["pattern_seed"]
        ]
    )


def dips(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how many bins a neuron is below the lower of its two neighbours `AROUND` steps away.

    `scores` is (pattern seeds, α); so is the answer, which has `AROUND` columns less on each side.
    """
    found: NDArray[np.float64] = (
        np.minimum(scores[:, : -2 * AROUND], scores[:, 2 * AROUND :]) - scores[:, AROUND:-AROUND]
    )
    return found


def deepest(scores: NDArray[np.float64]) -> NDArray[np.intp]:
    """For each pattern seed the α, as an index, of its deepest dip."""
    return dips(scores).argmax(1) + AROUND


def _scores(data: xr.Dataset) -> NDArray[np.float64]:
    return by_seed(score(data).sel(classes=1), "alpha")


# --- the figure ----------------------------------------------------------------------------------

LARGEST_ETA = 0.5
"""Beyond, R acts so often that (1−η)α says less."""

_ALPHA_LABEL = "α (decay per bin)"


def _draw(results: Results) -> Figure:
    """The arc by pattern seed, its two peaks, what they cost, and the mean over many seeds."""
    figure, grid = panels(2, 2, width=WIDE, height=5.4)
    data = results["PEAKS"]
    _draw_seeds(grid[0, 0], results["F3"])
    _draw_peaks(grid[0, 1], data)
    _draw_cost(grid[1, 0], data)
    _draw_average(grid[1, 1], data)
    return figure


def _draw_seeds(axes: Axes, maps: xr.Dataset) -> None:
    scores = score(maps).sel(classes=1)
    scores = scores.sel(eta=scores["eta"] <= LARGEST_ETA + 1e-9)
    memory = ((1 - scores["eta"]) * scores["alpha"]).transpose("eta", "alpha").to_numpy().ravel()
    for place, seed in enumerate(scores["pattern_seed"].to_numpy()):
        cells = scores.sel(pattern_seed=seed).transpose("eta", "alpha").to_numpy().ravel()
        axes.plot(
            memory, cells, METHOD_MARKS[place % 5], color=METHOD_COLOURS[place % 5], ms=2.2,
            mew=0, alpha=0.7, label=str(seed),
        )  # fmt: skip
    axes.set(xlabel="(1−η)α (per bin)", ylabel=BINS, xlim=(0, 1), ylim=(0, None))
    axes.legend(title="pattern seed", title_fontsize=6, fontsize=6, markerscale=2, ncols=2)
    letter(axes, "a   the map, seed by seed")


def _draw_peaks(axes: Axes, data: xr.Dataset) -> None:
    alphas = data["alpha"].to_numpy()
    (place,) = deepest(_scores(data.sel(pattern_seed=[ARC_SEED])))
    traces = np.array([potential(data, ARC_SEED, float(alpha)) for alpha in alphas])
    highest = (int(traces[place + step].argmax()) for step in (-AROUND, AROUND))
    for bin_, colour, look in zip(highest, (BLUE, INK), ("o-", "s--"), strict=True):
        label = f"peak in bin {bin_ - GAP}"
        axes.plot(alphas, traces[:, bin_], look, color=colour, ms=2.5, lw=1.2, label=label)
    axes.axvline(alphas[place], color=RED, lw=1.0, ls=":")
    axes.set(xlabel=_ALPHA_LABEL, ylabel="membrane potential V", ylim=(None, 1.05))
    axes.axhline(1.0, color=GREY, lw=0.8, ls="--")
    axes.legend(loc="lower right", fontsize=6)
    letter(axes, f"b   pattern seed {ARC_SEED}")


def _draw_cost(axes: Axes, data: xr.Dataset) -> None:
    axes.plot(second_peaks(data).ravel(), _scores(data).ravel(), "o", ms=2.2, color=BLUE, mew=0,
              alpha=0.6)  # fmt: skip
    axes.axvline(TIED, color=GREY, lw=0.8, ls="--")
    axes.set(xlabel="second peak of V / highest", ylabel=BINS, xlim=(None, 1.01), ylim=(0, None))
    letter(axes, f"c   {data.sizes['pattern_seed']} seeds, every α")


def _draw_average(axes: Axes, data: xr.Dataset) -> None:
    band(axes, data["alpha"].to_numpy(), means(_scores(data)), "o-", color=RED, ms=2.5, lw=1.6)
    axes.set(xlabel=_ALPHA_LABEL, ylabel=BINS, ylim=(0, 10_000))
    letter(axes, f"d   mean of {data.sizes['pattern_seed']} seeds, η = 0")


def _note(results: Results) -> str:
    scores, second = _scores(results["PEAKS"]), second_peaks(results["PEAKS"])
    falls = bootstrap(lambda a, b: spearmanr(a.ravel(), b.ravel()).statistic, second, scores)
    tied = second >= TIED
    deep = dips(scores).max(1) > 0.5 * scores.max(1)
    level = tied[np.arange(len(scores)), deepest(scores)]
    words = (
        f" In {deep.sum()} of {len(scores)} seeds a dip costs more than half of the best score, in "
        f"{(deep & level).sum()} of them where two peaks are level; height of the second peak and "
        f"score have a rank correlation of {falls:.2f}."
    )
    if tied.any():
        words += (
            f" The {tied.sum()} of {tied.size} neurons whose second peak has at least {TIED:.0%} "
            f"of the highest score {scores[tied].mean():,.0f} bins, the others "
            f"{scores[~tied].mean():,.0f}."
        )
    return words


EXPERIMENTS = {"PEAKS": column}
PICTURES = {
    "F3-arc": Picture(
        _draw,
        ("F3", "PEAKS"),
        "The dark arc in the map for one class. (a) Every cell of the map with η up to "
        f"{LARGEST_ETA:g} by its leak below threshold, (1−η)α, one mark per pattern seed: the arc "
        f"is pattern seed {ARC_SEED}. (b) Its two peaks of the membrane potential over the pattern "
        "alone: they change places as the highest, and where they are level (dotted) both cross "
        "the threshold (dashed) though one spike is owed. (c) Scores by the height of the second "
        "peak, many pattern seeds at η = 0. (d) Their mean with 95 % intervals over pattern seeds.",
        _note,
    )
}
