"""Tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from agents.experiments.statistics import Interval


def markdown_table(
    head: Sequence[Any], rows: Iterable[Sequence[Any]], right: int | None = None
) -> list[str]:
    """The lines of a table; `right`: the column from which on numbers stand to the right."""
    first = len(head) if right is None else right
    rule = ["---"] * first + ["---:"] * (len(head) - first)
    drawn = f"|{'|'.join(rule)}|" if right is None else _row(rule)
    return [_row(head), drawn, *map(_row, rows)]


def _row(cells: Iterable[Any]) -> str:
    """One line of a table."""
    return f"| {' | '.join(map(str, cells))} |"


def in_brackets(found: Interval, spec: str) -> str:
    """A value with its interval, if it has one, in round brackets."""
    ends = f" ({found.low:{spec}} … {found.high:{spec}})" if math.isfinite(found.low) else ""
    return f"{found.value:{spec}}{ends}"
