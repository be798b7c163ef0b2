"""Agents that come with the package, trained: `agents.pretrained("gnm-critical-2")`.

Each is a checkpoint beside this file, with its task and its patterns; `scores.json` says how it was
made and how long it survives. `python scripts/pretrain.py` makes them all anew.
"""

from __future__ import annotations

import difflib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.checkpoint import Checkpoint, load_checkpoint

HERE = Path(__file__).parent
SCORES = "scores.json"


@dataclass(frozen=True)
class Score:
    """How long an agent survived on streams that it was not chosen on.

    Attributes:
        mean: noisy performance in bins.
        low, high: 95 % bootstrap interval of the mean.
        runs, cap, seed: of `agents.noisy_performance`.
    """

    mean: float
    low: float
    high: float
    runs: int
    cap: int
    seed: int


def names() -> list[str]:
    """The agents that there are: neuron, rule and number of classes."""
    return sorted(_table())


def pretrained(name: str) -> Checkpoint:
    """The trained agent `name`, with its task and patterns; ValueError if there is none."""
    if not isinstance(name, str) or name not in _table():
        near = difflib.get_close_matches(str(name), names(), 1)
        hint = f", did you mean {near[0]!r}?" if near else ""
        raise ValueError(
            f"there is no trained agent {name!r}{hint}; there are {', '.join(names())}"
        )
    return load_checkpoint(HERE / f"{name}.npz")


def published_score(name: str) -> Score:
    """What the trained agent `name` scored when it was made."""
    pretrained(name)
    return Score(**_table()[name]["score"])


def _table() -> dict[str, Any]:
    table: dict[str, Any] = json.loads((HERE / SCORES).read_text(encoding="utf-8"))
    return table
