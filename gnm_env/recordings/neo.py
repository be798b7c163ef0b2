"""Neo: segments become trials, epochs become presentations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gnm_env.checks import shown
from gnm_env.recordings.common import (
    Label,
    Presentations,
    Spikes,
    binned_trials,
    library,
    owed,
    require_one,
    resolved_labels,
)
from gnm_env.trials import Trials


def from_neo(
    block: Any,
    *,
    bin_width: float,
    label: Label | None = None,
    targets: Mapping[str, int] | None = None,
) -> Trials:
    """Trials from a Neo Block, a Segment, or a list of Segments; needs the extra `neo`.

        block = neo.get_io("session.nix").read_block()
        trials = from_neo(block, bin_width=0.001, targets={"tone": 1, "click": 2})

    Args:
        block: each Segment is a trial, from the first `t_start` to the last `t_stop` of its spike
            trains. The k-th spike train of every segment is channel k.
        bin_width: length of a bin in seconds, whatever the units of the recording.
        label: what each trial is owed, where presentations are not known: a function of the
            Segment, the name of an annotation of segments, or one number for each.
        targets: output spikes owed by each Epoch, by its label. Epochs with other labels are left
            out. The class of a presentation is the place of its label in the dictionary.

    Raises ValueError if segments differ in their number of spike trains, if times do not fit, or if
    a label or target is no whole number >= 0; ImportError without neo.
    """
    neo = library("neo", "neo")
    segments = _segments(neo, block)
    require_one(label, targets, "epoch label")
    trains = [list(segment.spiketrains) for segment in segments]
    numbers = sorted({len(its) for its in trains})
    if len(numbers) != 1 or numbers == [0]:
        raise ValueError(
            "every segment must have the same number of spike trains, at least one, "
            f"got {shown(numbers)}"
        )
    begins = np.array([min(_seconds(train.t_start) for train in its) for its in trains])
    ends = np.array([max(_seconds(train.t_stop) for train in its) for its in trains])
    times = [
        _seconds(train) - begin for its, begin in zip(trains, begins, strict=True) for train in its
    ]
    counts = [len(train) for train in times]
    rows = np.arange(len(times))
    spikes = Spikes(
        np.repeat(rows // numbers[0], counts),
        np.repeat(rows % numbers[0], counts),
        # What rounding put before the start or beyond the end of its own spike train.
        np.clip(np.concatenate(times), 0.0, np.repeat(ends - begins, numbers[0]).repeat(counts)),
        ends - begins,
        numbers[0],
    )
    columns = {"segment": [segment.name for segment in segments]}
    if targets is None:
        assert label is not None
        labels = resolved_labels(label, segments, lambda name: _annotations(segments, name))
        return binned_trials(spikes, bin_width, labels=labels, columns=columns)
    return binned_trials(
        spikes,
        bin_width,
        presentations=_presentations(segments, begins, targets),
        n_classes=len(targets),
        columns=columns,
        metadata={"classes": list(map(str, targets))},
    )


def _segments(neo: Any, block: Any) -> list[Any]:
    if isinstance(block, neo.Block):
        segments = list(block.segments)
    elif isinstance(block, neo.Segment):
        segments = [block]
    else:
        segments = list(block) if isinstance(block, Iterable) else [block]
    if not segments or not all(isinstance(segment, neo.Segment) for segment in segments):
        raise ValueError(f"block must be a neo Block or Segments, got {shown(block)}")
    return segments


def _seconds(quantity: Any) -> Any:
    return np.asarray(quantity.rescale("s").magnitude, np.float64)


def _annotations(segments: list[Any], name: str) -> list[Any]:
    missing = [k for k, segment in enumerate(segments) if name not in segment.annotations]
    if missing:
        raise ValueError(f"segment {missing[0]} has no annotation {name!r}")
    return [segment.annotations[name] for segment in segments]


def _presentations(segments: list[Any], begins: Any, targets: Mapping[str, int]) -> Presentations:
    known = owed(targets)
    found = Presentations()
    for k, segment in enumerate(segments):
        for epoch in segment.epochs:
            onsets = _seconds(epoch) - begins[k]
            ends = onsets + _seconds(epoch.durations)
            for onset, end, name in zip(onsets, ends, epoch.labels, strict=True):
                if str(name) in known:
                    found.add(k, onset, end, *known[str(name)])
    return found
