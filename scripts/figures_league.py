"""The league's table and picture, from its store; nothing here trains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.statistics import mean, median
from gnm_env import Task
from store import read

SILENT_SCORE = Task().silent_score
CAP = 10_000


class Style(NamedTuple):
    """How a learner is drawn: colours of Okabe and Ito, told apart in grey by dashes and marks."""

    colour: str
    dashes: str
    mark: str


STYLES = {
    "GNM, ALL": Style("#0072B2", "-", "o"),
    "GNM, ET": Style("#0072B2", ":", "o"),
    "GNM, ET modulated": Style("#0072B2", "--", "o"),
    "LIF, ALL": Style("#56B4E9", "-", "s"),
    "LIF, ET": Style("#56B4E9", ":", "s"),
    "LIF, ET modulated": Style("#56B4E9", "--", "s"),
    "MST, ALL": Style("#009E73", "-", "^"),
    "MST, ET": Style("#009E73", ":", "^"),
    "MST, ET modulated": Style("#009E73", "--", "^"),
    "network, BP": Style("#000000", "-", "D"),
    "PPO, cost": Style("#D55E00", "-", "o"),
    "PPO, dense": Style("#D55E00", "--", "o"),
    "PPO linear, cost": Style("#E69F00", "-", "s"),
    "RecurrentPPO, cost": Style("#CC79A7", "-", "^"),
    "RecurrentPPO, dense": Style("#CC79A7", "--", "^"),
    "DQN, dense": Style("#999999", "--", "D"),
}
"""Learners with a learning curve; the others are rows of the table only."""


def read_league(folder: Path) -> xr.Dataset:
    """One part of the league, as far as it is; where nothing was scored there is NaN."""
    results = read(folder, unfinished=True)
    settings = results.attrs["settings"]["protocol"]
    milestones = [*settings["milestones"], -1]
    results = results.assign_coords(milestone=milestones)
    score = results["survived"].where(results["survived"] >= 0).mean("run")
    return results.assign(score=score).assign_attrs(
        budget={int(classes): bins for classes, bins in settings["budget"].items()}
    )


def rows(results: Sequence[xr.Dataset]) -> list[dict[str, Any]]:
    """The table: one row per number of classes and learner, the best last score first."""
    table = [_row(cell) for part in results for cell in _cells(part)]
    return sorted(table, key=lambda row: (row["classes"], -row["last"]["mean"]))


def _cells(part: xr.Dataset) -> Iterator[xr.Dataset]:
    for classes in part["classes"].to_numpy():
        for learner in part["learner"].to_numpy():
            cell = _finished(part.sel(classes=classes, learner=learner))
            if cell.sizes["pattern_seed"]:
                yield cell


def _finished(part: xr.Dataset) -> xr.Dataset:
    """Without the pattern seeds on which a learner is still to be trained."""
    done = part["score"].sel(milestone=-1).notnull()
    return part.isel(pattern_seed=np.flatnonzero(done.to_numpy()))


def _row(cell: xr.Dataset) -> dict[str, Any]:
    classes = int(cell["classes"])
    last = cell.sel(milestone=-1)
    matched = cell["score"].sel(milestone=cell.attrs["budget"][classes]).to_numpy()
    return {
        "classes": classes,
        "learner": str(cell["learner"].item()),
        "seeds": cell.sizes["pattern_seed"],
        "at_equal_experience": _numbers(matched) if np.isfinite(matched).all() else None,
        "equal_experience": cell.attrs["budget"][classes],
        "last": _numbers(last["score"].to_numpy()),
        "heard": int(last["heard"].max()),
        "seconds": round(float(last["seconds"].mean()), 2),
        "parameters": int(cell["parameters"].max()),
    }


def _numbers(scores: NDArray[Any]) -> dict[str, Any]:
    """Mean with its bootstrap interval over pattern seeds, and median."""
    value, low, high = mean(scores)
    interval = [round(low), round(high)] if np.isfinite(low) else None
    return {"mean": round(value), "ci95": interval, "median": round(median(scores).value)}


HEADINGS = (
    "learner", "seeds", "at equal experience", "median", "whole budget", "median", "bins heard",
    "training", "parameters",
)  # fmt: skip


def cells_of(row: dict[str, Any]) -> tuple[str, ...]:
    """A row as text."""
    equal = row["at_equal_experience"]
    return (
        row["learner"],
        str(row["seeds"]),
        _with_interval(equal) if equal else "",
        f"{equal['median']:,}" if equal else "",
        _with_interval(row["last"]),
        f"{row['last']['median']:,}",
        f"{row['heard'] / 1e6:.1f} M" if row["heard"] else "",
        f"{row['seconds']:,.1f} s" if row["heard"] else "",
        f"{row['parameters']:,}" if row["parameters"] else "",
    )


def _with_interval(numbers: dict[str, Any]) -> str:
    ends = numbers["ci95"]
    return f"{numbers['mean']:,}" + (f" [{ends[0]:,} … {ends[1]:,}]" if ends else "")


def text_table(table: Sequence[dict[str, Any]]) -> str:
    """The table for a terminal; it is Markdown too."""
    parts = []
    for classes in sorted({row["classes"] for row in table}):
        chosen = [row for row in table if row["classes"] == classes]
        lines = [HEADINGS, *map(cells_of, chosen)]
        widths = [max(len(line[k]) for line in lines) for k in range(len(HEADINGS))]
        text = [_line(line, widths) for line in lines]
        rule = "|" + "|".join("-" * (w + 1) + ("-" if k == 0 else ":") for k, w in
                              enumerate(widths)) + "|"  # fmt: skip
        title = (
            f"{classes} class{'es' if classes > 1 else ''}; equal experience: "
            f"{chosen[0]['equal_experience'] / 1e6:g} million bins. Mean noisy performance over "
            "pattern seeds [95 % interval], in bins:"
        )
        parts.append("\n".join([title, "", text[0], rule, *text[1:]]))
    return "\n\n".join(parts) + "\n"


def _line(line: Sequence[str], widths: Sequence[int]) -> str:
    cells = [
        text.ljust(width) if k == 0 else text.rjust(width)
        for k, (text, width) in enumerate(zip(line, widths, strict=True))
    ]
    return "| " + " | ".join(cells) + " |"


def draw(results: Sequence[xr.Dataset], folder: Path) -> list[Path]:
    """league.png and league.pdf in `folder`: learning curves above, last scores below."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    counts = sorted({int(c) for part in results for c in part["classes"].to_numpy()})
    names = [name for name in STYLES if any(name in part["learner"] for part in results)]
    figure, axes = plt.subplots(
        2,
        len(counts),
        figsize=(1.2 + 5.0 * len(counts), 4.0 + 0.24 * len(names) + 0.9),
        height_ratios=(4.0, 0.24 * len(names) + 0.9),
        squeeze=False,
        layout="constrained",
    )
    for k, classes in enumerate(counts):
        _curves(axes[0, k], results, classes)
        _scores(axes[1, k], results, classes, names, labelled=k == 0)
    axes[0, 0].set_ylabel("noisy performance (bins)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8, frameon=False)
    paths = [folder / "league.png", folder / "league.pdf"]
    for path in paths:
        figure.savefig(path, dpi=150)
    plt.close(figure)
    return paths


def _curves(axes: Any, results: Sequence[xr.Dataset], classes: int) -> None:
    for part in results:
        for cell in _cells(part.sel(classes=[classes])):
            name = str(cell["learner"].item())
            if name in STYLES:
                _curve(axes, cell, name)
    axes.axhline(SILENT_SCORE, color="0.4", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.axvline(results[0].attrs["budget"][classes], color="0.7", linewidth=0.8, zorder=0)
    axes.annotate("silent", (0.01, SILENT_SCORE), xycoords=("axes fraction", "data"),
                  fontsize=8, color="0.3", va="bottom")  # fmt: skip
    axes.set(
        xscale="log",
        ylim=(0, CAP),
        xlabel="bins heard in training",
        title=f"{classes} class{'es' if classes > 1 else ''}",
    )


def _curve(axes: Any, learner: xr.Dataset, name: str) -> None:
    style = STYLES[name]
    scores = learner["score"].transpose("milestone", "pattern_seed").to_numpy()
    heard = learner["heard"].isel(pattern_seed=0).to_numpy()
    there = np.flatnonzero(heard > 0)
    # The last score may repeat that of a milestone: keep one.
    order = there[np.unique(heard[there], return_index=True)[1]]
    intervals = [mean(scores[place]) for place in order]
    axes.plot(
        heard[order],
        [interval.value for interval in intervals],
        style.dashes,
        color=style.colour,
        marker=style.mark,
        markersize=4,
        linewidth=1.4,
        label=name,
    )


def _scores(
    axes: Any, results: Sequence[xr.Dataset], classes: int, names: list[str], *, labelled: bool
) -> None:
    """Each pattern seed's last score as a point, the mean with its interval above it."""
    for part in results:
        for cell in _cells(part.sel(classes=[classes])):
            name = str(cell["learner"].item())
            if name not in names:
                continue
            style, row = STYLES[name], names.index(name)
            scores = cell["score"].sel(milestone=-1).to_numpy()
            axes.plot(scores, np.full(len(scores), row), style.mark, color=style.colour,
                      markersize=4, alpha=0.45, markeredgewidth=0)  # fmt: skip
            value, low, high = mean(scores)
            if np.isfinite(low):
                axes.plot([low, high], [row, row], color="0.15", linewidth=1.4)
            axes.plot([value], [row], "|", color="0.15", markersize=11, markeredgewidth=1.8)
    axes.axvline(SILENT_SCORE, color="0.4", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set(xlim=(-150, CAP + 150), xlabel="noisy performance with the whole budget (bins)")
    axes.set_yticks(range(len(names)), names if labelled else [], fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
