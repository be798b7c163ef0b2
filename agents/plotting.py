"""Pictures: the look that all of them share, and those of one agent.

Importing this module is cheap: matplotlib is imported when something is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.history import History
from agents.recording import record
from agents.training.source import source_of
from gnm_env import Patterns, Task, Trial, Trials, colours
from gnm_env.checks import shown
from gnm_env.colours import MISTAKE, as_hex

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OUTPUT = as_hex(MISTAKE)
"""Output spikes, and what is given of S: the colour that no class has."""
OKABE_ITO = {
    "blue": "#0072B2", "vermillion": "#D55E00", "green": "#009E73", "purple": "#CC79A7",
    "orange": "#E69F00", "sky": "#56B4E9", "black": "#000000", "grey": "#999999",
}  # fmt: skip
"""For what is no class, such as learners: told apart by the colour-blind."""
RED, BLUE, GREY, INK = "#c1121f", "#3a6ea5", "#8a8a8a", "#222222"
METHOD_COLOURS = (GREY, INK, BLUE, "#1b998b", RED)
"""For up to five methods side by side; their marks differ as well."""
METHOD_MARKS = ("s", "o", "^", "D", "v")
MAP = "cividis"
BINS = "noisy performance (bins)"
WIDE, NARROW = 7.1, 3.5
"""Widths of a page and of a column, in inches."""
GAP = 20
"""Bins of silence around a pattern that is shown alone."""

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

# --- the look ------------------------------------------------------------------------------------


@contextmanager
def styled() -> Iterator[None]:
    """One look for all figures, within a `with` block: it survives grey printing, colour blindness
    and a small screen. ImportError says what to install where matplotlib is missing."""
    try:
        import matplotlib
    except ImportError as error:
        raise ImportError(
            f'pictures need {error.name}, which is not installed: pip install "gnm-env[pictures]"',
            name=error.name,
        ) from None
    with matplotlib.rc_context(_RC):
        yield


def panels(
    rows: int, columns: int, *, width: float, height: float, **how: Any
) -> tuple[Figure, Any]:
    """A figure of rows × columns axes, always as an array of that shape. Sizes in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def letter(axes: Axes, text: str) -> None:
    """Name a panel."""
    axes.set_title(text, loc="left", fontweight="bold")


def silent_line(axes: Axes, score: float) -> None:
    """The score of a neuron that never spikes: below it is worse than silence."""
    axes.axhline(score, color=GREY, lw=0.8, ls=":", zorder=1)
    axes.annotate(
        f"silent\n{score:.0f}", (1.005, score), xycoords=("axes fraction", "data"),
        ha="left", va="center", fontsize=6, color=GREY, annotation_clip=False,
    )  # fmt: skip


def error_bars(axes: Axes, x: ArrayLike, found: ArrayLike, **look: Any) -> None:
    """Values with their intervals as bars; `found` has value, low and high of one or of many."""
    values, low, high = np.atleast_2d(found).T
    # An interval of a quantile may leave the value outside by less than a rounding.
    axes.errorbar(x, values, np.maximum([values - low, high - values], 0.0), **look)


def band(
    axes: Axes, x: ArrayLike, found: NDArray[Any], *look: str, dense: float = 0.2, **how: Any
) -> None:
    """A line of values within the band of their intervals; `found` is (values, 3)."""
    axes.fill_between(x, found[:, 1], found[:, 2], color=how["color"], alpha=dense, lw=0)
    axes.plot(x, found[:, 0], *look, **how)


def legend_above(figure: Figure, axes: Axes, columns: int) -> None:
    """What the lines of one panel are, above all panels."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=columns)


def class_colour(class_: int) -> str:
    """The colour of a class, counted from 0."""
    return as_hex(colours.class_colour(class_))


def shade(axes: Axes, trial: Trial) -> None:
    """Colour the bins of each presentation by its class."""
    for onset, end, class_ in zip(trial.onsets, trial.ends, trial.classes, strict=True):
        axes.axvspan(onset, end, color=class_colour(class_), alpha=0.15, lw=0)


def save(figure: Figure, folder: Path, name: str, kinds: tuple[str, ...]) -> dict[str, Path]:
    """Write the figure in each of the formats ("png", "pdf", "svg"); returns the paths by format.

    The same data give the same bytes: there are no dates in the files. Raises ValueError if the
    folder cannot be written.
    """
    paths = {kind: folder / f"{name}.{kind}" for kind in kinds}
    undated: dict[str, Any] = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with styled():
            for kind, path in paths.items():
                figure.savefig(path, metadata=undated[kind])
    except OSError as error:
        raise ValueError(
            f"cannot write {folder}: {error.strerror}; choose a folder that is writable"
        ) from None
    return paths


# --- pictures of one agent -----------------------------------------------------------------------


def plot(
    agent: Any,
    task: Task | Trials,
    patterns: Patterns | None = None,
    history: History | None = None,
) -> Figure:
    """What an agent hears and answers in one trial, and how it learned.

    Args:
        agent: a neuron or a network, in bins or in continuous time.
        task, patterns: what it hears; or a data set of trials in place of both, of which the first
            with as large a label as half of them have is drawn.
        history: its learning curve, from `train` or, for one agent, `History.of`.

    Returns:
        A matplotlib Figure: (a) input spikes, each presentation shaded and named by its class from
        0 and by what it owes, (b) readout with its threshold and the output spikes, or for an agent
        in continuous time the bins that give S, (c) with `history` the learning curve.
    """
    trial = shown_trial(task, patterns)
    if history is not None and not isinstance(history, History):
        raise ValueError(f"history must be a History, got {shown(history)}")
    if history is not None and history.error_rate.ndim != 1:
        raise ValueError(
            "history must be that of one agent, got one of several: give history.of(k)"
        )
    heights = (1.3, 1, 1)[: 2 + (history is not None)]
    with styled():
        import matplotlib.pyplot as plt

        figure, grid = plt.subplots(
            len(heights), 1, figsize=(8, 7 * sum(heights) / 3.3), height_ratios=heights
        )
        raster, potential = grid[:2]
        potential.sharex(raster)
        draw_raster(raster, trial)
        draw_potential(potential, trial, agent)
        raster.tick_params(labelbottom=False)
        potential.set_xlabel("time (bins)")
        if history is not None:
            draw_learning_curve(grid[2], history)
        for axes, name in zip(grid, "abc", strict=False):
            letter(axes, name)
    return figure


def plot_responses(agent: Any, task: Task, patterns: Patterns) -> Figure:
    """V(t) over each pattern alone, after silence, with the output: how the agent counts."""
    with styled():
        height = 1.4 + 1.5 * task.n_classes
        figure, rows = panels(task.n_classes, 1, width=6, height=height, sharex=True, sharey=True)
        for class_, axes in enumerate(rows[:, 0]):
            trial = _lone_pattern(task, patterns, class_)
            draw_potential(axes, trial, agent)
            axes.set_title(
                f"class {class_}: owes {task.owed[class_]}, given {_output(agent, trial):.3g}",
                loc="left", color=class_colour(class_), fontsize=9,
            )  # fmt: skip
        rows[-1, 0].set_xlabel("time (bins)")
    return figure


def draw_raster(axes: Axes, trial: Trial) -> None:
    """Input spikes, each presentation shaded and labelled with what it owes."""
    bins, channels = np.nonzero(trial.dense())
    axes.plot(bins + 0.5, channels, "|", color="0.15", markersize=3, markeredgewidth=0.8)
    axes.set(xlim=(0, trial.n_bins), ylim=(-1, trial.n_inputs), ylabel="input channel")
    if trial.label_only:
        axes.set_title(f"label {trial.label}", loc="right")
    middles = (trial.onsets + trial.ends) / 2
    for middle, class_, owed in zip(middles, trial.classes, trial.targets, strict=True):
        axes.annotate(
            f"class {class_}, owes {owed}", (middle, 1.01),
            xycoords=("data", "axes fraction"), ha="center", va="bottom", fontsize=8,
            color=class_colour(class_),
        )  # fmt: skip
    shade(axes, trial)


def draw_potential(axes: Axes, trial: Trial, agent: Any) -> None:
    """The readout with its threshold and the output: spikes above it, or S shaded below it."""
    recording, threshold = record(agent, trial), _model(agent).threshold
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
        axes.bar(t[over], recording.X[over], width=1.0, color=OUTPUT, alpha=0.6, lw=0)
    else:
        spikes = t[recording.spikes]
        axes.plot(spikes, np.full(len(spikes), top), "v", color=OUTPUT, markersize=5)
    axes.set(
        ylabel="V, bins with output S shaded" if graded else "readout, spikes (▾)",
        ylim=(min(0.0, float(recording.X.min())), top * 1.08),
    )


def draw_learning_curve(axes: Axes, history: History) -> None:
    """Fraction of trials answered wrongly, and the mean error."""
    axes.plot(history.trials, history.error_rate, color="black", label="trials answered wrongly")
    axes.plot(
        history.trials, history.mean_error, color=class_colour(0), ls="--",
        label="mean |label − emitted| (spikes)",
    )  # fmt: skip
    axes.set(xlabel="trials", ylabel="error", ylim=(0, None), xlim=(0, None))
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.legend(frameon=False)


def _model(agent: Any) -> Any:
    """The neuron, or the network, that an agent is made of."""
    return agent.neuron if hasattr(agent, "neuron") else agent.network


def shown_trial(task: Task | Trials, patterns: Patterns | None, seed: int = 7) -> Trial:
    """A trial with every class in it, of ordinary length, for a picture; `seed` chooses it."""
    source = source_of(task, patterns)
    if isinstance(task, Trials):
        return task[int(np.argmax(task.labels >= np.median(task.labels)))]
    rng = np.random.default_rng(seed)
    (trial,) = source.trials(rng, 1)
    wanted = min(source.n_classes, 4)
    for _ in range(200):
        if wanted <= len(trial.onsets) <= wanted + 2 and len(set(trial.classes)) >= wanted:
            break
        (trial,) = source.trials(rng, 1)
    return trial


def _lone_pattern(task: Task, patterns: Patterns, class_: int) -> Trial:
    """A pattern between two stretches of silence."""
    silence = np.zeros((GAP, task.n_inputs), bool)
    raster = np.concatenate([silence, patterns.dense()[class_], silence])
    return Trial.from_dense(raster, [GAP], [class_], task)


def _output(agent: Any, trial: Trial) -> float:
    """The agent's output in a whole trial: spikes, or the amount of S."""
    agent.begin_trial()
    return float(sum(agent.act(row) for row in trial.dense().view(np.int8)))
