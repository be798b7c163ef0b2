"""Files of trials: one npz file, compressed, without pickle, and trusted in nothing when read."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from gnm_env.checks import MAX_BINS, MAX_INPUTS, require_memory, shown, whole
from gnm_env.files import ArrayFile, ArraySpec, atomic_write, open_arrays
from gnm_env.trials_kernels import TrialsArrays, check_arrays, checked_counts, starts

FORMAT = 1
"""Version of the files that `write_trials` writes."""

_Result = TypeVar("_Result")


def write_trials(path: str | os.PathLike[str], a: TrialsArrays, known: dict[str, Any]) -> None:
    """Write the arrays, and what is `known` of them as JSON values. Atomic."""
    # Small steps, from spike to spike of a trial, pack better than bins.
    steps = np.diff(a.bins, prepend=np.int32(0))
    begins = a.first_spike[:-1][np.diff(a.first_spike) > 0]
    steps[begins] = a.bins[begins]
    narrow_steps = steps.astype(_narrowest(int(steps.max(initial=0))))
    header = {
        "kind": "trials",
        "format": FORMAT,
        "n_inputs": a.n_inputs,
        "steps": narrow_steps.dtype.name,
        "known": known,
    }
    arrays = {
        "header": np.frombuffer(json.dumps(header).encode(), np.uint8),
        "channels": a.channels.astype(_narrowest(a.n_inputs - 1)),
        "steps": narrow_steps,
        "spikes": np.diff(a.first_spike),
        "segments": np.diff(a.first_edge),
        "edges": a.edges,
        "target": a.target,
        "classes": a.classes,
        "label_only": a.label_only,
    }
    with atomic_write(path) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def read_trials(path: str | os.PathLike[str], made: Callable[..., _Result]) -> _Result:
    """What `made` makes of the arrays in a file, checked, and of what is known of them.

    Raises ValueError, in one sentence, if the file is anything else, damaged, or if `made` does.
    """
    with open_arrays(path, what="file of trials") as file:
        unknown = sorted(set(file.names) - _ARRAYS)
        if unknown:
            raise ValueError(f"it holds an array {unknown[0]!r} that does not belong there")
        header = json.loads(file.read("header", ArraySpec("u1", (None,))).tobytes())
        if not isinstance(header, dict) or header.get("kind") != "trials":
            raise ValueError("it holds no trials")
        if header["format"] != FORMAT:
            raise ValueError(f"it is of format {shown(header['format'])}, this reads {FORMAT}")
        arrays = _read_arrays(file, header)
        check_arrays(arrays)
        return made(arrays, **header["known"])


_ARRAYS = frozenset(
    (
        "header",
        "channels",
        "steps",
        "spikes",
        "segments",
        "edges",
        "target",
        "classes",
        "label_only",
    )
)
"""The arrays of a file."""


def _read_arrays(file: ArrayFile, header: dict[str, Any]) -> TrialsArrays:
    n_inputs = whole("n_inputs", header["n_inputs"], low=1, high=MAX_INPUTS)
    if header["steps"] not in ("uint8", "uint16", "uint32"):
        raise ValueError(f"its steps are of type {shown(header['steps'])}")
    row: tuple[int | None, ...] = (None,)
    channels = file.read("channels", ArraySpec(_narrowest(n_inputs - 1), row))
    steps = file.read("steps", ArraySpec(header["steps"], (len(channels),)))
    spikes = file.read("spikes", ArraySpec("i8", row))
    segments = file.read("segments", ArraySpec("i8", (len(spikes),)))
    edges = file.read("edges", ArraySpec("i8", row))
    target = file.read("target", ArraySpec("i8", (len(edges),)))
    classes = file.read("classes", ArraySpec("i8", row))
    label_only = file.read("label_only", ArraySpec("?", (len(spikes),)))
    require_memory("reading it", 24.0 * len(channels), "use a larger machine")
    if channels.max(initial=0) >= n_inputs:
        raise ValueError(f"channels must lie in 0 … {n_inputs - 1}, got {channels.max()}")
    checked_counts("spikes", spikes, len(channels))
    first_spike = starts(spikes)
    bins = np.cumsum(steps, dtype=np.int64)
    before = np.append(0, bins)[first_spike[:-1]]
    bins -= np.repeat(before, spikes)
    if bins.max(initial=0) > MAX_BINS:
        raise ValueError("a spike lies outside its bins")
    return TrialsArrays(
        n_inputs,
        channels.astype(np.int32),
        bins.astype(np.int32),
        first_spike,
        edges,
        target,
        starts(checked_counts("segments", segments, len(edges))),
        classes,
        label_only.view(np.uint8).astype(np.bool_),  # whatever a byte held, it is 0 or 1 now
    )


def _narrowest(largest: int) -> str:
    """Name of the narrowest unsigned type that holds `largest`."""
    return np.min_scalar_type(max(largest, 0)).name
