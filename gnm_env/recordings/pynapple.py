"""Pynapple: a TsGroup of units, cut by an IntervalSet of trials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gnm_env.checks import shown
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


def from_pynapple(
    units: Any,
    trials: Any,
    *,
    bin_width: float,
    label: Label | None = None,
    presentations: Mapping[str, Any] | None = None,
    targets: Mapping[str, int] | None = None,
) -> Trials:
    """Trials from a TsGroup and an IntervalSet; needs the extra `pynapple`.

        data = pynapple.load_file("session.nwb")
        trials = from_pynapple(data["units"], data["trials"], bin_width=0.001, label="n_licks")

    Args:
        units: TsGroup; its units, in their order, are the channels.
        trials: IntervalSet; each interval is a trial. Pynapple joins intervals that overlap.
        bin_width: length of a bin in seconds.
        label: what each trial is owed, where presentations are not known: a function of the trial
            (a dictionary of start, end and metadata), the name of a metadata column, or one number
            for each trial.
        presentations: an IntervalSet for each kind of presentation, by name. Intervals that do not
            lie within a trial are left out.
        targets: output spikes owed by a presentation of each kind, by name; its class is the place
            in the dictionary.

    The metadata of the trials are kept as columns. Raises ValueError if anything does not fit;
    ImportError without pynapple.
    """
    nap = library("pynapple", "pynapple")
    require_one(label, targets, "kind of presentation")
    for name, value, kind in (("units", units, nap.TsGroup), ("trials", trials, nap.IntervalSet)):
        if not isinstance(value, kind) or len(value) == 0:
            raise ValueError(
                f"{name} must be a pynapple.{kind.__name__} that is not empty, got {shown(value)}"
            )
    begins, ends = np.asarray(trials.start), np.asarray(trials.end)
    spikes = cut([units[i].index.values for i in units.index], begins, ends)
    columns = {name: list(trials[name]) for name in trials.metadata_columns}
    if targets is None:
        assert label is not None
        known = [
            dict(start=begin, end=end, **{name: values[k] for name, values in columns.items()})
            for k, (begin, end) in enumerate(zip(begins, ends, strict=True))
        ]
        labels = resolved_labels(label, known, lambda name: _column(columns, name))
        return binned_trials(spikes, bin_width, labels=labels, columns=columns)
    return binned_trials(
        spikes,
        bin_width,
        presentations=_presentations(presentations, targets, begins, ends),
        n_classes=len(targets),
        columns=columns,
        metadata={"classes": list(map(str, targets))},
    )


def _column(columns: Mapping[str, list[Any]], name: str) -> list[Any]:
    if name not in columns:
        raise ValueError(f"trials have no metadata column {name!r}: {', '.join(columns) or 'none'}")
    return columns[name]


def _presentations(
    intervals: Mapping[str, Any] | None, targets: Mapping[str, int], begins: Any, ends: Any
) -> Presentations:
    known = owed(targets)
    given = {} if intervals is None else intervals
    if set(given) != set(known):
        raise ValueError(
            "give presentations, an IntervalSet for each name in targets, "
            f"{list(known)}, got {list(given)}"
        )
    found = Presentations()
    for name, its in given.items():
        for onset, end in zip(np.asarray(its.start), np.asarray(its.end), strict=True):
            k = int(np.searchsorted(begins, onset, side="right")) - 1
            if k >= 0 and end <= ends[k]:
                found.add(k, onset - begins[k], end - begins[k], *known[name])
    return found
