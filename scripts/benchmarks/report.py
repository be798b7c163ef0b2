"""The findings as a table for the terminal, and as the page docs/performance.md."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from itertools import groupby
from statistics import median
from typing import Any

from agents.experiments.markdown import markdown_table
from agents.experiments.progress import duration
from agents.memory import (
    BYTES_AT_LEAST,
    BYTES_PER_AGENT,
    BYTES_PER_BIN,
    BYTES_PER_SPIKE,
    BYTES_PER_WEIGHT,
)
from agents.model import Model
from benchmarks.rows import BEST_ONLY, MET, MISSED, Curve, Findings, Row, Target

HEADINGS = ("", "median", "unit", "min … max", "best", "× as fast", "core", "target", "reached")
SHARED = 0.95
"""Below this share of a core's time the machine was busy with something else as well."""


def number(value: float) -> str:
    """Three figures, thousands set apart: 1,234 or 56.7 or 0.0123."""
    if value == 0 or abs(value) >= 100:
        return f"{value:,.0f}"
    if abs(value) >= 10:
        return f"{value:.1f}"
    return f"{value:.2f}" if abs(value) >= 1 else f"{value:.3g}"


def cells(row: Row) -> tuple[str, ...]:
    """What the table shows of a row, one text per heading."""
    spread = f"{number(min(row.values))} … {number(max(row.values))}"
    one = len(row.values) == 1
    ratio = f"{number(median(row.ratios))} × {row.against}" if row.ratios else ""
    share = f"{100 * median(row.cpu_share):.0f} %" if row.cpu_share else ""
    return (
        row.name,
        number(row.median),
        row.unit,
        "" if one else spread,
        "" if one else number(row.best),
        ratio,
        share,
        "; ".join(sought(row, target) for target in row.targets),
        "; ".join(row.reached(target) for target in row.targets),
    )


def sought(row: Row, target: Target) -> str:
    """A target in words."""
    sign = "≥" if target.of == "ratio" or row.more_is_better else "≤"
    times = " ×" if target.of == "ratio" else ""
    aim = f" (aim {number(target.aim)})" if target.aim is not None else ""
    return f"{sign} {number(target.bound)}{times}{aim}"


def sections(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    """Rows by section, in the order of first appearance."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row.section, []).append(row)
    return list(found.items())


def verdicts(rows: Iterable[Row]) -> dict[str, int]:
    """How many targets are met, by the best repeat only, and missed."""
    reached = [row.reached(target) for row in rows for target in row.targets]
    return {verdict: reached.count(verdict) for verdict in (MET, BEST_ONLY, MISSED)}


def summary(found: Findings) -> str:
    """The verdicts in one line, and whether the machine was disturbed."""
    counts = verdicts(found.rows)
    total = sum(counts.values())
    line = f"{counts[MET]} of {total} targets met"
    if counts[BEST_ONLY]:
        line += f", {counts[BEST_ONLY]} by the best repeat only"
    if counts[MISSED]:
        line += f", {counts[MISSED]} not met"
    share = shared(found.rows)
    if share < SHARED:
        line += (
            f". The machine was shared: the measurements on one core had {100 * share:.0f} % of "
            "its time at the median, so the speeds are too low"
        )
    return line + "."


def shared(rows: Iterable[Row]) -> float:
    """Median share of a core's time over all measurements on one core."""
    shares = [s for row in rows for s in row.cpu_share if s <= 1.05]
    return median(shares) if shares else 1.0


def table(found: Findings) -> str:
    """The whole table as plain text."""
    shown = [HEADINGS, *(cells(row) for row in found.rows)]
    widths = [max(len(line[k]) for line in shown) for k in range(len(HEADINGS))]
    lines = [_aligned(HEADINGS, widths)]
    for section, rows in sections(found.rows):
        lines += ["", section]
        for row in rows:
            lines.append(_aligned(cells(row), widths))
    for curve in found.curves:
        lines += ["", f"{curve.name}: {curve.unit}" + (f" ({curve.note})" if curve.note else "")]
        lines += [f"  {size:>12,.10g}  {number(median(v))}" for size, v in _points(curve)]
    lines += ["", *(f"skipped: {text}" for text in found.skipped)]
    lines += [f"FAILED: {text}" for text in found.failed]
    return "\n".join([*lines, summary(found)])


def _aligned(texts: Sequence[str], widths: Sequence[int]) -> str:
    to_the_right = {1, 4, 6}
    padded = (
        text.rjust(width) if k in to_the_right else text.ljust(width)
        for k, (text, width) in enumerate(zip(texts, widths, strict=True))
    )
    return "  ".join(padded).rstrip()


def _points(curve: Curve) -> Iterable[tuple[float, tuple[float, ...]]]:
    return zip(curve.sizes, curve.values, strict=True)


# --- the page ------------------------------------------------------------------------------------

PICTURE = "![Targets reached, other software, and growth](images/performance.png)"

INTRODUCTION = """\
# Performance

{summary} This page is written by `python scripts/benchmark.py --publish` from its last run.

{picture}## How it was measured

`{command}`{took}. Every number is the median of {repeats} repeats, unless only one is given. All \
competitors of a section take turns, so that a disturbance hits all alike, and every second round \
goes backwards; ratios compare within a round. The process was {pinned}. *Best* is the least \
disturbed repeat. *Core* is the share of a core's time that the measurement had (200 % with two \
threads on two cores): where it is well below 100 %, other programs ran too. A *neuron-bin* is one \
neuron living through one bin of one trial, with its part of the learning. Everything was compiled \
before the clock started, except where the start is what is measured.
"""

MEMORY = f"""\
Training n neurons with N inputs side by side takes at most {BYTES_PER_WEIGHT}·N·n + \
{BYTES_PER_AGENT:,}·n + ({BYTES_PER_BIN} + {BYTES_PER_SPIKE}·N·p)·T·threads bytes and \
{BYTES_AT_LEAST // 2**20} MiB, where p is the rate of input spikes and T the longest trial in \
bins: O(N·n + T·block), with blocks of {Model.widest} neurons, one block per thread. The agents \
are counted. The table above compares this with the peak of the resident memory."""


def page(found: Findings, with_picture: bool = True) -> str:
    """The page in Markdown; its picture is to lie in images/."""
    seconds = found.settings.get("seconds")
    introduction = INTRODUCTION.format(
        summary=summary(found),
        picture=f"{PICTURE}\n\n" if with_picture else "",
        command=found.settings["command"],
        took=f" took {duration(seconds)}" if seconds else ", not finished",
        repeats=found.settings["repeats"],
        pinned="kept on one core unless a row says otherwise"
        if found.machine["pinned"]
        else "not kept on a core, which this system does not offer",
    )
    text = [*map(_wrapped, introduction.split("\n\n")), _machine(found.machine), "## Numbers"]
    for section, rows in sections(found.rows):
        text += [f"### {section}", _markdown(HEADINGS, [cells(row) for row in rows]), _notes(rows)]
    if found.curves:
        text += ["## Growth", "Medians of the time for one neuron-bin, or one environment's step."]
        text += [_curve(curve) for curve in found.curves]
    text += ["## Memory", _wrapped(MEMORY)]
    if found.skipped or found.failed:
        text += ["## Left out", "\n".join(f"- {line}" for line in found.skipped + found.failed)]
    return "\n\n".join(part.strip() for part in text if part.strip()) + "\n"


def _wrapped(paragraph: str) -> str:
    """A paragraph in lines of at most 100 characters."""
    return textwrap.fill(paragraph, 100, break_long_words=False, break_on_hyphens=False)


def _machine(machine: dict[str, Any]) -> str:
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    facts = [
        ("Processor", machine["processor"]),
        ("Compiled for", machine["instructions"]),
        ("Cores", f"{machine['logical_cores']} logical, {machine['cores_measured_on']} physical"),
        ("Memory", f"{machine['memory_gib']} GiB"),
        ("Load before the run", machine["load_before"]),
        ("System", machine["system"]),
        ("Python", machine["python"]),
        ("Packages", packages),
        ("Software", f"{machine['software']}, commit {machine['commit']}"),
    ]
    lines = [(name, str(value)) for name, value in facts if value is not None]
    return "## The machine\n\n" + _markdown(("", ""), lines)


def _notes(rows: Iterable[Row]) -> str:
    noted = [(note, list(group)) for note, group in groupby(rows, key=lambda row: row.note) if note]
    return "\n".join(f"- {', '.join(row.name for row in group)}: {note}." for note, group in noted)


def _curve(curve: Curve) -> str:
    head = (curve.symbol, *(f"{size:,.10g}" for size in curve.sizes))
    line = (curve.unit, *(number(median(v)) for _, v in _points(curve)))
    note = f" ({curve.note})" if curve.note else ""
    return f"### By {curve.name}{note}\n\n" + _markdown(head, [line])


def _markdown(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    return "\n".join(markdown_table(head, lines, right=len(head)))
