"""Checkpoints: one file, no pickle, written whole or not at all.

A checkpoint is a zip of plain arrays (NumPy's npz) with a JSON header beside them. Each kind of
agent registers itself with `register_kind`, so that `load_checkpoint` opens any of them.
"""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.files import atomic_write as atomic_write
from gnm_env.task import Patterns, Task, task_arrays

FORMAT = 1
_HEADER = "header"
_KINDS: dict[str, type] = {}
_HOMES = {
    "neuron": "agents.neuron_agent",
    "continuous": "agents.continuous",
    "network": "agents.network",
}
"""Where the kinds of this package register themselves: imported when such a file is loaded."""
_BIT_GENERATORS = {
    cls.__name__: cls
    for cls in (
        np.random.MT19937,
        np.random.PCG64,
        np.random.PCG64DXSM,
        np.random.Philox,
        np.random.SFC64,
    )
}
_Class = TypeVar("_Class", bound=type)
_Agent = TypeVar("_Agent")


@dataclass(frozen=True)
class Checkpoint:
    """What a checkpoint holds beside the agent: the task that it was trained on, and how far.

    Attributes:
        agent: the agent, ready to go on.
        task: its task, if it was saved with one.
        patterns: its patterns, likewise.
        rng: the generator of its stream, as it stood when it was saved.
    """

    agent: Any
    task: Task | None = None
    patterns: Patterns | None = None
    rng: Generator | None = None


def register_kind(kind: str) -> Callable[[_Class], _Class]:
    """Class decorator: checkpoints of this kind are loaded by the class's `from_checkpoint`."""

    def register(cls: _Class) -> _Class:
        _KINDS[kind] = cls
        return cls

    return register


def write(
    path: str | os.PathLike[str],
    kind: str,
    header: dict[str, Any],
    arrays: dict[str, NDArray[Any]],
    *,
    task: Task | None = None,
    patterns: Patterns | None = None,
    rng: Generator | None = None,
) -> None:
    """Write a checkpoint; `header` must be JSON, infinities and all. Atomic."""
    full_header = {"format": FORMAT, "kind": kind, **header}
    contents = dict(arrays)
    if task is not None:
        full_header["task"] = asdict(task)
    if patterns is not None:
        contents["patterns"] = np.packbits(patterns.dense())
        full_header["patterns_shape"] = patterns.shape
    if rng is not None:
        full_header["rng"] = rng.bit_generator.state
    text = json.dumps(full_header, default=_plain).encode()
    with atomic_write(path) as file:
        np.savez(file, allow_pickle=False, **{_HEADER: np.frombuffer(text, np.uint8)}, **contents)


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, as JSON knows them."""
    return value.tolist()


def read(path: str | os.PathLike[str]) -> tuple[str, dict[str, Any], dict[str, NDArray[Any]]]:
    """Kind, header and arrays of a checkpoint; ValueError if it is none or is damaged."""
    try:
        # Opened here, since np.load forgets to close what turns out to be no zip.
        with open(path, "rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays.pop(_HEADER).tobytes())
        if header["format"] != FORMAT:
            raise ValueError(f"format {header['format']}")
        return header["kind"], header, arrays
    except FileNotFoundError:
        raise ValueError(f"there is no checkpoint {path}; give the path of a saved agent") from None
    except Exception as error:
        raise ValueError(
            f"{path} is not a readable checkpoint ({type(error).__name__}: {error}); "
            "it is damaged or of another kind: train and save again"
        ) from None


def load_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Load an agent of any kind with all that was saved beside it; ValueError if it is damaged."""
    kind, header, arrays = read(path)
    if kind not in _KINDS and kind in _HOMES:
        importlib.import_module(_HOMES[kind])
    if kind not in _KINDS:
        known = ", ".join(sorted({*_KINDS, *_HOMES}))
        raise ValueError(f"{path} holds an agent of kind {kind!r}; known kinds: {known}")
    try:
        task = Task(**header["task"]) if "task" in header else None
        patterns = None
        if "patterns_shape" in header:
            shape = tuple(header["patterns_shape"])
            bits = np.unpackbits(arrays.pop("patterns"), count=int(np.prod(shape)))
            patterns = Patterns.from_dense(bits.reshape(shape))
        if task is not None and patterns is not None:
            task_arrays(task, patterns)  # they must fit each other
        agent = _KINDS[kind].from_checkpoint(header, arrays)  # type: ignore[attr-defined]
        return Checkpoint(agent, task, patterns, _generator(header.get("rng")))
    except (LookupError, TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{path} is not a valid {kind} checkpoint: {error}") from None


def load_agent(path: str | os.PathLike[str], cls: type[_Agent]) -> _Agent:
    """The agent of a checkpoint; ValueError if it is damaged, or its agent no `cls`."""
    agent = load_checkpoint(path).agent
    if not isinstance(agent, cls):
        raise ValueError(
            f"{path} holds a {type(agent).__name__}, not a {cls.__name__}; "
            "use agents.load_checkpoint for checkpoints of any kind"
        )
    return agent


def _generator(state: dict[str, Any] | None) -> Generator | None:
    if state is None:
        return None
    bit_generator: Any = _BIT_GENERATORS[state["bit_generator"]]()
    bit_generator.state = state
    return Generator(bit_generator)
