"""Figures of the neuron in continuous time and of its chemistry, drawn from results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.chemistry.mistakes import Mistakes
from agents.chemistry.reactor import Course
from agents.continuous.outputs import in_occurrences
from agents.continuous.simulate import Trajectory
from agents.evaluation import bootstrap_interval
from gnm_env.trial import Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito: told apart by colour-blind readers, and in grey print by their lightness.
BLUE, SKY, ORANGE, GREEN, GREY = "#0072B2", "#56B4E9", "#E69F00", "#009E73", "#8C8C8C"
CLASS_COLOURS = (ORANGE, GREEN, SKY, "#CC79A7")
VOLUME_COLOURS = (SKY, ORANGE, GREEN, "#CC79A7", BLUE)


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write `figure` as PDF and PNG beside each other; returns both paths.

    Raises ValueError if the folder cannot be written.
    """
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in ("pdf", "png")]
    try:
        stem.parent.mkdir(parents=True, exist_ok=True)
        for path in paths:
            figure.savefig(path, dpi=200)
    except OSError as error:
        raise ValueError(
            f"cannot write {stem.parent}: {error.strerror}; choose a folder that is writable"
        ) from None
    return paths


def draw_classes(courses: Sequence[Trajectory], targets: Sequence[int], theta_r: float) -> Figure:
    """F2: V(t) of a trained neuron under each pattern alone, S shaded and its value printed."""
    figure, axes = _panels(len(courses), height=2.1)
    top = 1.12 * max(float(course.V.max()) for course in courses)
    for c, (axis, course) in enumerate(zip(axes, courses, strict=True)):
        axis.fill_between(
            course.t,
            course.V,
            where=list(theta_r < course.V),
            color=BLUE,
            alpha=0.35,
            linewidth=0,
            label=r"$S=\int\Theta(V-\vartheta_R)\,V\,dt$",
        )
        axis.plot(course.t, course.V, color="black", linewidth=0.9, label="$V(t)$")
        _threshold(axis, theta_r)
        axis.set_ylim(0.0, top)
        axis.set_xlim(0.0, float(course.t[-1]))
        axis.set_title(
            f"Pattern of class {c + 1}: $S$ = {course.S[-1]:.2f}, owed {targets[c]}",
            loc="left",
            fontsize=9,
        )
    axes[0].legend(loc="upper right", fontsize=7, frameon=False, ncols=3)
    axes[-1].set_xlabel("time (bins)")
    figure.supylabel("membrane potential $V$", fontsize=9)
    return figure


def draw_volumes(trial: Trial, deterministic: Course, stochastic: Mapping[int, Course]) -> Figure:
    """F8: stochastic traces over the deterministic one (black), all with the same input."""
    figure, axes = _panels(1 + len(stochastic), height=1.5)
    top = 1.1 * max(float(c.V.max()) for c in (deterministic, *stochastic.values()))
    rows = [
        ("infinitely many molecules (deterministic; black in every panel)", deterministic, "black")
    ]
    rows += [
        (f"{molecules} molecules per input spike", course, VOLUME_COLOURS[k % len(VOLUME_COLOURS)])
        for k, (molecules, course) in enumerate(stochastic.items())
    ]
    for axis, (name, course, colour) in zip(axes, rows, strict=True):
        V, S = np.atleast_2d(course.V)[0], np.atleast_2d(course.S())[0]
        _occurrences(axis, trial)
        if colour != "black":
            axis.plot(course.t, V, color=colour, linewidth=0.8)
        axis.plot(deterministic.t, deterministic.V, color="black", linewidth=0.8)
        _threshold(axis, course.theta_r)
        axis.set_ylim(0.0, top)
        axis.set_xlim(0.0, trial.n_bins)
        axis.set_title(name, loc="left", fontsize=8, pad=3)
        _print_outputs(axis, trial, S[:: (len(S) - 1) // trial.n_bins])
    axes[-1].set_xlabel("time (bins)")
    figure.supylabel("$V$ (molecules per input spike)", fontsize=9)
    return figure


def draw_mistakes(mistakes: Mistakes) -> Figure:
    """Wrong outputs per trial against molecules per input spike, with 95 % intervals."""
    from matplotlib import pyplot as plt

    figure, axis = plt.subplots(figsize=(5.0, 3.4), layout="constrained")
    mean = mistakes.stochastic.mean(axis=1)
    interval = np.array([bootstrap_interval(row) for row in mistakes.stochastic])
    axis.errorbar(
        mistakes.molecules,
        mean,
        yerr=np.abs(interval.T - mean),
        color=BLUE,
        marker="o",
        markersize=4,
        linewidth=1.0,
        capsize=2.5,
        label="molecule by molecule",
    )
    for values, style, name in (
        (mistakes.deterministic, "--", "infinitely many molecules"),
        (mistakes.neuron, ":", "the neuron itself ($C\\to\\infty$)"),
    ):
        axis.axhline(values.mean(), color="black", linestyle=style, linewidth=1.0, label=name)
    axis.set_xscale("log")
    axis.set_xticks(mistakes.molecules, [str(m) for m in mistakes.molecules])
    axis.minorticks_off()
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel("molecules per input spike")
    axis.set_ylabel("wrong outputs per trial")
    axis.legend(frameon=False, fontsize=8)
    axis.spines[["top", "right"]].set_visible(False)
    return figure


def _panels(rows: int, height: float) -> tuple[Figure, NDArray[Any]]:
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        rows,
        1,
        figsize=(6.5, height * rows + 0.5),
        sharex=True,
        squeeze=False,
        layout="constrained",
    )
    for axis in axes[:, 0]:
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes[:, 0]


def _threshold(axis: Axes, theta_r: float) -> None:
    axis.axhline(
        theta_r, color=GREY, linestyle="--", linewidth=0.8, label=r"threshold $\vartheta_R$"
    )


def _occurrences(axis: Axes, trial: Trial) -> None:
    for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
        colour = CLASS_COLOURS[class_ % len(CLASS_COLOURS)]
        axis.axvspan(onset, onset + trial.pattern_bins, color=colour, alpha=0.15, linewidth=0)


def _print_outputs(axis: Axes, trial: Trial, S: NDArray[np.float64]) -> None:
    """The S of each occurrence at the top of its shade."""
    for k, amount in enumerate(in_occurrences(trial, S)):
        axis.text(
            trial.onsets[k] + trial.pattern_bins / 2,
            0.97 * axis.get_ylim()[1],
            f"class {trial.classes[k] + 1}: $S$ = {amount:.2f}",
            ha="center",
            va="top",
            fontsize=7,
        )
