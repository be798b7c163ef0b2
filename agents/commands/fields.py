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
    _, _, section = (inspect.getdoc(cls) or "").partition("Attributes:\n")
    found = _FIELD.findall(section)
    return {name: re.sub(r"\s+", " ", text).rstrip(".").strip() for name, text in found}


def add_options(parser: argparse.ArgumentParser, classes: Mapping[str, type]) -> None:
    """Add a group of options for each class; `classes` gives each group's title.

    A field that several classes share is one option, shown with the first of them. A field whose
    type is neither a number, a word, yes or no, nor a row of numbers is no option.
    """
    owners: dict[str, list[str]] = {}
    for title, cls in classes.items():
        for field in fields(cls):
            owners.setdefault(field.name, []).append(title)
    for title, cls in classes.items():
        group = parser.add_argument_group(title)
        helps, hints = field_help(cls), typing.get_type_hints(cls)
        for field in fields(cls):
            how = _parsing(hints[field.name])
            if owners[field.name][0] != title or how is None:
                continue
            also = f"; also of {', '.join(owners[field.name][1:])}"
            default = "" if field.default in (None, MISSING) else f" (default {field.default})"
            text = helps.get(field.name, "") + (also if owners[field.name][1:] else "") + default
            try:
                group.add_argument(_option(field.name), help=text.replace("%", "%%"), **how)
            except argparse.ArgumentError:
                raise ValueError(
                    f"the field {field.name} of {cls.__name__} has the name of another option, "
                    f"{_option(field.name)}: rename it"
                ) from None


def made(cls: type, options: argparse.Namespace) -> Any:
    """An object of `cls` from the options that were given."""
    given = {field.name: getattr(options, field.name, None) for field in fields(cls)}
    return cls(**{name: value for name, value in given.items() if value is not None})


def given(options: argparse.Namespace, classes: Mapping[str, type]) -> dict[str, str]:
    """The options for fields that were given, each with the title of its first class."""
    found: dict[str, str] = {}
    for title, cls in classes.items():
        for field in fields(cls):
            if getattr(options, field.name, None) is not None:
                found.setdefault(field.name, title)
    return found


def refuse_foreign(
    options: argparse.Namespace, chosen: Sequence[type], others: Mapping[str, type]
) -> None:
    """ValueError if an option was given that belongs to none of the chosen classes."""
    own = {field.name for cls in chosen for field in fields(cls)}
    for name, title in given(options, others).items():
        if name not in own:
            names = " and ".join(cls.__name__ for cls in chosen)
            raise ValueError(
                f"{_option(name)} belongs to {title}, but {names} were chosen: leave it out"
            )


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def without_none(hint: Any) -> tuple[Any, bool]:
    """A type of which None is no longer one, and whether it was."""
    kinds = [kind for kind in typing.get_args(hint) if kind is not types.NoneType]
    optional = len(kinds) < len(typing.get_args(hint))
    return (kinds[0] if optional and len(kinds) == 1 else hint), optional


def _parsing(hint: Any) -> dict[str, Any] | None:
    """How argparse reads a value of this type; None if it cannot."""
    hint, _ = without_none(hint)
    if typing.get_origin(hint) is tuple:
        return {"type": typing.get_args(hint)[0], "nargs": "+", "metavar": "N"}
    if hint is bool:
        return {"action": argparse.BooleanOptionalAction}
    metavar = {int: "N", float: "X", str: "NAME"}.get(hint)
    return {"type": hint, "metavar": metavar} if metavar else None
