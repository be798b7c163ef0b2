"""One look for all figures: it survives grey printing, colour blindness and a small screen."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

MAP = "cividis"
RED, BLUE, GREY, INK = "#c1121f", "#3a6ea5", "#8a8a8a", "#222222"
METHOD_COLOURS = ("#8a8a8a", "#222222", "#3a6ea5", "#1b998b", "#c1121f")
"""For up to five methods side by side; their marks differ as well."""
METHOD_MARKS = ("s", "o", "^", "D", "v")
BINS = "noisy performance (bins)"
WIDE, NARROW = 7.1, 3.5
"""Widths of a page and of a column, in inches."""

_RC: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "figure.dpi": 150,
    "savefig.dpi": 200,
    "figure.constrained_layout.use": True,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "gnm",
    "axes.axisbelow": True,
}


def styled() -> AbstractContextManager[None]:
    """Use the look within a `with` block."""
    style: AbstractContextManager[None] = matplotlib.rc_context(_RC)
    return style


def panels(
    rows: int, columns: int, *, width: float, height: float, **how: Any
) -> tuple[Figure, Any]:
    """A figure of rows × columns axes, always as an array of that shape."""
    return plt.subplots(rows, columns, figsize=(width, height), squeeze=False, **how)


def letter(axes: Axes, text: str) -> None:
    """Name a panel."""
    axes.set_title(text, loc="left", fontweight="bold")


def silent_line(axes: Axes, score: float, *, label: bool = True) -> None:
    """The score of a neuron that never spikes: below it is worse than silence."""
    axes.axhline(score, color=GREY, lw=0.8, ls=":", zorder=1)
    if label:
        axes.annotate(
            f"silent\n{score:.0f}", (1.005, score), xycoords=("axes fraction", "data"),
            ha="left", va="center", fontsize=6, color=GREY, annotation_clip=False,
        )  # fmt: skip
