"""The league's table as it was last published: rows to set other agents beside.

`league.json` beside this file holds them; `gnm league --so-far --keep` writes it anew from a
finished league.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gnm_env.files import atomic_write

FILE = Path(__file__).with_name("league.json")

LeagueRow = dict[str, Any]
"""One learner on so many classes, as `agents.experiments.league.rows` makes it."""


def league_rows(level: str | None = None) -> list[LeagueRow]:
    """The rows of the published league, the best first; of one level, or of all."""
    rows: list[LeagueRow] = json.loads(FILE.read_text(encoding="utf-8"))["rows"]
    return [row for row in rows if level is None or level_of(row) == level]


def level_of(row: Mapping[str, Any]) -> str:
    """Name of the level that a row of the league is about."""
    return f"{row['classes']}class"


def keep(rows: Sequence[LeagueRow]) -> Path:
    """Write `league.json` from the rows of a league. Returns its path."""
    with atomic_write(FILE) as file:
        lines = ",\n".join("    " + json.dumps(row, ensure_ascii=False) for row in rows)
        file.write(f'{{\n  "rows": [\n{lines}\n  ]\n}}\n'.encode())
    return FILE
