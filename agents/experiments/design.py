"""An experiment is data: a grid of settings under a name, cut into blocks of work.

Nothing here trains. `Experiment.compute` names the function that turns one `Block` into numbers;
everything else is plain values that end up in the store as they stand.
"""

from __future__ import annotations

import itertools
import json
import math
import numbers
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import shown, whole

Setting = dict[str, Any]
"""One neuron's settings by name, such as {"neuron": "gnm", "alpha": 0.3, "pattern_seed": 4}."""


@dataclass(frozen=True)
class Axis:
    """One named dimension of the grid.

    Attributes:
        name: of the dimension, and of the setting that its values give where `settings` is empty.
        values: numbers or names, in order.
        chunk: how many values of this axis one block takes; 0 means all of them.
        settings: what each value sets, one mapping per value; empty means {name: value}.
        units: of the values; "1" for a plain number.
        long_name: what the values are.
    """

    name: str
    values: tuple[Any, ...]
    chunk: int = 1
    settings: tuple[Mapping[str, Any], ...] = ()
    units: str = "1"
    long_name: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not isinstance(self.values, tuple):
            raise ValueError(
                f"an axis needs a name and a tuple of values, got {shown(self.name)} and "
                f"{shown(self.values)}"
            )
        if not self.values:
            raise ValueError(f"axis {self.name} must have at least one value, got none")
        if not all(isinstance(value, (str, bool, numbers.Real)) for value in self.values):
            raise ValueError(
                f"axis {self.name} must have numbers or names as values, got {shown(self.values)}"
            )
        whole(f"chunk of the axis {self.name}", self.chunk, low=0)
        if not all(isinstance(setting, Mapping) for setting in self.settings):
            raise ValueError(
                f"axis {self.name} must have mappings in `settings`, got {shown(self.settings)}"
            )
        if len(set(self.values)) < len(self.values):
            raise ValueError(f"axis {self.name} must not repeat a value, got {self.values}")
        if self.settings and len(self.settings) != len(self.values):
            raise ValueError(
                f"axis {self.name} must have one mapping in `settings` per value, got "
                f"{len(self.settings)} for {len(self.values)} values"
            )

    @classmethod
    def named(
        cls, name: str, rows: Mapping[Any, Mapping[str, Any]], chunk: int = 1, long_name: str = ""
    ) -> Axis:
        """An axis of named settings."""
        return cls(name, tuple(rows), chunk, tuple(rows.values()), long_name=long_name)

    @property
    def step(self) -> int:
        """Values per block along this axis."""
        return min(self.chunk, len(self.values)) if self.chunk else len(self.values)

    def setting(self, index: int) -> Mapping[str, Any]:
        """What the value at `index` sets."""
        return self.settings[index] if self.settings else {self.name: self.values[index]}


@dataclass(frozen=True)
class Variable:
    """One array of results: the experiment's axes, followed by dimensions of its own.

    Attributes:
        name: of the array.
        dtype: NumPy's name for the type of its elements.
        units: of its elements.
        long_name: what it is.
        dims: names of the further dimensions, in order; their lengths are `Experiment.lengths`.
    """

    name: str
    dtype: str
    units: str
    long_name: str
    dims: tuple[str, ...] = ()

    @property
    def fill_value(self) -> Any:
        """What stands where nothing has been computed yet: NaN, or −1 for whole numbers."""
        return math.nan if np.dtype(self.dtype).kind == "f" else -1


@dataclass(frozen=True)
class Block:
    """One unit of work: a part of the grid, computed and stored as a whole.

    Attributes:
        number: its place in `Experiment.blocks()`.
        ranges: first and one-past-last index along each axis.
        settings: one per cell, the last axis running fastest.
        where: the part in words, for messages.
    """

    number: int
    ranges: tuple[tuple[int, int], ...]
    settings: tuple[Setting, ...]
    where: str

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells along each axis."""
        return tuple(last - first for first, last in self.ranges)

    @property
    def region(self) -> tuple[slice, ...]:
        """The block as an index into an array of results."""
        return tuple(slice(first, last) for first, last in self.ranges)

    def shaped(self, **values: Any) -> dict[str, NDArray[Any]]:
        """Arrays of results whose first axis is the cells, as `Experiment.compute` gives them."""
        return {name: np.reshape(v, (*self.shape, *np.shape(v)[1:])) for name, v in values.items()}


@dataclass(frozen=True)
class Coordinate:
    """Something worth knowing about each point of some axes, stored beside the axes' values."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    long_name: str


@dataclass(frozen=True)
class Experiment:
    """A grid of settings under a name.

    Attributes:
        name: short and unique, such as "F3".
        title: one line.
        axes: the grid.
        common: what holds in every cell unless an axis sets it.
        compute: turns a Block into {variable name: array of shape block.shape + further dims}.
        variables: what is kept.
        lengths: of the further dimensions of the variables.
        protocol: all else that decides the numbers, as plain values. It is stored, and a store
            that was made by another protocol is refused.
        coordinates: kept beside the axes' values.
    """

    name: str
    title: str
    axes: tuple[Axis, ...]
    common: Mapping[str, Any]
    compute: Callable[[Block], Mapping[str, NDArray[Any]]]
    variables: tuple[Variable, ...]
    lengths: Mapping[str, int] = field(default_factory=dict)
    protocol: Mapping[str, Any] = field(default_factory=dict)
    coordinates: tuple[Coordinate, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def cells(self) -> int:
        """Number of cells in the grid."""
        return math.prod(self.shape)

    def settings(self) -> dict[str, Any]:
        """Everything that decides the numbers, as JSON would give it back."""
        described = {
            "experiment": self.name,
            "axes": {axis.name: list(axis.values) for axis in self.axes},
            "sets": {axis.name: list(axis.settings) for axis in self.axes if axis.settings},
            "common": dict(self.common),
            "protocol": dict(self.protocol),
            "lengths": dict(self.lengths),
            "blocks": {axis.name: axis.step for axis in self.axes},
        }
        plain: dict[str, Any] = json.loads(json.dumps(described))
        return plain

    def blocks(self) -> list[Block]:
        """The units of work that make up the whole grid, in order."""
        cuts = [
            [(first, min(first + axis.step, len(axis.values)))
             for first in range(0, len(axis.values), axis.step)]
            for axis in self.axes
        ]  # fmt: skip
        return [
            Block(number, ranges, tuple(self._cells(ranges)), self._words(ranges))
            for number, ranges in enumerate(itertools.product(*cuts))
        ]

    def _cells(self, ranges: tuple[tuple[int, int], ...]) -> Iterator[Setting]:
        for cell in itertools.product(*(range(first, last) for first, last in ranges)):
            setting = dict(self.common)
            for axis, index in zip(self.axes, cell, strict=True):
                setting.update(axis.setting(index))
            yield setting

    def _words(self, ranges: tuple[tuple[int, int], ...]) -> str:
        parts = []
        for axis, (first, last) in zip(self.axes, ranges, strict=True):
            ends = axis.values[first], axis.values[last - 1]
            if last - first == 1:
                parts.append(f"{axis.name} {ends[0]}")
            elif last - first < len(axis.values):
                parts.append(f"{axis.name} {ends[0]} … {ends[1]}")
        return ", ".join(parts) or "the whole grid"
