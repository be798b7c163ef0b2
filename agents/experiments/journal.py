"""The journal of a store: which blocks are finished, line by line, each vouching for itself.

The first line describes the store, every other line one finished block with the SHA-256 of its
files. The field "check" of a line is the SHA-256 of all else in it, and the names of a block's
files have to be those of its number: one digit that has changed is noticed. (Stores of format 1,
without "check", are read too; the next opening for writing brings them to format 2.)
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DATA = "data.zarr"
JOURNAL = "journal.jsonl"
FORMAT = 2

Entry = dict[str, Any]
"""One line of the journal."""


class StoreError(ValueError):
    """A store that is damaged, in use, unfinished or made by other settings; says what to do."""


@dataclass(frozen=True)
class Journal:
    """What a store says of itself.

    Attributes:
        store: the entry that describes it; None if neither its line nor the data tell it.
        blocks: the entries of finished blocks by number.
        malformed: what is wrong with other lines, in words; none in a healthy store.
    """

    store: Entry | None
    blocks: dict[int, Entry]
    malformed: tuple[str, ...] = ()

    @property
    def known(self) -> Entry:
        """The entry that describes the store. Raises StoreError if it is lost."""
        if self.store is None:
            raise StoreError(
                f"the first line of {JOURNAL} is damaged and so is {DATA}/zarr.json, which says "
                "the same: run the sweep with --repair to compute the store again"
            )
        return self.store


def read_journal(folder: Path) -> Journal:
    """The journal of the store in `folder`. Raises StoreError if there is no store.

    A last line that was cut short is left out: its block is then not done. A first line that is
    damaged is made again from the data.
    """
    if not folder.is_dir():
        raise StoreError(f"there is no store at {folder}: run its sweep first")
    try:
        lines = (folder / JOURNAL).read_bytes().split(b"\n")[:-1]
    except OSError as error:
        raise StoreError(
            f"{folder} is not a store, it has no readable {JOURNAL} ({error.strerror}): choose "
            "another folder, or remove this one"
        ) from None
    entries = [_parsed(line) for line in lines]
    sealed = any(entry is not None and "check" in entry for entry in entries)
    store = entries[0] if entries and _describes_store(entries[0], folder, sealed) else None
    store = store or _from_data(folder)
    blocks, malformed = {}, []
    for number, entry in enumerate(entries[1:], 2):
        if store is not None and _describes_block(entry, store, sealed):
            assert entry is not None
            blocks[entry["block"]] = entry
        else:
            malformed.append(f"line {number} of {folder / JOURNAL} is damaged")
    return Journal(store, dict(sorted(blocks.items())), tuple(malformed))


def write_journal(folder: Path, entries: Iterable[Entry]) -> None:
    """Write the whole journal anew, sealed. It takes the old one's place whole, or not at all."""
    partial = folder / f"{JOURNAL}.partial"
    partial.write_text("".join(map(sealed_line, entries)), encoding="utf-8")
    partial.replace(folder / JOURNAL)


def sealed_line(entry: Entry) -> str:
    """An entry as a line that vouches for itself."""
    return json.dumps({**entry, "check": _check(entry)}) + "\n"


def store_entry(folder: Path, settings: Any, files: Sequence[str]) -> Entry:
    """The entry that describes a store: settings, number of blocks, files other than results."""
    return {
        "store": FORMAT,
        "settings": settings,
        "blocks": math.prod(_blocks_by_axis(settings)),
        "files": {path: digest(folder / DATA / path) for path in files},
    }


def damaged_files(folder: Path, entries: Iterable[Entry]) -> list[tuple[Entry, str]]:
    """Entries with the first of their files that is missing or is not what it was."""
    found = []
    for entry in entries:
        for path, expected in entry["files"].items():
            if digest(folder / DATA / path) != expected:
                found.append((entry, path))
                break
    return found


def digest(path: Path) -> str:
    """SHA-256 of a file; empty if there is none."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def _check(entry: Entry) -> str:
    rest = {key: value for key, value in entry.items() if key != "check"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def _parsed(line: bytes) -> Entry | None:
    """A line as an entry; None if it is none, or does not vouch for itself."""
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    if not isinstance(entry, dict) or not isinstance(entry.get("files"), dict):
        return None
    return entry if entry.get("check", _check(entry)) == _check(entry) else None


def _describes_store(entry: Entry | None, folder: Path, sealed: bool) -> bool:
    if entry is None or entry.get("store") not in (1, FORMAT):
        return False
    if sealed or "check" in entry:
        return "check" in entry
    # Format 1 does not vouch for itself: data that are as they were have to say the same.
    data = _from_data(folder)
    whole = data is not None and data["files"]["zarr.json"] == entry["files"].get("zarr.json")
    told = data if data is not None and whole else entry
    return all(entry.get(key) == told.get(key) for key in ("settings", "blocks"))


def _describes_block(entry: Entry | None, store: Entry, sealed: bool) -> bool:
    """Whether an entry is that of a block of this store, by its number and its files' names."""
    if entry is None or ("check" in entry) != sealed or not _has_cost(entry):
        return False
    number, counts = entry.get("block"), _blocks_by_axis(store["settings"])
    if type(number) is not int or not 0 <= number < store["blocks"]:
        return False
    place: list[str] = []
    for count in reversed(counts):
        number, index = divmod(number, count)
        place.insert(0, str(index))
    names = set()
    for path in entry["files"]:
        name, _, key = path.partition("/c/")
        parts = key.split("/")
        if parts[: len(place)] != place or set(parts[len(place) :]) - {"0"}:
            return False
        names.add(name)
    return names == _variables(store)


def _has_cost(entry: Entry) -> bool:
    numbers = all(isinstance(entry.get(key), (int, float)) for key in ("seconds", "finished"))
    return numbers and all(isinstance(entry.get(key), str) for key in ("where", "commit"))


def _blocks_by_axis(settings: Any) -> list[int]:
    steps = settings["blocks"]
    return [-(-len(values) // steps[name]) for name, values in settings["axes"].items()]


def _variables(store: Entry) -> set[str]:
    """Names of the arrays of results: of them the store's own entry has no chunks.

    Nor has it of an axis whose only value is 0, which Zarr takes for an empty chunk.
    """
    files, settings = store["files"], store["settings"]
    arrays = {path.partition("/")[0] for path in files if path.endswith("/zarr.json")}
    chunked = {path.partition("/")[0] for path in files if "/c/" in path}
    return arrays - chunked - {*settings["axes"], *settings["lengths"]}


def _from_data(folder: Path) -> Entry | None:
    """The entry that describes the store, as the data tell it; None if they are damaged too."""
    data = folder / DATA
    try:
        attributes = json.loads((data / "zarr.json").read_bytes())["attributes"]
        settings = attributes["settings"]
        coordinates = {
            *settings["axes"],
            *settings["lengths"],
            *attributes.get("coordinates", "").split(),
        }
        paths = (path.relative_to(data).as_posix() for path in data.rglob("*") if path.is_file())
        kept = [p for p in paths if "/c/" not in p or p.partition("/")[0] in coordinates]
        return store_entry(folder, settings, sorted(kept))
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None
