"""The store: results of one experiment as an xarray Dataset in Zarr, from which nothing is lost.

A store is a folder:

    F3/data.zarr       the Dataset; one chunk of every array per block of work
    F3/journal.jsonl   one line per finished block: its files' SHA-256, seconds, host, commit
    F3.lock            held while a process writes; F3.owner says which

A block counts as done once its line is in the journal, which is after its last chunk is on disk. So
a process may be killed at any moment: what has no line is computed again, to the same values. Every
opening compares all files with their checksums.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.experiments.design import Block, Experiment
from agents.experiments.former_names import current, standing
from agents.experiments.journal import (
    DATA,
    JOURNAL,
    Entry,
    Journal,
    StoreError,
    damaged_files,
    digest,
    read_journal,
    sealed_line,
    store_entry,
    write_journal,
)
from agents.experiments.provenance import commit, software
from gnm_env.files import path_of

if TYPE_CHECKING:
    import xarray as xr


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


class Store:
    """A store that is open for writing. Made by `open_store`."""

    def __init__(self, folder: Path, experiment: Experiment, done: set[int]) -> None:
        import zarr

        self.folder = folder
        self.experiment = experiment
        self._done = done
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
                    f"block {block.number} must give {variable.name} of shape {expected}, got "
                    f"{'nothing' if array is None else array.shape}"
                )
            self._array(variable.name)[block.region] = array.astype(variable.dtype)
            path = self._chunk(block, variable.name)
            files[path] = digest(self.folder / DATA / path)
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
            journal.write(sealed_line(entry))
        self._done.add(block.number)

    def _array(self, name: str) -> Any:
        return self._group[name]

    def _chunk(self, block: Block, name: str) -> str:
        array = self._array(name)
        place = [first // axis.step for axis, (first, _) in
                 zip(self.experiment.axes, block.ranges, strict=True)]  # fmt: skip
        place += [0] * (array.ndim - len(place))
        return f"{name}/{array.metadata.encode_chunk_key(tuple(place))}"


@contextmanager
def open_store(folder: Path, experiment: Experiment, *, repair: bool = False) -> Iterator[Store]:
    """The store of `experiment` in `folder`, for this process alone; made where there is none.

    With `repair`, damaged blocks are forgotten, so that they are pending again. Raises StoreError
    if another process holds the store, if other settings made it, or if it is damaged; OSError if
    it cannot be written.
    """
    folder = standing(folder)
    with _locked(folder):
        if not folder.exists():
            _create(folder, experiment)
        journal = _readable(folder, experiment) if repair else read_journal(folder)
        _refuse_other_settings(folder, journal.known["settings"], experiment.settings())
        for leftover in (folder / DATA).rglob("*.partial"):
            leftover.unlink()
        entries = [journal.known, *journal.blocks.values()]
        damaged = damaged_files(folder, entries)
        if (damaged or journal.malformed) and not repair:
            raise StoreError(_damage_report(folder, damaged, journal.malformed))
        if damaged:
            bad = [entry for entry, _ in damaged]
            store = _laid_out_again(folder, experiment) if journal.store in bad else journal.known
            entries = [store, *(e for e in journal.blocks.values() if e not in bad)]
        write_journal(folder, [{**entries[0], "store": 2}, *entries[1:]])
        yield Store(folder, experiment, {entry["block"] for entry in entries[1:]})


def read(folder: str | os.PathLike[str], *, unfinished: bool = False) -> xr.Dataset:
    """All results of a store, in memory. Raises StoreError if there is anything amiss.

    With `unfinished` a store may lack blocks; there the numbers are NaN or −1.
    """
    import xarray as xr

    folder = standing(path_of(folder, "read"))
    journal = read_journal(folder)
    summary = _summary(journal)
    damaged = damaged_files(folder, [journal.known, *journal.blocks.values()])
    if damaged or journal.malformed:
        raise StoreError(_damage_report(folder, damaged, journal.malformed))
    if summary.done < summary.blocks and not unfinished:
        raise StoreError(
            f"{folder} is not finished: {summary.done} of {summary.blocks} blocks are there; run "
            f"the sweep {journal.known['settings']['experiment']} again to go on"
        )
    with xr.open_zarr(folder / DATA, consolidated=False, chunks=None) as dataset:
        loaded = dataset.load()
    # Names as plain strings: then xarray selects by them as by any label.
    names = {n: c.astype(object) for n, c in loaded.coords.items() if c.dtype.kind == "T"}
    loaded = loaded.assign_coords({n: c.copy(data=_current(c)) for n, c in names.items()})
    return loaded.assign_attrs(settings=current(loaded.attrs["settings"]))


def _current(names: xr.DataArray) -> NDArray[Any]:
    return np.array(current(names.to_numpy().tolist()), object).reshape(names.shape)


def summarise(folder: Path) -> Summary:
    """How far the store in `folder` is. Raises StoreError if there is none."""
    return _summary(read_journal(standing(folder)))


def _summary(journal: Journal) -> Summary:
    blocks = journal.blocks.values()
    spans = sorted((e["finished"] - e["seconds"], e["finished"]) for e in blocks)
    wall, reached = 0.0, 0.0
    for start, finish in spans:
        wall += max(0.0, finish - max(start, reached))
        reached = max(reached, finish)
    return Summary(
        done=len(blocks),
        blocks=journal.known["blocks"],
        seconds=sum(e["seconds"] for e in blocks),
        wall=wall,
        commits=tuple(sorted({e["commit"] for e in blocks})),
    )


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold `folder`'s lock. The system gives it back when the process ends, however it ends."""
    from filelock import FileLock, Timeout

    lock, owner = FileLock(f"{folder}.lock"), Path(f"{folder}.owner")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire(timeout=0)
    except Timeout:
        holder = owner.read_text("utf-8") if owner.exists() else "another process"
        raise StoreError(
            f"{folder} is in use by {holder}: wait until it has finished, or choose another store"
        ) from None
    except OSError as error:
        raise StoreError(
            f"cannot write in {folder.parent} ({error.strerror}): choose another folder"
        ) from None
    try:
        owner.write_text(f"process {os.getpid()} on {socket.gethostname()}", "utf-8")
        yield
    finally:
        owner.unlink(missing_ok=True)
        lock.release()


def _create(folder: Path, experiment: Experiment) -> None:
    """An empty store. It appears under its name whole, or not at all."""
    partial = folder.with_name(folder.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    files = _lay_out(partial / DATA, experiment)
    write_journal(partial, [store_entry(partial, experiment.settings(), files)])
    partial.rename(folder)


def _lay_out(path: Path, experiment: Experiment) -> list[str]:
    """Write attributes, coordinates and arrays without chunks; returns the names of the files."""
    import zarr

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
            fill_value=variable.fill_value,
            dimension_names=[*names, *variable.dims],
            attributes={"units": variable.units, "long_name": variable.long_name},
            # A chunk of nothing but fill values is a file too: its absence would look like damage.
            config={"write_empty_chunks": True},
        )
    return sorted(p.relative_to(path).as_posix() for p in path.rglob("*") if p.is_file())


def _coordinates(experiment: Experiment) -> xr.Dataset:
    import xarray as xr

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


def _readable(folder: Path, experiment: Experiment) -> Journal:
    """The journal of a store that is to be repaired, whatever is left of it."""
    if (folder / DATA).is_dir() and not (folder / JOURNAL).exists():
        (folder / JOURNAL).touch()
    if read_journal(folder).store is None:
        _laid_out_again(folder, experiment)
    return read_journal(folder)


def _laid_out_again(folder: Path, experiment: Experiment) -> Entry:
    """Attributes and coordinates written anew beside the chunks; the store's entry."""
    fresh = folder / f"{DATA}.partial"
    shutil.rmtree(fresh, ignore_errors=True)
    files = _lay_out(fresh, experiment)
    shutil.copytree(fresh, folder / DATA, dirs_exist_ok=True)
    shutil.rmtree(fresh)
    return store_entry(folder, experiment.settings(), files)


def _damage_report(
    folder: Path, damaged: Sequence[tuple[Entry, str]], malformed: Sequence[str]
) -> str:
    named = [*malformed] + [
        f"{path} (block {entry['block']}: {entry['where']})" if "block" in entry else path
        for entry, path in damaged
    ]
    more = f" and {len(named) - 3} more" if len(named) > 3 else ""
    return (
        f"{folder / DATA} is damaged: {'; '.join(named[:3])}{more}. Run the sweep with --repair to "
        "compute what is damaged again"
    )


def _refuse_other_settings(folder: Path, stored: Any, wanted: Any) -> None:
    difference = _difference(current(stored), current(wanted))
    if difference:
        raise StoreError(
            f"{folder} was made by other settings: {difference}. Choose another store, or remove "
            "this one"
        )


def _difference(stored: Any, wanted: Any, path: str = "") -> str:
    """The first place where two settings differ, in words; empty where they are equal."""
    if isinstance(stored, dict) and isinstance(wanted, dict):
        # An option that a later version added, and that is not used, makes no difference.
        added = [key for key, value in wanted.items() if key not in stored and value is not None]
        for key in [*stored, *added]:
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
