"""What environments are made from: checked once, when the keywords come in, before anything else.

Each record is frozen and checks itself. Together they say which keywords a constructor takes, with
the fields of `Task` beside them: `from_keywords` sorts the keywords, `signature` shows them.
"""

from __future__ import annotations

import difflib
import inspect
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from gnm_env.checks import shown, whole
from gnm_env.task import Patterns, Task, TaskArrays, task_arrays

RENDER_MODES = ("human", "rgb_array")

MAX_ENVS = 1_000_000
"""Most environments in one vector environment."""

NO_LIMIT = 2**30
"""Stands for an episode of any length; bins are counted in 32 bits."""

MAX_STEPS = NO_LIMIT - 1
"""Most steps after which a vector environment truncates an episode."""


@dataclass(frozen=True, kw_only=True)
class EnvParams:
    """What every environment is made from.

    Raises ValueError if a value is out of range or two do not fit each other.

    Attributes:
        task: the task; None in the arguments: that of `task_fields`.
        patterns: its patterns; None in the arguments: those of `pattern_seed`.
        pattern_seed: seed of the patterns where they are drawn, >= 0.
        render_mode: None, "human" or "rgb_array".
        task_fields: fields of a Task, in place of `task`.
    """

    task: Task | None = None
    patterns: Patterns | None = None
    pattern_seed: int = 0
    render_mode: str | None = None
    task_fields: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._put("pattern_seed", whole("pattern_seed", self.pattern_seed, low=0))
        mode = self.render_mode
        if mode is not None and not (isinstance(mode, str) and mode in RENDER_MODES):
            raise ValueError(f"render_mode must be None, 'human' or 'rgb_array', got {shown(mode)}")
        self._resolve()

    def _resolve(self) -> None:
        """Find the task and its patterns, and see that they fit each other."""
        task = Task.from_keywords(self.task, self.task_fields)
        self._put("task", task)
        if self.patterns is None:
            self._put("patterns", Patterns.draw(task, self.pattern_seed))
        task_arrays(task, self.patterns)  # type: ignore[arg-type]

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def n_inputs(self) -> int:
        """N, number of input channels."""
        assert self.task is not None
        return self.task.n_inputs

    @property
    def task_arrays(self) -> TaskArrays:
        """Task and patterns for compiled code."""
        assert self.task is not None and self.patterns is not None
        return task_arrays(self.task, self.patterns)


class HasParams:
    """What an environment tells of its arguments; none of it can be changed afterwards."""

    _params: EnvParams

    @property
    def task(self) -> Task | None:
        """The task; None where trials come from a data set."""
        return self._params.task

    @property
    def patterns(self) -> Patterns | None:
        """The task's patterns; None where trials come from a data set."""
        return self._params.patterns


@dataclass(frozen=True, kw_only=True)
class VectorParams:
    """What a vector environment is made from beside the single one's arguments; checks itself.

    Attributes:
        num_envs: number of environments, 1 … MAX_ENVS.
        max_episode_steps: steps after which an episode is truncated, 1 … MAX_STEPS; None: never.
        autoreset_mode: an `AutoresetMode` or its value.
        copy: whether each step returns an array of its own.
    """

    num_envs: int = 1
    max_episode_steps: int | None = None
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP
    copy: bool = True

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        put("num_envs", whole("num_envs", self.num_envs, low=1, high=MAX_ENVS))
        if self.max_episode_steps is not None:
            steps = whole("max_episode_steps", self.max_episode_steps, low=1, high=MAX_STEPS)
            put("max_episode_steps", steps)
        put("autoreset_mode", self._checked_mode())
        if not isinstance(self.copy, (bool, np.bool_)):
            raise ValueError(f"copy must be True or False, got {shown(self.copy)}")
        put("copy", bool(self.copy))

    def _checked_mode(self) -> AutoresetMode:
        for mode in AutoresetMode:
            if self.autoreset_mode is mode or (
                isinstance(self.autoreset_mode, str) and self.autoreset_mode == mode.value
            ):
                return mode
        options = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise ValueError(
            f"autoreset_mode must be one of {options} or a gymnasium.vector.AutoresetMode, "
            f"got {shown(self.autoreset_mode)}"
        )


def own_names(kind: type) -> list[str]:
    """Keywords that become fields of the record `kind`."""
    return [field.name for field in fields(kind) if field.name != "task_fields"]


def from_keywords(kinds: tuple[type, ...], keywords: dict[str, Any]) -> list[Any]:
    """One record of each of `kinds` from their keywords; the rest must be fields of a Task.

    The first of `kinds` is an EnvParams. Raises ValueError for a keyword that nobody knows, with
    all that are known and the nearest of them.
    """
    task_names = [field.name for field in fields(Task)]
    known = [name for kind in kinds for name in own_names(kind)]
    for name in keywords:
        if name not in known and name not in task_names:
            raise ValueError(_unknown(name, known, task_names))
    task_fields = {name: keywords[name] for name in keywords if name in task_names}
    records = []
    for kind in reversed(kinds):  # the cheap ones first
        given = {name: keywords[name] for name in own_names(kind) if name in keywords}
        if issubclass(kind, EnvParams):
            given["task_fields"] = task_fields
        records.append(kind(**given))
    return records[::-1]


def _unknown(name: str, known: list[str], task_names: list[str]) -> str:
    near = difflib.get_close_matches(str(name), known + task_names, n=1)
    hint = f", did you mean {near[0]!r}?" if near else "."
    return (
        f"unknown keyword {shown(name)}{hint} The environment takes {', '.join(known)}, and the "
        f"fields of a Task: {', '.join(task_names)}"
    )


def signature(
    *kinds: type, first: tuple[str, ...], without: tuple[str, ...] = ()
) -> inspect.Signature:
    """The signature of a constructor that takes the fields of `kinds`, those in `first` by place.

    Those in `without` are taken too, but only to say why they cannot be had. For `help()` and for
    those who complete names; the constructor itself takes keywords.
    """
    hidden = ("task_fields", *without)
    defaults = {f.name: f for kind in kinds for f in fields(kind) if f.name not in hidden}
    ordered = [*first, *(name for name in defaults if name not in first)]
    parameters = [
        inspect.Parameter(
            name,
            inspect.Parameter.POSITIONAL_OR_KEYWORD
            if name in first
            else inspect.Parameter.KEYWORD_ONLY,
            default=defaults[name].default,
            annotation=defaults[name].type,
        )
        for name in ordered
    ]
    parameters.append(inspect.Parameter("task_fields", inspect.Parameter.VAR_KEYWORD))
    return inspect.Signature(parameters)
