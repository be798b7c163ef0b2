"""All that a link of the page says, checked; and the agent, task and patterns that follow from it.

A link holds what differs from the defaults: `?neuron=gnm&n.alpha=0.1&r.learning_rate=0.001&seed=3`.
The fields of the neuron are called n.…, those of the rule r.…, those of the task t.…
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from agents import registry
from agents.commands.fields import without_none
from agents.experiments.models import default_rule, new_agent
from gnm_env import Patterns, Task
from gnm_env.checks import MAX_SEED

TRIALS = 60_000
MOST_TRIALS = 10_000_000
NONE = "none"
"""How a link says None."""

_OWN = ("neuron", "rule", "trials", "seed", "pattern_seed", "initial_weight", "bounds", "mute",
        "shown")  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """What is trained, on what, and which trial of it is shown.

    Attributes:
        model, rule, task: the neuron or network, its rule, what it hears.
        trials: number of trials that it learns from.
        seed: of the stream and of the initial weights.
        pattern_seed: of the patterns.
        initial_weight: upper end of the initial weights; None: the model's own.
        weight_bounds: lowest and highest weight; None: unbounded.
        mute: whether the label is kept from it: its rule is never heard.
        shown: seed of the trial that is shown.
    """

    model: Any
    rule: Any
    task: Task
    trials: int = TRIALS
    seed: int = 0
    pattern_seed: int = 0
    initial_weight: float | None = None
    weight_bounds: tuple[float, float] | None = (0.0, 1.0)
    mute: bool = False
    shown: int = 7

    def patterns(self) -> Patterns:
        """The hidden patterns."""
        return Patterns.draw(self.task, self.pattern_seed)

    def agent(self) -> Any:
        """The agent before its first trial. ValueError if its parts do not go together."""
        rule = dataclasses.replace(self.rule, learning_rate=0.0) if self.mute else self.rule
        return new_agent(
            self.model, rule, self.task.n_inputs, self.seed, self.initial_weight,
            weight_bounds=self.weight_bounds,
        )  # fmt: skip


def parse(link: Mapping[str, str]) -> Settings:
    """The settings of a link. ValueError, in a sentence, for whatever it does not mean."""
    model_class = registry.find_model(link.get("neuron", "gnm"))
    if "weight_bounds" in link:
        raise ValueError("the bounds of the weights are called bounds: bounds=0,1 or bounds=none")
    rule_class = registry.find_rule(link.get("rule", default_rule(model_class)))
    parts = {"n": model_class, "r": rule_class, "t": Task}
    given: dict[str, dict[str, Any]] = {prefix: {} for prefix in parts}
    for key, text in link.items():
        prefix, dot, name = key.partition(".")
        if dot and prefix in parts:
            given[prefix][name] = _field_value(parts[prefix], key, name, text)
        elif key not in _OWN:
            raise ValueError(f"unknown setting {key!r}; known: {', '.join(_OWN)}, n.…, r.…, t.…")
    model, rule, task = (parts[prefix](**given[prefix]) for prefix in parts)
    initial = link.get("initial_weight", NONE)
    return Settings(
        model, rule, task,
        _whole(link, "trials", TRIALS, 1, MOST_TRIALS),
        _whole(link, "seed", 0, 0, MAX_SEED),
        _whole(link, "pattern_seed", 0, 0, MAX_SEED),
        None if initial == NONE else _number("initial_weight", initial),
        _bounds(link.get("bounds"), model),
        _whole(link, "mute", 0, 0, 1) == 1,
        _whole(link, "shown", 7, 0, MAX_SEED),
    )  # fmt: skip


def _field_value(cls: Any, key: str, name: str, text: str) -> Any:
    """The value of a field of a dataclass, from the words of a link."""
    hints = typing.get_type_hints(cls)
    if name not in {field.name for field in dataclasses.fields(cls)}:
        raise ValueError(f"{cls.__name__} has no field {name!r}, got the setting {key}")
    hint, optional = without_none(hints[name])
    if optional and text == NONE:
        return None
    if typing.get_origin(hint) is tuple:
        kind = typing.get_args(hint)[0]
        return tuple(_as(kind, key, word) for word in text.replace(",", " ").split())
    return _as(hint, key, text)


def _as(kind: Any, key: str, text: str) -> Any:
    if kind is bool:
        if text not in ("0", "1"):
            raise ValueError(f"{key} must be 0 or 1, got {text!r}")
        return text == "1"
    if kind is int:
        return int(_whole({key: text}, key, 0, -(10**18), 10**18))
    return _number(key, text) if kind is float else text


def _number(key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{key} must be a number, got {text!r}") from None


def _whole(link: Mapping[str, str], key: str, default: int, low: int, high: int) -> int:
    text = link.get(key, str(default))
    try:
        value = int(text)
    except ValueError:
        raise ValueError(f"{key} must be a whole number, got {text!r}") from None
    if not low <= value <= high:
        raise ValueError(f"{key} must be in {low:,} … {high:,}, got {value:,}")
    return value


def _bounds(text: str | None, model: Any) -> tuple[float, float] | None:
    """Weight bounds; without any in the link, those that `gnm train` would take."""
    if text is None:
        free = model.kind == "network" or getattr(model, "readout", "V") == "D"
        return None if free else (0.0, 1.0)
    if text == NONE:
        return None
    words = text.split(",")
    if len(words) != 2:
        raise ValueError(f'bounds must be two numbers, as in bounds=0,1, or "none", got {text!r}')
    low, high = (_number("bounds", word) for word in words)
    return low, high
