"""Plain text: a table with a row for each spike."""

from __future__ import annotations

import csv
import os
from typing import Any

import numpy as np

from gnm_env.checks import MAX_INPUTS, real, shown, whole
from gnm_env.files import path_of
from gnm_env.recordings.common import (
    Label,
    Spikes,
    binned_trials,
    checked_duration,
    resolved_labels,
)
from gnm_env.trials import Trials


def from_csv(
    path: str | os.PathLike[str],
    *,
    bin_width: float,
    label: Label,
    n_inputs: int | None = None,
    duration: float | None = None,
    delimiter: str = ",",
) -> Trials:
    """Trials from a table with a row for each spike; needs no other library.

        trial,channel,time,label
        0,0,0.0131,2
        0,4,0.0150,2
        1,0,0.0007,0

        trials = from_csv("spikes.csv", bin_width=0.001, label="label", n_inputs=100, duration=0.2)

    Args:
        path: a text file whose first line names the columns: `channel` and `time`, perhaps `trial`
            (without it all is one trial), perhaps others.
        bin_width: length of a bin in the unit of the times.
        label: output spikes owed by a trial: a function of its name in the column `trial`, the name
            of a column that says the same in every row of a trial, or one number for each trial,
            in the order in which they first appear.
        n_inputs: number of channels; by default as many as there are.
        duration: length of every trial; by default up to the last spike of all.

    Channels that are whole numbers are taken as they are, from 0; names are numbered in
    alphabetical order, which `metadata["channels"]` tells. Raises ValueError, naming the line, if
    anything does not fit.
    """
    bin_width, duration = real("bin_width", bin_width, above=0.0), checked_duration(duration)
    rows = _rows(path, delimiter)
    names, trial = _numbered([row.get("trial", "") for row in rows])
    channel, channel_names = _channels([row["channel"] for row in rows], n_inputs)
    time = np.array([_number(path, k, row["time"]) for k, row in enumerate(rows)])
    labels = resolved_labels(label, names, lambda name: _column(path, rows, trial, name))
    last = max(time.max(), bin_width) if duration is None else duration
    most = len(channel_names) or int(channel.max()) + 1
    spikes = Spikes(
        trial,
        channel,
        time,
        np.full(len(names), last),
        most if n_inputs is None else whole("n_inputs", n_inputs, low=most),
    )
    metadata = {"channels": channel_names} if channel_names else {}
    return binned_trials(
        spikes, bin_width, labels=labels, columns={"trial": names}, metadata=metadata
    )


def _rows(path: str | os.PathLike[str], delimiter: str) -> list[dict[str, str]]:
    if not isinstance(delimiter, str) or len(delimiter) != 1:
        raise ValueError(f"delimiter must be one character, got {shown(delimiter)}")
    try:
        file = open(path_of(path, "read"), newline="", encoding="utf-8-sig")  # noqa: SIM115
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        raise ValueError(f"{shown(path)} cannot be read as a table: {error}") from None
    try:
        with file:
            reader = csv.DictReader(file, delimiter=delimiter, skipinitialspace=True)
            found = reader.fieldnames or []
            if not {"channel", "time"} <= set(found):
                raise ValueError(
                    f"{path} must name the columns channel and time in its first line, "
                    f"got {', '.join(found)[:80] or 'nothing'}"
                )
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path} cannot be read as a table: {error}") from None
    for k, row in enumerate(rows):
        if None in row or None in row.values():
            raise ValueError(f"line {k + 2} of {path} must have {len(found)} entries")
    if not rows:
        raise ValueError(f"{path} has no spikes")
    return rows


def _numbered(names: list[str]) -> tuple[list[str], np.ndarray[Any, np.dtype[np.int64]]]:
    """Names in order of appearance, and the number of each entry's."""
    numbers: dict[str, int] = {}
    return_numbers = np.array([numbers.setdefault(name, len(numbers)) for name in names])
    return list(numbers), return_numbers


def _channels(
    entries: list[str], n_inputs: int | None
) -> tuple[np.ndarray[Any, np.dtype[np.int64]], list[str]]:
    """The channel of each spike, and the names of channels where they have names."""
    if all(entry.strip().removeprefix("-").isdecimal() for entry in entries):
        # More digits than any channel has would say nothing more.
        numbers = [whole("channel", int(entry[:20]), 0, MAX_INPUTS - 1) for entry in entries]
        return np.array(numbers, np.int64), []
    names = sorted(set(entries))
    return np.array([names.index(entry) for entry in entries], np.int64), names


def _number(path: str | os.PathLike[str], k: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"line {k + 2} of {path} must have a number as time, got {text!r}"
        ) from None


def _column(
    path: str | os.PathLike[str], rows: list[dict[str, str]], trial: Any, name: str
) -> list[Any]:
    """The entry of each trial in a column, as a number."""
    if name not in rows[0]:
        raise ValueError(f"{path} has no column {name!r}: {', '.join(rows[0])}")
    found: dict[int, str] = {}
    for k, (row, its) in enumerate(zip(rows, trial, strict=True)):
        if found.setdefault(int(its), row[name]) != row[name]:
            raise ValueError(
                f"line {k + 2} of {path} must have {found[int(its)]!r} in the column {name!r}, as "
                f"the lines before it of its trial, got {row[name]!r}"
            )
    return [_number(path, 0, text) for text in found.values()]
