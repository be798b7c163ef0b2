"""What the page offers to set, read off the classes: fields, ranges, symbols and explanations.

Nothing here knows a neuron or a rule by name, so that yours have their sliders too. A range is
found by trial: each class says by ValueError what it does not take.
"""

from __future__ import annotations

import dataclasses
import functools
import re
import typing
from collections.abc import Callable
from typing import Any

from agents import registry
from agents.commands.fields import field_help, without_none
from agents.experiments.models import default_rule, new_agent
from gnm_env import Task
from gnm_env.colours import CLASS_COLOURS, as_hex

Control = dict[str, Any]
"""One thing to set, ready for JSON: key, kind, symbol, help, default, and for numbers a range."""

TASK_FIRST = ("n_classes", "n_inputs", "rate")
"""Fields of the task that are always in sight."""
MODEL_FIRST, RULE_FIRST = 3, 2
"""How many of the first fields of a neuron and of a rule are always in sight."""

_SMALL = 0.02
"""Positive numbers up to this are set on a logarithmic scale."""


def schema() -> dict[str, Any]:
    """All that can be set, ready for JSON."""
    models = {**registry.neurons(), **registry.networks()}
    rules = registry.rules()
    return {
        "models": [_model(cls, rules) for cls in models.values()],
        "rules": [
            _described(cls) | {"controls": controls(cls, "r", _first(cls, RULE_FIRST))}
            for cls in rules.values()
        ],
        "task": controls(Task, "t", TASK_FIRST),
        "class_colours": [as_hex(colour) for colour in CLASS_COLOURS],
    }


def _model(cls: Any, rules: dict[str, Any]) -> dict[str, Any]:
    chosen = default_rule(cls)
    suited = [name for name, rule in rules.items() if suits(cls, rule)]
    return _described(cls) | {
        "controls": controls(cls, "n", _first(cls, MODEL_FIRST)),
        "rules": suited,
        "rule": chosen if chosen in suited else next(iter(suited), None),
        "initial_weight": cls.default_initial_weight,
        "bounded": cls.kind == "neuron",
    }


def _described(cls: Any) -> dict[str, Any]:
    about = " ".join((cls.__doc__ or cls.__name__).split()).partition(". ")[0].rstrip(".")
    return {"name": cls.name, "title": cls.__name__, "about": about}


def _first(cls: Any, count: int) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(cls)[:count])


def suits(model: Any, rule: Any) -> bool:
    """Whether agents of this model learn by this rule, both as they are by default."""
    try:
        new_agent(model(), rule(), 100)
    except (TypeError, ValueError):
        return False
    return True


def controls(cls: Any, prefix: str, first: tuple[str, ...]) -> list[Control]:
    """A control for each field of a dataclass whose type the page can set, those of `first` first.

    The key of a control is "prefix.field".
    """
    helps, hints = field_help(cls), typing.get_type_hints(cls)
    found = []
    for field in dataclasses.fields(cls):
        kind = _kind(hints[field.name], helps.get(field.name, ""))
        if not field.init or kind is None:
            continue
        default = None if field.default is dataclasses.MISSING else field.default
        text = helps.get(field.name, "")
        control = {
            "key": f"{prefix}.{field.name}",
            "name": field.name.replace("_", " "),
            "symbol": _symbol(text),
            "help": text,
            "default": list(default) if isinstance(default, tuple) else default,
            "first": field.name in first,
            **kind,
        }
        if kind["kind"] == "number" and default is not None:
            accepts = functools.partial(_accepts, cls, field.name)
            control |= number_range(accepts, default, kind["whole"])
        found.append(control)
    order = {name: place for place, name in enumerate(first)}
    return sorted(found, key=lambda c: order.get(c["key"].partition(".")[2], len(first)))


def _symbol(text: str) -> str:
    """The symbol that an explanation opens with: "α, decay of …"; "" if it does not."""
    symbol, comma, _ = text.partition(",")
    return symbol if comma and len(symbol) <= 3 else ""


def _kind(hint: Any, text: str) -> dict[str, Any] | None:
    """How the page sets a value of this type; None if it cannot."""
    hint, optional = without_none(hint)
    if typing.get_origin(hint) is typing.Literal:
        return {"kind": "choice", "options": list(typing.get_args(hint))}
    if typing.get_origin(hint) is tuple:
        return {"kind": "row", "whole": typing.get_args(hint)[0] is int}
    if hint is bool:
        return {"kind": "switch"}
    if hint in (int, float):
        return {"kind": "number", "whole": hint is int, "optional": optional}
    words = list(dict.fromkeys(re.findall(r'"(\w+)"', text)))
    return {"kind": "choice", "options": words} if hint is str and len(words) > 1 else None


def _accepts(cls: Any, name: str, value: Any) -> bool:
    try:
        cls(**{name: value})
    except (TypeError, ValueError):
        return False
    return True


def number_range(
    accepts: Callable[[Any], bool], default: float, whole: bool
) -> dict[str, float | bool]:
    """The range of a slider, "low", "high" and whether it is logarithmic, "log"."""
    if whole:
        lowest = 0 if accepts(0) else 1
        return {"low": lowest, "high": 25 if default == 0 else max(6, 4 * default), "log": False}
    if 0.0 < default <= _SMALL:
        high = 1000.0 * default
        return {"low": default / 100.0, "high": high if accepts(high) else 1.0, "log": True}
    low = 0.0 if accepts(0.0) else 1.0 if default > 1.0 and not accepts(0.999) else default / 10.0
    fraction = default <= 1.0 and accepts(1.0) and not accepts(1.001)
    return {"low": low, "high": 1.0 if fraction else 4.0 * (default or 0.25), "log": False}
