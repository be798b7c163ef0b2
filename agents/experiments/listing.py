"""What there is: the subjects, with their experiments, claims, hypotheses and figures by name.

A subject is a module beside this one that has any of

    EXPERIMENTS   {name: function of the size and, if given, of the pattern seeds -> Experiment}
    CLAIMS        the claims of the paper that it judges
    HYPOTHESES    what is expected beyond the paper, with the rules that judge it
    PICTURES      {name: Picture}

`SUBJECTS` are those of the paper, which `gnm reproduce` runs; `BEYOND` are questions that its
method could not ask, which `gnm findings` runs.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

from agents.experiments.design import Experiment
from agents.experiments.figures import Picture
from agents.experiments.verdict import Claim, Hypothesis
from agents.registry import load_module

SUBJECTS = (
    "constant_input",
    "response",
    "continuous_time",
    "heat_maps",
    "two_peaks",
    "lines",
    "residuals",
    "lif_ratio",
    "methods",
    "by_condition",
    "reactions",
    "discussion",
    "equations",
    "table",
)
"""In the order of the paper, which is that of the report."""

BEYOND = (
    "memory",
    "who_wins",
    "ceiling",
    "hidden_unit",
    "when_memory",
    "when_memory_rl",
    "capacity",
    "gutig_tasks",
)
"""In the order of the page on the findings."""

SIZES = ("quick", "paper")

Builder = Callable[[str, tuple[int, ...] | None], Experiment]


def subjects(names: Sequence[str] = SUBJECTS) -> list[ModuleType]:
    """The modules of the subjects named, by default those of the paper."""
    return [importlib.import_module(f"agents.experiments.{name}") for name in names]


def experiments(names: Sequence[str] = SUBJECTS) -> dict[str, Builder]:
    """All experiments of these subjects, by name."""
    return {
        name: build for one in subjects(names) for name, build in _of(one, "EXPERIMENTS").items()
    }


def claims() -> tuple[Claim, ...]:
    """Every claim of the paper that is judged: figures first, then supplement and discussion."""
    found = (claim for one in subjects() for claim in getattr(one, "CLAIMS", ()))
    return tuple(sorted(found, key=lambda claim: (_PARTS.index(claim.id[0]), claim.id)))


_PARTS = "FSD"


def hypotheses() -> tuple[Hypothesis, ...]:
    """Every hypothesis beyond the paper."""
    return tuple(one for subject in subjects(BEYOND) for one in getattr(subject, "HYPOTHESES", ()))


def pictures(names: Sequence[str] = SUBJECTS) -> dict[str, Picture]:
    """All figures of these subjects, by name."""
    return {
        name: picture for one in subjects(names) for name, picture in _of(one, "PICTURES").items()
    }


def _of(subject: ModuleType, what: str) -> dict[str, Any]:
    found: dict[str, Any] = getattr(subject, what, {})
    return found


def experiment(name: str, size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The experiment `name` at `size`: one of those here, or your own.

    Your own is given as "module:name" or "path/to/file.py:name": an Experiment, or a function of
    the size and the pattern seeds (None: its own) that makes one. Raises ValueError if there is
    none, or if it cannot have other pattern seeds.
    """
    place, _, attribute = name.rpartition(":")
    if not place:
        known = experiments((*SUBJECTS, *BEYOND))
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
