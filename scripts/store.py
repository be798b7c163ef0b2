"""The store: results of one experiment as an xarray Dataset in Zarr, from which nothing is lost.

A store is a folder:

    F3/data.zarr       the Dataset; one chunk of every array per block of work
    F3/journal.jsonl   one line per finished block: its files' SHA-256, seconds, host, commit
    F3.lock            held while a process writes

A block counts as done once its line is in the journal, which is after its last chunk is on disk. So
a process may be killed at any moment: what has no line is computed again, to the same values. Every
opening compares all files with their checksums.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray

from experiments.design import Block, Experiment
from provenance import commit, software

DATA = "data.zarr"
JOURNAL = "journal.jsonl"

Entry = dict[str, Any]
"""One line of the journal. The first describes the store itself, every other a finished block."""


class StoreError(ValueError):
    """A store that is damaged, in use, unfinished or made by other settings; says what to do."""


@dataclass(frozen=True)
class Summary:
    """How far a store is and what it cost.

    Attributes:
        done: finished blocks.
        blocks: all blocks.
        seconds: the blocks' own durations, added up.
        wall: seconds in which at least one of the blocks was at work.
        commits: of the code that computed them.
    """

    done: int
    blocks: int
    seconds: float
    wall: float
    commits: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether every block is there."""
        return self.done == self.blocks


class Store:
    """A store that is open for writing. Made by `open_store`."""

    def __init__(self, folder: Path, experiment: Experiment, entries: list[Entry]) -> None:
        self.folder = folder
        self.experiment = experiment
        self._done = {entry["block"] for entry in entries[1:]}
        self._group = zarr.open_group(str(folder / DATA), mode="r+")

    def pending(self) -> list[Block]:
        """The blocks that are still to be computed, in order."""
        return [block for block in self.experiment.blocks() if block.number not in self._done]

    def write(
        self, block: Block, values: Mapping[str, NDArray[Any]], seconds: float, host: str
    ) -> None:
        """Put a whole block on disk and enter it in the journal.

        Raises ValueError if `values` lacks a variable or one has another shape than the block.
        """
        files = {}
        for variable in self.experiment.variables:
            expected = block.shape + tuple(self.experiment.lengths[dim] for dim in variable.dims)
            array = values.get(variable.name)
            if array is None or array.shape != expected:
                raise ValueError(
                    f"block {block.number} must give {variable.name} of shape {expected}, "
                    f"got {'nothing' if array is None else array.shape}"
                )
            self._array(variable.name)[block.region] = array.astype(variable.dtype)
            path = self._chunk(block, variable.name)
            files[path] = _digest(self.folder / DATA / path)
        entry = {
            "block": block.number,
            "where": block.where,
            "seconds": round(seconds, 3),
            "finished": round(time.time(), 3),
            "host": host,
            "software": software(),
            "commit": commit(),
            "files": files,
        }
        with open(self.folder / JOURNAL, "a", encoding="utf-8") as journal:
            journal.write(json.dumps(entry) + "\n")
        self._done.add(block.number)

    def _array(self, name: str) -> Any:
        return self._group[name]

    def _chunk(self, block: Block, name: str) -> str:
        array = self._array(name)
        place = [first // axis.step for axis, (first, _) in
                 zip(self.experiment.axes, block.box, strict=True)]  # fmt: skip
        place += [0] * (array.ndim - len(place))
        return f"{name}/{array.metadata.encode_chunk_key(tuple(place))}"


@contextmanager
def open_store(folder: Path, experiment: Experiment, *, repair: bool = False) -> Iterator[Store]:
    """The store of `experiment` in `folder`, for this process alone; made where there is none.

    With `repair`, damaged blocks are forgotten, so that they are pending again. Raises StoreError
    if another process holds the store, if other settings made it, or if it is damaged; OSError if
    it cannot be written.
    """
    with _locked(folder):
        if not folder.exists():
            _create(folder, experiment)
        entries = _entries(folder)
        _refuse_other_settings(folder, entries[0]["settings"], experiment.settings())
        for leftover in (folder / DATA).rglob("*.partial"):
            leftover.unlink()
        damaged = _damaged(folder, entries)
        if damaged and not repair:
            raise StoreError(_damage_report(folder, damaged))
        if damaged:
            entries = _mended(folder, experiment, entries, damaged)
        _rewrite_journal(folder, entries)
        yield Store(folder, experiment, entries)


def read(folder: Path, *, unfinished: bool = False) -> xr.Dataset:
    """All results of a store, in memory. Raises StoreError if there is anything amiss.

    With `unfinished` a store may lack blocks; there the numbers are blank, NaN or −1.
    """
    entries = _entries(folder)
    summary = _summary(entries)
    if not summary.complete and not unfinished:
        raise StoreError(
            f"{folder} is not finished: {summary.done} of {summary.blocks} blocks are there; "
            f"run the sweep {entries[0]['settings']['experiment']} again to go on"
        )
    damaged = _damaged(folder, entries)
    if damaged:
        raise StoreError(_damage_report(folder, damaged))
    with xr.open_zarr(folder / DATA, consolidated=False, chunks=None) as dataset:
        loaded = dataset.load()
    # Names as plain strings: then xarray selects by them as by any label.
    names = {n: c.astype(object) for n, c in loaded.coords.items() if c.dtype.kind == "T"}
    return loaded.assign_coords(names)


def summarise(folder: Path) -> Summary:
    """How far the store in `folder` is. Raises StoreError if there is none."""
    return _summary(_entries(folder))


def _summary(entries: list[Entry]) -> Summary:
    blocks = entries[1:]
    spans = sorted((e["finished"] - e["seconds"], e["finished"]) for e in blocks)
    wall, reached = 0.0, 0.0
    for start, finish in spans:
        wall += max(0.0, finish - max(start, reached))
        reached = max(reached, finish)
    return Summary(
        done=len(blocks),
        blocks=entries[0]["blocks"],
        seconds=sum(e["seconds"] for e in blocks),
        wall=wall,
        commits=tuple(sorted({e["commit"] for e in blocks})),
    )


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold `folder`'s lock. The kernel gives it back when the process ends, however it ends."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        handle = open(f"{folder}.lock", "a+", encoding="utf-8")  # noqa: SIM115 (closed below)
    except OSError as error:
        raise StoreError(
            f"cannot write in {folder.parent} ({error.strerror}): choose another folder"
        ) from None
    with handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            handle.seek(0)
            owner = handle.read().strip() or "another process"
            raise StoreError(
                f"{folder} is in use by {owner}: wait until it has finished, or choose another "
                "store"
            ) from None
        handle.truncate(0)
        handle.write(f"process {os.getpid()} on {socket.gethostname()}\n")
        handle.flush()
        yield


def _create(folder: Path, experiment: Experiment) -> None:
    """An empty store. It appears under its name whole, or not at all."""
    partial = folder.with_name(folder.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    _lay_out(partial / DATA, experiment)
    _rewrite_journal(partial, [_first_entry(partial, experiment)])
    partial.rename(folder)


def _lay_out(path: Path, experiment: Experiment) -> None:
    """Write attributes, coordinates and arrays without chunks."""
    attributes = {
        "title": experiment.title,
        "settings": experiment.settings(),
        "software": software(),
        "commit": commit(),
    }
    _coordinates(experiment).assign_attrs(attributes).to_zarr(path, mode="w", consolidated=False)
    group = zarr.open_group(str(path), mode="r+")
    names = [axis.name for axis in experiment.axes]
    steps = [axis.step for axis in experiment.axes]
    for variable in experiment.variables:
        further = [experiment.lengths[dim] for dim in variable.dims]
        group.create_array(
            variable.name,
            shape=(*experiment.shape, *further),
            chunks=(*steps, *further),
            dtype=variable.dtype,
            fill_value=variable.blank,
            dimension_names=[*names, *variable.dims],
            attributes={"units": variable.units, "long_name": variable.long_name},
            # A chunk of nothing but blanks is a file too: its absence would look like damage.
            config={"write_empty_chunks": True},
        )


def _coordinates(experiment: Experiment) -> xr.Dataset:
    coordinates: dict[str, Any] = {
        axis.name: (
            axis.name,
            _labels(axis.values),
            {"units": axis.units, "long_name": axis.long_name},
        )
        for axis in experiment.axes
    }
    for name, length in experiment.lengths.items():
        coordinates[name] = (name, np.arange(length), {"units": "1"})
    for extra in experiment.coordinates:
        coordinates[extra.name] = (extra.dims, extra.values, {"long_name": extra.long_name})
    return xr.Dataset(coords=coordinates)


def _labels(values: tuple[Any, ...]) -> NDArray[Any]:
    """Values as an array whose type Zarr's specification knows; it knows no fixed-length text."""
    array = np.array(values)
    return array.astype(np.dtypes.StringDType()) if array.dtype.kind == "U" else array


def _first_entry(folder: Path, experiment: Experiment) -> Entry:
    paths = sorted(path for path in (folder / DATA).rglob("*") if path.is_file())
    return {
        "store": 1,
        "settings": experiment.settings(),
        "blocks": len(experiment.blocks()),
        "files": {path.relative_to(folder / DATA).as_posix(): _digest(path) for path in paths},
    }


def _entries(folder: Path) -> list[Entry]:
    """The journal. A line that was cut short is left out: its block is then not done."""
    if not folder.is_dir():
        raise StoreError(f"there is no store at {folder}: run its sweep first")
    try:
        lines = (folder / JOURNAL).read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        raise StoreError(
            f"{folder} is not a store, it has no {JOURNAL}: choose another folder, or remove "
            "this one"
        ) from None
    entries = [entry for entry in map(_parsed, lines) if entry is not None]
    if not entries or "store" not in entries[0]:
        raise StoreError(
            f"the first line of {folder / JOURNAL} is damaged, so that the store's settings are "
            "not "
            f"known: remove {folder} and run its sweep again"
        )
    blocks = {entry["block"]: entry for entry in entries[1:]}
    return [entries[0], *(blocks[number] for number in sorted(blocks))]


def _parsed(line: str) -> Entry | None:
    try:
        entry = json.loads(line)
    except json.JSONDecodeError:
        return None
    known = isinstance(entry, dict) and "files" in entry and ("block" in entry or "store" in entry)
    return entry if known else None


def _rewrite_journal(folder: Path, entries: list[Entry]) -> None:
    partial = folder / f"{JOURNAL}.partial"
    partial.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")
    partial.replace(folder / JOURNAL)


def _damaged(folder: Path, entries: list[Entry]) -> list[tuple[Entry, str]]:
    """Entries with the first of their files that is missing or is not what it was."""
    found = []
    for entry in entries:
        for path, digest in entry["files"].items():
            if _digest(folder / DATA / path) != digest:
                found.append((entry, path))
                break
    return found


def _damage_report(folder: Path, damaged: list[tuple[Entry, str]]) -> str:
    named = [
        f"{path} (block {entry['block']}: {entry['where']})" if "block" in entry else path
        for entry, path in damaged[:3]
    ]
    more = f" and {len(damaged) - 3} more" if len(damaged) > 3 else ""
    return (
        f"{folder / DATA} is damaged: {'; '.join(named)}{more}. "
        "Run the sweep with --repair to compute what is damaged again"
    )


def _mended(
    folder: Path, experiment: Experiment, entries: list[Entry], damaged: list[tuple[Entry, str]]
) -> list[Entry]:
    """The journal without the damaged blocks; attributes and coordinates anew if need be."""
    bad = [entry for entry, _ in damaged]
    kept = [entry for entry in entries[1:] if entry not in bad]
    first = entries[0]
    if first in bad:
        fresh = folder / f"{DATA}.partial"
        shutil.rmtree(fresh, ignore_errors=True)
        _lay_out(fresh, experiment)
        shutil.copytree(fresh, folder / DATA, dirs_exist_ok=True)
        shutil.rmtree(fresh)
        first = {
            **first,
            "files": {path: _digest(folder / DATA / path) for path in first["files"]},
        }
    return [first, *kept]


def _digest(path: Path) -> str:
    """SHA-256 of a file; empty if there is none."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""


def _refuse_other_settings(folder: Path, stored: Any, wanted: Any) -> None:
    difference = _difference(stored, wanted)
    if difference:
        raise StoreError(
            f"{folder} was made by other settings: {difference}. "
            "Choose another store, or remove this one"
        )


def _difference(stored: Any, wanted: Any, path: str = "") -> str:
    """The first place where two settings differ, in words; empty where they are equal."""
    if isinstance(stored, dict) and isinstance(wanted, dict):
        for key in [*stored, *(key for key in wanted if key not in stored)]:
            inner = _difference(
                stored.get(key, "nothing"), wanted.get(key, "nothing"), f"{path}.{key}".lstrip(".")
            )
            if inner:
                return inner
        return ""
    return "" if stored == wanted else f"{path} is {_short(stored)} there and {_short(wanted)} here"


def _short(value: Any) -> str:
    if isinstance(value, list) and len(value) > 6:
        return f"{len(value)} values from {value[0]} to {value[-1]}"
    return json.dumps(value, ensure_ascii=False)
