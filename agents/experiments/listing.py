"""What there is: the subjects of the paper, with their experiments, claims and figures by name.

A subject is a module beside this one that has any of

    EXPERIMENTS   {name: function of the size and, if given, of the pattern seeds -> Experiment}
    CLAIMS        the claims of the paper that it judges
    PICTURES      {name: Picture}
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable
from types import ModuleType
from typing import Any

from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.verdict import Claim
from agents.registry import load_module

SUBJECTS = (
    "constant_input",
    "continuous_time",
    "heat_maps",
    "lif_ratio",
    "methods",
    "reactions",
    "table",
)
"""In the order of the paper, which is that of the report."""

SIZES = ("quick", "paper")

Builder = Callable[[str, tuple[int, ...] | None], Experiment]


def subjects() -> list[ModuleType]:
    """The modules of all subjects."""
    return [importlib.import_module(f"agents.experiments.{name}") for name in SUBJECTS]


def experiments() -> dict[str, Builder]:
    """All experiments of the paper, by name."""
    return {name: build for one in subjects() for name, build in _of(one, "EXPERIMENTS").items()}


def claims() -> tuple[Claim, ...]:
    """Every claim of the paper that is judged, in the paper's order."""
    return tuple(claim for one in subjects() for claim in getattr(one, "CLAIMS", ()))


def pictures() -> dict[str, Picture]:
    """All figures, by name."""
    return {name: picture for one in subjects() for name, picture in _of(one, "PICTURES").items()}


def _of(subject: ModuleType, what: str) -> dict[str, Any]:
    found: dict[str, Any] = getattr(subject, what, {})
    return found


def experiment(name: str, size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The experiment `name` at `size`: one of the paper's, or your own.

    Your own is given as "module:name" or "path/to/file.py:name": an Experiment, or a function of
    the size and the pattern seeds (None: its own) that makes one. Raises ValueError if there is
    none, or if it cannot have other pattern seeds.
    """
    place, _, attribute = name.rpartition(":")
    if not place:
        known = experiments()
        if name not in known:
            raise ValueError(
                f"there is no experiment {name!r}: choose one of {', '.join(known)}; yours is "
                "given as module:name or file.py:name"
            )
        found: Any = known[name]
    else:
        found = getattr(load_module(place), attribute, None)
    if isinstance(found, Experiment):
        if seeds:
            raise ValueError(f"{name} has pattern seeds of its own: leave --seeds out")
        return found
    made = found(size, seeds) if callable(found) and _takes_two(found) else found
    if not isinstance(made, Experiment):
        raise ValueError(
            f"{name} must be an Experiment, or a function of size and pattern seeds that makes "
            f"one, got {made!r}"
        )
    return made


def _takes_two(function: Callable[..., Any]) -> bool:
    try:
        inspect.signature(function).bind("size", "seeds")
    except (TypeError, ValueError):
        return False
    return True
