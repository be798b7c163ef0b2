"""Results beside the league: one table and one picture a level, with intervals over pattern seeds.

placing = place("results/mine")
print(placing.text())
placing.draw("results/mine")
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation import bootstrap_interval
from agents.plotting import BINS, GREY, RED, styled
from agents.suite.league import LeagueRow, league_rows, level_of
from gnm_env.levels import Level, suite
from gnm_env.results import Result, Score, read_results

NEAR = 0.9
"""A score counts at equal experience after at least this share of it, and no more than all."""

PICTURES = ("placing.png", "placing.pdf")


@dataclass(frozen=True)
class Placing:
    """Where the agents of a folder stand.

    Attributes:
        rows: by level, then the best first; those of the folder have "own" true, and each has the
            name of its "level" beside the league's columns.
        notes: what a reader has to know of the numbers, a sentence each.
    """

    rows: tuple[LeagueRow, ...]
    notes: tuple[str, ...]

    @property
    def levels(self) -> list[Level]:
        """Those that the folder has results of."""
        return [suite()[name] for name in suite() if any(r["level"] == name for r in self.rows)]

    def of(self, level: Level) -> list[LeagueRow]:
        """The rows of a level, the best first."""
        return [row for row in self.rows if row["level"] == level.name]

    def text(self) -> str:
        """The tables, for a terminal; they are Markdown too. An arrow marks the folder's agents."""
        return "\n\n".join([*(_table(self.of(level), level) for level in self.levels), *self.notes])

    def draw(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write placing.png and placing.pdf into `folder`: mean and interval of every row."""
        with styled():
            from matplotlib.figure import Figure

            most = max(len(self.of(level)) for level in self.levels)
            size = (1.6 + 4.2 * len(self.levels), 0.9 + 0.21 * most)
            figure = Figure(figsize=size, layout="constrained")
            axes = figure.subplots(1, len(self.levels), squeeze=False)[0]
            for axis, level in zip(axes, self.levels, strict=True):
                _draw_level(axis, self.of(level), level)
            paths = [Path(folder) / name for name in PICTURES]
            for path in paths:
                figure.savefig(path)
        return paths


def place(folder: str | os.PathLike[str]) -> Placing:
    """The results in a folder beside the published league.

    Raises ValueError if a file is no result of this suite, if there is none, or if all are of
    pattern seeds that no score is reported on.
    """
    results = read_results(folder)
    counted = [r for r in results if r.pattern_seed in suite().pattern_seeds]
    seeds = suite().pattern_seeds
    span = f"{seeds[0]} … {seeds[-1]}"
    if not counted:
        raise ValueError(
            f"{folder} holds results of pattern seeds {_listed(results)} only, and scores are "
            f"reported on {span}: record them there"
        )
    notes = []
    if len(counted) < len(results):
        others = _listed([r for r in results if r not in counted])
        notes.append(f"Left out: pattern seeds {others}, on which settings may be chosen.")
    rows: list[LeagueRow] = []
    for name in suite():
        own = _own_rows(name, [result for result in counted if result.level == name])
        if own:
            few = [r for r in own if r["seeds"] < len(seeds)]
            notes += [
                f"{r['learner']} on {name}: {r['seeds']} of {len(seeds)} pattern seeds ({span})."
                for r in few
            ]
            beside = [{**row, "level": name, "own": False} for row in _others(suite()[name])]
            rows += sorted([*own, *beside], key=lambda row: -row["last"]["mean"])
    return Placing(tuple(rows), tuple(notes))


def _listed(results: Sequence[Result]) -> str:
    return ", ".join(map(str, sorted({result.pattern_seed for result in results})))


def _own_rows(level: str, results: Sequence[Result]) -> list[LeagueRow]:
    """One row per learner of the folder."""
    learners = sorted({result.learner for result in results})
    return [_own_row(level, [r for r in results if r.learner == name]) for name in learners]


def _own_row(level: str, results: Sequence[Result]) -> LeagueRow:
    published = league_rows(level)
    equal = published[0]["equal_experience"] if published else None
    matched = [_at(result, equal) for result in results] if equal else [None]
    told = [result.parameters for result in results if result.parameters is not None]
    return {
        "level": level,
        "own": True,
        "classes": suite()[level].task.n_classes,
        "learner": results[0].learner,
        "seeds": len(results),
        "at_equal_experience": None
        if None in matched
        else _numbers([s.mean for s in matched if s is not None]),
        "equal_experience": equal,
        "last": _numbers([result.last.mean for result in results]),
        "heard": max(result.last.heard for result in results),
        "seconds": round(float(np.mean([result.last.seconds for result in results])), 2),
        "parameters": max(told, default=0),
    }


def _at(result: Result, bins: int) -> Score | None:
    """The last score after about so many bins, not more; None if there is none."""
    near = [score for score in result.scores if NEAR * bins <= score.heard <= bins]
    return near[-1] if near else None


def _numbers(scores: Sequence[float]) -> dict[str, Any]:
    """Mean with its bootstrap interval over pattern seeds, and median: as in the league."""
    interval = [round(end) for end in bootstrap_interval(scores)] if len(scores) > 1 else None
    return {
        "mean": round(float(np.mean(scores))),
        "ci95": interval,
        "median": round(float(np.median(scores))),
    }


def _others(level: Level) -> list[LeagueRow]:
    """The league's rows, or silence alone where the league has none."""
    published = [row for row in league_rows() if level_of(row) == level.name]
    if published or not all(level.task.owed):
        return published
    silent = round(level.task.silent_score)
    return [
        {
            "classes": level.task.n_classes, "learner": "silent", "seeds": 0,
            "at_equal_experience": None, "equal_experience": None,
            "last": {"mean": silent, "ci95": None, "median": silent},
            "heard": 0, "seconds": 0.0, "parameters": 0,
        }
    ]  # fmt: skip


def _table(rows: Sequence[LeagueRow], level: Level) -> str:
    from agents.experiments.league import HEADINGS, cells_of

    lines = [HEADINGS, *(_marked(cells_of(row), row["own"]) for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]

    def joined(cells: Sequence[str]) -> str:
        padded = [
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return "| " + " | ".join(padded) + " |"

    dashes = ["-" * width if k == 0 else "-" * (width - 1) + ":" for k, width in enumerate(widths)]
    equal = next((row["equal_experience"] for row in rows if row["equal_experience"]), None)
    experience = f"; equal experience: {equal / 1e6:g} million bins" if equal else ""
    title = (
        f"{level.name}: {level.about}{experience}. Mean noisy performance over pattern seeds "
        "[95 % interval], in bins:"
    )
    return "\n".join([title, "", *map(joined, [lines[0], dashes, *lines[1:]])])


def _marked(cells: tuple[str, ...], own: bool) -> tuple[str, ...]:
    return (f"→ {cells[0]}" if own else cells[0], *cells[1:])


def _draw_level(axis: Any, rows: Sequence[LeagueRow], level: Level) -> None:
    for place_, row in enumerate(rows):
        colour = RED if row["own"] else GREY
        low, high = row["last"]["ci95"] or [row["last"]["mean"]] * 2
        axis.plot([low, high], [place_, place_], color=colour, linewidth=2.0)
        axis.plot(row["last"]["mean"], place_, "D" if row["own"] else "o", color=colour)
    axis.set_yticks(range(len(rows)), [row["learner"] for row in rows])
    for label, row in zip(axis.get_yticklabels(), rows, strict=True):
        label.set(color=RED if row["own"] else "black", weight="bold" if row["own"] else "normal")
    if all(level.task.owed):
        axis.axvline(level.task.silent_score, color="0.4", linewidth=0.8, linestyle=(0, (1, 2)))
    axis.set(xlim=(-200, suite().cap + 200), ylim=(len(rows) - 0.5, -0.5), xlabel=BINS)
    axis.set_title(level.name)
