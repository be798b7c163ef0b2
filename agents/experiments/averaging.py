"""AVERAGING: what the mean of the weights over the last part of training is worth.

Two rules with large steps, each at a constant learning rate, at one that falls to 0, and with the
weights averaged over the last third of the training. `gnm sweep agents.experiments.averaging:
averaging --size paper` computes it, `table` prints it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from agents.evaluation import bootstrap_interval
from agents.experiments.design import Experiment
from agents.experiments.statistics import by_seed, score
from agents.experiments.training import RUN, class_counts, learners, pattern_seeds, training

if TYPE_CHECKING:
    import xarray as xr

SIZES = {"quick": (range(100, 104), (2,)), "paper": (range(100, 148), (2, 3, 4))}

_GNM = {"neuron": "gnm", "alpha": 0.15, "weight_bounds": (-0.4, 0.4)}
RULES: dict[str, dict[str, Any]] = {
    "CriticalThreshold": {**_GNM, "rule": "critical", "learning_rate": 0.06},
    "PeakError": {**_GNM, "rule": "peak-error", "learning_rate": 0.03},
}
"""The settings of `rules.py` that were tuned by hand, on pattern seeds 0 to 15."""

_TRIALS = RUN["trials"]
ENDINGS: dict[str, dict[str, Any]] = {
    "constant": {},
    "averaged": {"average_over": (_TRIALS - _TRIALS // 3 + 1, _TRIALS)},
    "falling": {"decay_trials": _TRIALS},
    "falling, averaged": {
        "decay_trials": _TRIALS, "average_over": (_TRIALS - _TRIALS // 3 + 1, _TRIALS)
    },
}  # fmt: skip
"""How training ends."""


def averaging(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Each rule with each ending, on the same streams, by pattern seed."""
    usual, classes = SIZES[size]
    rows = {f"{r}, {e}": RULES[r] | ENDINGS[e] for r in RULES for e in ENDINGS}
    axes = (class_counts(*classes), pattern_seeds(seeds or usual), learners(rows))
    return training("AVERAGING", "Averages of the weights over the last third of training", axes)


def table(results: xr.Dataset) -> str:
    """Mean with its 95 % interval, and the difference to a constant rate, as Markdown."""
    lines = ["| rule | end of training | classes | mean (95 % interval) | less that at a constant "
             "rate | ahead of it |", "|---|---|---|---|---|---|"]  # fmt: skip
    scores = score(results)
    for rule in RULES:
        for classes in scores["classes"].values:
            here = {e: by_seed(scores.sel(classes=classes, learner=f"{rule}, {e}"))
                    for e in ENDINGS}  # fmt: skip
            for ending, row in here.items():
                difference = row - here["constant"]
                cells = ["", ""]
                if ending != "constant":
                    low, high = bootstrap_interval(difference)
                    cells = [f"{difference.mean():+,.0f} ({low:+,.0f} … {high:+,.0f})",
                             f"{np.sum(difference > 0)} of {len(row)}"]  # fmt: skip
                low, high = bootstrap_interval(row)
                lines.append(f"| {rule} | {ending} | {classes} | {row.mean():,.0f} ({low:,.0f} … "
                             f"{high:,.0f}) | {' | '.join(cells)} |")  # fmt: skip
    return "\n".join(lines)
