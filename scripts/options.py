"""Command-line options made from parameter classes: one group a class, one option a field.

The help of an option is what the class's docstring says of the field, so that it stands once.
"""

from __future__ import annotations

import argparse
import inspect
import re
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

_FIELD = re.compile(r"^    (\w+): (.*(?:\n        .*)*)", re.MULTILINE)


def field_help(cls: type) -> dict[str, str]:
    """What the "Attributes:" section of a class's docstring says of each field."""
    _, _, section = inspect.getdoc(cls).partition("Attributes:\n")  # type: ignore[union-attr]
    found = _FIELD.findall(section)
    return {name: re.sub(r"\s+", " ", text).rstrip(".").strip() for name, text in found}


def add_options(parser: argparse.ArgumentParser, classes: Mapping[str, type]) -> None:
    """Add a group of options for each class; `classes` gives each group's title.

    A field that several classes share is one option, shown with the first of them.
    """
    owners: dict[str, list[str]] = {}
    for title, cls in classes.items():
        for field in fields(cls):
            owners.setdefault(field.name, []).append(title)
    seen: set[str] = set()
    for title, cls in classes.items():
        group = parser.add_argument_group(title)
        helps, hints = field_help(cls), typing.get_type_hints(cls)
        for field in fields(cls):
            if field.name in seen:
                continue
            seen.add(field.name)
            text = helps.get(field.name, "")
            others = [owner for owner in owners[field.name] if owner != title]
            also = f"; also of {', '.join(others)}" if others else ""
            default = "" if field.default in (None, MISSING) else f" (default {field.default})"
            group.add_argument(
                f"--{field.name.replace('_', '-')}",
                default=None,
                help=(text + also + default).replace("%", "%%"),
                **_parsing(hints[field.name]),
            )


def _parsing(hint: Any) -> dict[str, Any]:
    """How argparse reads a value of this type."""
    kinds = [kind for kind in typing.get_args(hint) if kind is not types.NoneType]
    if isinstance(hint, types.UnionType) and len(kinds) == 1:
        hint = kinds[0]
    if typing.get_origin(hint) is tuple:
        return {"type": typing.get_args(hint)[0], "nargs": "+", "metavar": "N"}
    if hint is bool:
        return {"action": argparse.BooleanOptionalAction}
    return {"type": hint, "metavar": {int: "N", float: "X"}.get(hint, "NAME")}


def made(cls: type, options: argparse.Namespace) -> Any:
    """An object of `cls` from the options that were given."""
    given = {field.name: getattr(options, field.name) for field in fields(cls)}
    return cls(**{name: value for name, value in given.items() if value is not None})


def refuse_foreign(
    options: argparse.Namespace, chosen: Sequence[type], others: Mapping[str, type]
) -> None:
    """ValueError if an option was given that belongs to none of the chosen classes."""
    own = {field.name for cls in chosen for field in fields(cls)}
    for title, cls in others.items():
        for field in fields(cls):
            if field.name not in own and getattr(options, field.name) is not None:
                chosen_names = " and ".join(c.__name__ for c in chosen)
                raise ValueError(
                    f"--{field.name.replace('_', '-')} belongs to {title}, "
                    f"but {chosen_names} were chosen: leave it out"
                )
