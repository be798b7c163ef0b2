"""RULES: what one neuron of 100 weights learns by each rule, told no more than the rule may know.

The settings were chosen on pattern seeds 0 to 15 and are reported on seeds 100 to 147, which no
setting was chosen on. "Paper" is ALL with the settings of Fil & Chu; "plain" has a constant
learning rate and unbounded weights; "tuned" has a rate that falls to 0 and weights in ±0.4 or ±0.3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import by_seed, interquartile_mean, score
from agents.experiments.training import class_counts, learners, pattern_seeds, training
from agents.experiments.verdict import Results
from agents.plotting import WIDE, panels
from gnm_env import Task

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

FALLING = {"decay_trials": 60_000}
FREE: dict[str, Any] = {"weight_bounds": None}
GNM = {"neuron": "gnm", "alpha": 0.15}
FAST_MST = {"neuron": "mst", "tau_m": 10.0, "tau_s": 2.5, "weight_bounds": (-0.3, 0.3)}
TUNED = {**FALLING, "weight_bounds": (-0.4, 0.4)}
SIGN = {"rule": "critical"}
AMOUNT = {**SIGN, "amount": True}
PEAK = {"rule": "peak-error"}

LEARNERS: dict[str, dict[str, Any]] = {
    "A: GNM, ALL, paper": {"neuron": "gnm", "rule": "all"},
    "A: GNM, CriticalThreshold, plain": {**GNM, **SIGN, **FREE, "learning_rate": 1e-2},
    "A: MST, CriticalThreshold, plain": {"neuron": "mst", **SIGN, **FREE, "learning_rate": 1e-2},
    "A: LIF, CriticalThreshold, falling": {
        "neuron": "lif", "alpha": 0.1, **SIGN, **FREE, **FALLING, "learning_rate": 0.03,
    },
    "A: GNM, CriticalThreshold, tuned": {**GNM, **SIGN, **TUNED, "learning_rate": 0.06},
    "A: MST, CriticalThreshold, tuned": {**FAST_MST, **SIGN, **FALLING, "learning_rate": 0.06},
    "A′: GNM, CriticalThreshold amount, plain": {**GNM, **AMOUNT, **FREE, "learning_rate": 1e-2},
    "A′: GNM, CriticalThreshold amount, tuned": {**GNM, **AMOUNT, **TUNED, "learning_rate": 0.06},
    "B: GNM, ET modulated": {
        "neuron": "gnm", "rule": "et", "modulate": True, "learning_rate": 1e-3,
    },
    "B: GNM, SurrogateGradient": {
        "neuron": "gnm", "rule": "surrogate", **FREE, "learning_rate": 1e-2,
    },
    "B: GNM, PeakError, plain": {**GNM, **PEAK, **FREE, "learning_rate": 3e-3},
    "B: GNM, PeakError, tuned": {**GNM, **PEAK, **TUNED, "learning_rate": 0.03},
    "B: MST, PeakError, tuned": {**FAST_MST, **PEAK, **FALLING, "learning_rate": 0.01},
}  # fmt: skip
"""By feedback: A the sign of the error, A′ its size, B where the presentations were."""

SIZES = {"quick": (range(100, 104), (2,)), "paper": (range(100, 148), (2, 3, 4))}


def rules(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Every rule with its settings, on the same streams, by pattern seed."""
    usual, classes = SIZES[size]
    axes = (class_counts(*classes), pattern_seeds(seeds or usual), learners(LEARNERS))
    return training("RULES", "Learning rules, one neuron of 100 weights", axes)


def table(results: xr.Dataset) -> str:
    """Mean, 95 % interval, median and interquartile mean, and wins over ALL, as Markdown."""
    from agents import bootstrap_interval

    lines = ["| learner | classes | mean (95 % interval) | median | IQM | ahead of ALL |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    scores = score(results)
    for name in LEARNERS:
        for classes in scores["classes"].values:
            row = by_seed(scores.sel(classes=classes, learner=name))
            other = by_seed(scores.sel(classes=classes, learner="A: GNM, ALL, paper"))
            low, high = bootstrap_interval(row)
            ahead = "" if name.endswith("paper") else f"{np.sum(row > other)} of {len(row)}"
            lines.append(
                f"| {name} | {classes} | {row.mean():,.0f} ({low:,.0f} … {high:,.0f}) | "
                f"{np.median(row):,.0f} | {interquartile_mean(row):,.0f} | {ahead} |"
            )
    return "\n".join(lines)


def draw(results: Results) -> Figure:
    """Each pattern seed a point, by feedback and rule; a column for each number of classes."""
    from agents import bootstrap_interval

    scores = score(results["RULES"])
    counts = scores["classes"].values
    figure, axes = panels(1, len(counts), width=WIDE, height=0.28 * len(LEARNERS) + 0.9)
    colours = {"A": "C0", "A′": "C2", "B": "C1"}
    rng = np.random.default_rng(0)
    for axis, classes in zip(axes[0], counts, strict=True):
        for place, name in enumerate(LEARNERS):
            row = by_seed(scores.sel(classes=classes, learner=name))
            colour = colours[name.partition(":")[0]]
            jitter = place + rng.uniform(-0.18, 0.18, len(row))
            axis.plot(row, jitter, ".", color=colour, markersize=2.5, alpha=0.45)
            low, high = bootstrap_interval(row)
            axis.plot([low, high], [place, place], color="0.1", linewidth=1.2)
            axis.plot(row.mean(), place, "o", color="0.1", markersize=3.5)
        axis.set(
            xlim=(0, 10_200), ylim=(len(LEARNERS) - 0.5, -0.5), title=f"{classes} classes",
            xlabel="bins survived", yticks=range(len(LEARNERS)), yticklabels=[],
        )  # fmt: skip
        axis.axvline(Task().silent_score, color="0.5", linestyle=":", linewidth=0.8)
    axes[0, 0].set_yticklabels(LEARNERS, fontsize=7)
    return figure


EXPERIMENTS = {"RULES": rules}

PICTURES = {
    "RULES": Picture(
        draw,
        ("RULES",),
        "One neuron of 100 weights by learning rule: noisy performance, one point per pattern "
        "seed (100 to 147), and mean with its 95 % bootstrap interval. Blue, told the sign of the "
        "error once a trial; green, its size; orange, where the presentations were. Dotted, a "
        "neuron that never spikes.",
    )
}
