"""Pictures of one agent: what it hears and answers, how it learned, how it tells classes apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agents import History, record
from drawing.style import styled
from gnm_env import Patterns, Task, Trial, draw_trial

CLASS_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito's colours, told apart by the colour-blind."""
GAP = 20
"""Bins of silence around a pattern that is shown alone."""


def save(figure: Figure, path: Path) -> Path:
    """Write the figure, close it, and return its path."""
    figure.savefig(path)
    plt.close(figure)
    return path


def class_colour(class_: int) -> str:
    return CLASS_COLOURS[class_ % len(CLASS_COLOURS)]


def threshold_of(agent: Any) -> float:
    """The readout threshold of a neuron or of a network's readout neuron."""
    if hasattr(agent, "neuron"):
        return float(agent.neuron.threshold)
    return float(agent.network.theta_r)


def shown_trial(task: Task, patterns: Patterns, seed: int = 7) -> Trial:
    """A trial with every class in it, of ordinary length, for a picture."""
    rng = np.random.default_rng(seed)
    trial = draw_trial(task, patterns, rng)
    wanted = min(task.n_classes, 4)
    for _ in range(200):
        if wanted <= len(trial.onsets) <= wanted + 2 and len(set(trial.classes)) >= wanted:
            break
        trial = draw_trial(task, patterns, rng)
    return trial


def training_picture(agent: Any, task: Task, patterns: Patterns, history: History) -> Figure:
    """Input raster, membrane potential with output spikes, and the learning curve."""
    trial = shown_trial(task, patterns)
    with styled():
        figure, (raster, potential, curve) = plt.subplots(
            3, 1, figsize=(8, 7), height_ratios=(1.3, 1, 1)
        )
        potential.sharex(raster)
        draw_raster(raster, trial)
        draw_potential(potential, trial, agent)
        raster.tick_params(labelbottom=False)
        potential.set_xlabel("time (bins)")
        draw_learning_curve(curve, history)
        for axes, letter in zip((raster, potential, curve), "abc", strict=True):
            axes.set_title(letter, loc="left", fontweight="bold")
    return figure


def draw_raster(axes: Axes, trial: Trial) -> None:
    """Input spikes, each occurrence shaded and labelled with what it owes."""
    bins, channels = np.nonzero(trial.dense())
    axes.plot(bins + 0.5, channels, "|", color="0.15", markersize=3, markeredgewidth=0.8)
    axes.set(xlim=(0, trial.n_bins), ylim=(-1, trial.n_inputs), ylabel="input channel")
    for onset, class_, owed in zip(trial.onsets, trial.classes, trial.targets, strict=True):
        axes.annotate(
            f"class {class_}, owes {owed}",
            (onset + trial.pattern_bins / 2, 1.01),
            xycoords=("data", "axes fraction"),
            ha="center", va="bottom", fontsize=8, color=class_colour(class_),
        )  # fmt: skip
    shade(axes, trial)


def shade(axes: Axes, trial: Trial) -> None:
    """Colour the bins of each occurrence by its class."""
    for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
        axes.axvspan(
            onset, onset + trial.pattern_bins, color=class_colour(class_), alpha=0.15, lw=0
        )


def output_of(agent: Any, trial: Trial) -> float:
    """The agent's output in a whole trial: spikes, or the amount of S."""
    agent.begin_trial()
    return float(sum(agent.act(row) for row in trial.dense().view(np.int8)))


def draw_potential(axes: Axes, trial: Trial, agent: Any) -> None:
    """The readout with its threshold and the output: spikes above it, or S shaded below it."""
    recording, threshold = record(agent, trial), threshold_of(agent)
    graded = getattr(agent, "graded", False)
    shade(axes, trial)
    t = np.arange(trial.n_bins) + 0.5
    axes.plot(t, recording.X, color="black", lw=0.9)
    axes.axhline(threshold, color="0.4", lw=0.8, ls="--")
    axes.annotate(
        "threshold", (1.0, threshold), xycoords=("axes fraction", "data"),
        ha="left", va="center", fontsize=8, color="0.4",
    )  # fmt: skip
    top = max(float(recording.X.max()), threshold) * 1.12
    if graded:
        over = recording.X >= threshold
        axes.bar(t[over], recording.X[over], width=1.0, color="#D55E00", alpha=0.6, lw=0)
    else:
        spikes = t[recording.spikes]
        axes.plot(spikes, np.full(len(spikes), top), "v", color="#D55E00", markersize=5)
    axes.set(
        ylabel="V, bins with output S shaded" if graded else "readout, spikes (▾)",
        ylim=(min(0.0, float(recording.X.min())), top * 1.08),
    )


def draw_learning_curve(axes: Axes, history: History) -> None:
    """Fraction of trials answered wrongly, and the mean error."""
    axes.plot(history.trials, history.error_rate, color="black", label="trials answered wrongly")
    axes.plot(
        history.trials, history.mean_error, color="#0072B2", ls="--",
        label="mean |label − emitted| (spikes)",
    )  # fmt: skip
    axes.set(xlabel="trials", ylabel="error", ylim=(0, None), xlim=(0, None))
    axes.xaxis.set_major_formatter(mpl.ticker.StrMethodFormatter("{x:,.0f}"))
    axes.legend(frameon=False)


def response_picture(agent: Any, task: Task, patterns: Patterns) -> Figure:
    """V(t) over each pattern alone, after silence, with the output spikes: how it counts."""
    with styled():
        figure, rows = plt.subplots(
            task.n_classes, 1, figsize=(6, 1.4 + 1.5 * task.n_classes),
            sharex=True, sharey=True, squeeze=False,
        )  # fmt: skip
        for class_, axes in enumerate(rows[:, 0]):
            trial = lone_pattern(task, patterns, class_)
            draw_potential(axes, trial, agent)
            given, owed = output_of(agent, trial), task.owed[class_]
            axes.set_title(
                f"class {class_}: owes {owed}, given {given:.3g}",
                loc="left", color=class_colour(class_), fontsize=9,
            )  # fmt: skip
        rows[-1, 0].set_xlabel("time (bins)")
    return figure


def lone_pattern(task: Task, patterns: Patterns, class_: int) -> Trial:
    """A pattern between two stretches of silence."""
    silence = np.zeros((GAP, task.n_inputs), bool)
    raster = np.concatenate([silence, patterns.dense()[class_], silence])
    return Trial.from_dense(raster, [GAP], [class_], task)
