"""HDF5 as the Heidelberg spiking data sets have it: spikes/times, spikes/units, labels."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import real, whole
from gnm_env.files import path_of
from gnm_env.recordings.common import (
    Label,
    Spikes,
    binned_trials,
    checked_duration,
    library,
    resolved_labels,
)
from gnm_env.trials import Trials


def from_hdf5(
    path: str | os.PathLike[str],
    *,
    bin_width: float,
    label: Label = int,
    n_inputs: int | None = None,
    duration: float | None = None,
) -> Trials:
    """Trials from an HDF5 file of the layout of SHD and SSC; needs the extra `hdf5`.

        trials = from_hdf5("shd_train.h5", bin_width=0.005, label=lambda word: int(word == 7))

    Args:
        path: a file with `spikes/times` and `spikes/units` (a row of times in seconds and one of
            channels for each trial) and, unless `label` is a row of numbers, `labels`.
        bin_width: length of a bin in seconds.
        label: output spikes owed by a trial: a function of its entry in `labels` (by default that
            entry itself), the name of another array of the file, or one number for each trial.
        n_inputs: number of channels (700 in SHD); by default one more than the largest found.
        duration: length of every trial in seconds; by default up to its last spike.

    The entries of `labels` and, where it exists, of `extra/speaker` are kept as columns. Raises
    ValueError if an array is missing or does not fit; ImportError without h5py.
    """
    h5py = library("h5py", "hdf5")
    bin_width, duration = real("bin_width", bin_width, above=0.0), checked_duration(duration)
    path = path_of(path, "read")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ValueError(f"{path} cannot be read as an HDF5 file: {error}") from None
    with file:
        times = _rows(h5py, file, "spikes/times", np.float64)
        units = _rows(h5py, file, "spikes/units", np.int64)
        columns = {
            name: _array(h5py, file, key).tolist()
            for name, key in (("label", "labels"), ("speaker", "extra/speaker"))
            if key in file and len(file[key]) == len(times)
        }
        known = columns.get("label", [None] * len(times))
        if callable(label) and "label" not in columns:
            raise ValueError(
                f"{path} has no labels for its {len(times)} trials; give them as label"
            )
        labels = resolved_labels(label, known, lambda name: _array(h5py, file, name).tolist())
    counts = [len(row) for row in times]
    if not times or counts != [len(row) for row in units]:
        raise ValueError(f"{path} must have a unit for each spike time, and at least one trial")
    channel = np.concatenate(units)
    most = int(channel.max(initial=0)) + 1
    if n_inputs is not None and whole("n_inputs", n_inputs, low=1) < most:
        raise ValueError(f"n_inputs must be at least {most}, since there is a channel {most - 1}")
    if channel.min(initial=0) < 0:
        raise ValueError(f"{path} has a channel {channel.min()}: channels are numbers >= 0")
    if duration is None:
        durations = np.array([max(row.max(initial=0.0), bin_width) for row in times])
    else:
        durations = np.full(len(times), duration)
    spikes = Spikes(
        np.repeat(np.arange(len(times)), counts),
        channel,
        np.concatenate(times),
        durations,
        most if n_inputs is None else n_inputs,
    )
    return binned_trials(spikes, bin_width, labels=labels, columns=columns)


def _array(h5py: Any, file: Any, name: str) -> Any:
    if not isinstance(file.get(name), h5py.Dataset):
        raise ValueError(f"the HDF5 file has no array {name!r}")
    if file[name].ndim != 1:
        raise ValueError(
            f"{name!r} must have one entry for each trial, got the shape {file[name].shape}"
        )
    return file[name][:]


def _rows(h5py: Any, file: Any, name: str, dtype: type) -> list[NDArray[Any]]:
    try:
        rows: list[NDArray[Any]] = [np.asarray(row, dtype) for row in _array(h5py, file, name)]
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name!r} must be a row of numbers for each trial: {error}") from None
    if any(row.ndim != 1 for row in rows):
        raise ValueError(f"{name!r} must be a row of numbers for each trial, got single numbers")
    return rows
