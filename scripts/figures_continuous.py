"""Figures of the neuron in continuous time and of its chemistry, drawn from results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from agents.chemistry.mistakes import Mistakes
from agents.chemistry.reactor import Course
from agents.continuous.outputs import in_occurrences
from agents.continuous.simulate import Trajectory
from agents.evaluation import bootstrap_interval
from drawing.style import BLUE, GREY, INK, NARROW, WIDE, panels, plt, styled
from gnm_env.trial import Trial
from pictures import class_colour

TRACE_COLOURS = ("#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#E69F00")
"""Okabe and Ito's; each trace has a panel of its own besides."""


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write `figure` as PDF and PNG beside each other, close it, and return both paths.

    Raises ValueError if the folder cannot be written.
    """
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in ("pdf", "png")]
    try:
        stem.parent.mkdir(parents=True, exist_ok=True)
        for path in paths:
            # No date in the file: the same results give the same bytes.
            metadata = {"CreationDate": None} if path.suffix == ".pdf" else None
            with styled():
                figure.savefig(path, metadata=metadata)
    except OSError as error:
        raise ValueError(
            f"cannot write {stem.parent}: {error.strerror}; choose a folder that is writable"
        ) from None
    plt.close(figure)
    return paths


def draw_classes(courses: Sequence[Trajectory], targets: Sequence[int], theta_r: float) -> Figure:
    """F2: V(t) of a trained neuron under each pattern alone, S shaded and its value printed."""
    with styled():
        figure, grid = panels(len(courses), 1, width=WIDE, height=1.9 * len(courses), sharex=True)
        axes: list[Axes] = list(grid[:, 0])
        top = 1.2 * max(theta_r, *(float(course.V.max()) for course in courses))
        for c, (axis, course) in enumerate(zip(axes, courses, strict=True)):
            axis.fill_between(
                course.t,
                course.V,
                where=list(theta_r < course.V),
                color=BLUE,
                alpha=0.45,
                linewidth=0,
                label=r"$S=\int\Theta(V-\vartheta_R)\,V\,dt$",
            )
            axis.plot(course.t, course.V, color=INK, linewidth=0.9, label="$V(t)$")
            _threshold(axis, theta_r)
            axis.set(xlim=(0.0, float(course.t[-1])), ylim=(0.0, top))
            axis.set_title(
                f"pattern of class {c + 1}: $S$ = {course.S[-1]:.2f}, owed {targets[c]}", loc="left"
            )
        # Above the first panel's frame, where no trace can be.
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderpad=0.1)
        axes[-1].set_xlabel("time (bins)")
        figure.supylabel("membrane potential $V$", fontsize=8)
    return figure


def draw_volumes(trial: Trial, deterministic: Course, stochastic: Mapping[int, Course]) -> Figure:
    """F8: stochastic traces over the deterministic one (black), all with the same input."""
    rows = [("infinitely many molecules (black in every panel)", deterministic, INK)]
    rows += [
        (f"{number:,} molecules per input spike", course, TRACE_COLOURS[k % len(TRACE_COLOURS)])
        for k, (number, course) in enumerate(stochastic.items())
    ]
    top = 1.15 * max(deterministic.theta_r, *(float(course.V.max()) for _, course, _ in rows))
    with styled():
        figure, grid = panels(len(rows), 1, width=WIDE, height=1.45 * len(rows), sharex=True)
        for axis, (name, course, colour) in zip(grid[:, 0], rows, strict=True):
            axis.set(xlim=(0.0, trial.n_bins), ylim=(0.0, top))
            _occurrences(axis, trial, np.atleast_2d(course.S())[0])
            if course is not deterministic:
                axis.plot(course.t, np.atleast_2d(course.V)[0], color=colour, linewidth=0.9)
            axis.plot(deterministic.t, deterministic.V, color=INK, linewidth=0.7)
            _threshold(axis, course.theta_r)
            axis.set_title(name, loc="left")
        grid[-1, 0].set_xlabel("time (bins)")
        figure.supylabel("$V$ (molecules per input spike)", fontsize=8)
    return figure


def draw_mistakes(mistakes: Mistakes) -> Figure:
    """Wrong outputs per trial against molecules per input spike, with 95 % intervals."""
    mean = mistakes.stochastic.mean(axis=1)
    interval = np.array([bootstrap_interval(row) for row in mistakes.stochastic])
    with styled():
        figure, grid = panels(1, 1, width=1.3 * NARROW, height=0.85 * NARROW)
        axis: Axes = grid[0, 0]
        axis.errorbar(
            mistakes.molecules,
            mean,
            yerr=np.abs(interval.T - mean),
            color=BLUE,
            marker="o",
            markersize=4,
            linewidth=1.0,
            capsize=2.5,
            label="molecule by molecule (mean, 95 % interval)",
        )
        # They may coincide, so that one has to be seen under the other.
        neuron, smooth = mistakes.neuron.mean(), mistakes.deterministic.mean()
        name = "the neuron itself ($C\\to\\infty$ too)"
        axis.axhline(neuron, color=GREY, alpha=0.6, linewidth=3.0, label=name)
        name = "infinitely many molecules"
        axis.axhline(smooth, color=INK, linestyle="--", linewidth=1.0, label=name)
        axis.set_xscale("log")
        axis.set_xticks(mistakes.molecules, [f"{number:,}" for number in mistakes.molecules])
        axis.minorticks_off()
        # A little below 0, so that lines at 0 do not hide in the frame.
        axis.set_ylim(bottom=-0.03 * max(float(interval.max()), 1.0))
        axis.set(xlabel="molecules per input spike", ylabel="wrong outputs per trial")
        axis.legend()
    return figure


def _threshold(axis: Axes, theta_r: float) -> None:
    label = r"threshold $\vartheta_R$"
    axis.axhline(theta_r, color=GREY, linestyle="--", linewidth=0.8, label=label)


def _occurrences(axis: Axes, trial: Trial, S: NDArray[np.float64]) -> None:
    """Shade each occurrence and print the S given in it."""
    given = in_occurrences(trial, S[:: (len(S) - 1) // trial.n_bins])
    places: Any = zip(trial.onsets, trial.classes, given, strict=True)
    for onset, class_, amount in places:
        stop = onset + trial.pattern_bins
        axis.axvspan(onset, stop, color=class_colour(class_), alpha=0.15, linewidth=0)
        text = f"class {class_ + 1}: $S$ = {amount:.2f}"
        top = axis.get_ylim()[1]
        axis.text((onset + stop) / 2, 0.97 * top, text, ha="center", va="top", fontsize=7)
