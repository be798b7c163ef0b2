"""Neurodata Without Borders: the units table, cut by the trials table."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from gnm_env.recordings.common import (
    Label,
    Presentations,
    binned_trials,
    cut,
    library,
    owed,
    require_one,
    resolved_labels,
)
from gnm_env.trials import Trials


def from_nwb(
    file: Any,
    *,
    bin_width: float,
    label: Label | None = None,
    targets: Mapping[Any, int] | None = None,
    presentation: tuple[str, str, str] | None = None,
) -> Trials:
    """Trials from an NWB file with a units and a trials table; needs the extra `nwb`.

        trials = from_nwb("session.nwb", bin_width=0.001, label="n_whisker_touches")
        trials = from_nwb("session.nwb", bin_width=0.001,
                          presentation=("stimulus_on", "stimulus_off", "stimulus"),
                          targets={"A": 1, "B": 2})

    Args:
        file: path of the file, or an open pynwb.NWBFile.
        bin_width: length of a bin in seconds.
        label: what each trial is owed, where presentations are not known: a function of the trial
            (a dictionary of its row), the name of a column, or one number for each trial.
        targets: output spikes owed by a presentation, by what `presentation`'s third column says.
            Trials where it says something else have no presentation. The class is the place in the
            dictionary.
        presentation: names of three columns of the trials table: when a presentation begins, when
            it ends, and what it is.

    Each unit is a channel; each row of the trials table is a trial, and its plain columns (numbers,
    text, bools) are kept as columns of the result. Raises ValueError if a table or column is
    missing, or if a label or target is no whole number >= 0; ImportError without pynwb.
    """
    pynwb = library("pynwb", "nwb")
    require_one(label, targets, "presentation")
    if isinstance(file, (str, os.PathLike)):
        try:
            io = pynwb.NWBHDF5IO(os.fspath(file), "r")
        except OSError as error:
            raise ValueError(f"{file} cannot be read as an NWB file: {error}") from None
        with io:
            return from_nwb(
                io.read(),
                bin_width=bin_width,
                label=label,
                targets=targets,
                presentation=presentation,
            )
    if not isinstance(file, pynwb.NWBFile):
        raise ValueError(f"file must be a path or a pynwb.NWBFile, got {type(file).__name__}")
    for name in ("units", "trials"):
        if getattr(file, name) is None or len(getattr(file, name)) == 0:
            raise ValueError(
                f"the NWB file has no {name}; both a units and a trials table are needed"
            )
    table = file.trials.to_dataframe()
    begins, ends = (table[name].to_numpy(np.float64) for name in ("start_time", "stop_time"))
    spikes = cut([file.units["spike_times"][i] for i in range(len(file.units))], begins, ends)
    columns = {
        str(name): table[name].tolist() for name in table if table[name].map(_is_plain).all()
    }
    metadata = {"unit": [int(i) for i in file.units.id[:]]}
    if targets is None:
        assert label is not None
        rows = table.to_dict("records")
        labels = resolved_labels(label, rows, lambda name: _column(table, name))
        return binned_trials(spikes, bin_width, labels=labels, columns=columns, metadata=metadata)
    found = _presentations(table, begins, targets, presentation)
    metadata["classes"] = list(map(str, targets))  # type: ignore[arg-type]
    return binned_trials(
        spikes,
        bin_width,
        presentations=found,
        n_classes=len(targets),
        columns=columns,
        metadata=metadata,
    )


def _is_plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float, str, np.bool_, np.integer, np.floating))


def _column(table: Any, name: str) -> Any:
    if name not in table:
        raise ValueError(f"the trials table has no column {name!r}: {', '.join(map(str, table))}")
    return table[name].tolist()


def _presentations(
    table: Any,
    begins: Any,
    targets: Mapping[Any, int],
    presentation: tuple[str, str, str] | None,
) -> Presentations:
    if presentation is None or len(presentation) != 3:
        raise ValueError(
            "give presentation, the names of three columns: begin, end and kind of a presentation"
        )
    known = owed(targets)
    found = Presentations()
    columns = (_column(table, name) for name in presentation)
    for k, (onset, end, kind) in enumerate(zip(*columns, strict=True)):
        if kind in known:
            found.add(k, onset - begins[k], end - begins[k], *known[kind])
    return found
