"""Events of a vision or audio sensor, as tonic gives them: arrays with x, y, p and t."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import MAX_INPUTS, real, shown, whole
from gnm_env.recordings.common import (
    Label,
    Spikes,
    binned_trials,
    checked_duration,
    resolved_labels,
)
from gnm_env.trials import Trials


def from_events(
    recordings: Iterable[NDArray[Any]],
    *,
    bin_width: float,
    label: Label,
    sensor_size: tuple[int, int, int],
    duration: float | None = None,
) -> Trials:
    """Trials from structured arrays of events, one for each trial; needs no other library.

        dataset = tonic.datasets.NMNIST(save_to="data")
        events, digits = zip(*(dataset[i] for i in range(1000)))
        trials = from_events(events, bin_width=1000, label=[int(d == 7) for d in digits],
                             sensor_size=dataset.sensor_size)

    Args:
        recordings: structured arrays with the field `t` and any of `x`, `y` and `p`.
        bin_width: length of a bin in the unit of `t`, microseconds in most data sets.
        label: output spikes owed by a trial: a function of its events, or one number for each.
        sensor_size: width, height and number of polarities, as tonic's data sets name it. Channel
            number (p · height + y) · width + x.
        duration: length of every trial in the unit of `t`; by default up to its last event. Time
            begins with the first event of each.

    Raises ValueError if events lie outside the sensor, or anything else does not fit.
    """
    bin_width, duration = real("bin_width", bin_width, above=0.0), checked_duration(duration)
    width, height, polarities = _checked_size(sensor_size)
    if not isinstance(recordings, Iterable):
        raise ValueError(
            f"recordings must be structured arrays, one for each trial, got {shown(recordings)}"
        )
    events = [_checked_events(k, events) for k, events in enumerate(recordings)]
    if not events:
        raise ValueError("there must be at least one recording, got none")
    labels = resolved_labels(label, events, _no_column)
    channels = [
        (_field(k, its, "p", polarities) * height + _field(k, its, "y", height)) * width
        + _field(k, its, "x", width)
        for k, its in enumerate(events)
    ]
    times = [its["t"].astype(np.float64) for its in events]
    times = [t - t.min() if len(t) else t for t in times]
    if duration is None:
        durations = np.array([max(t.max(initial=0.0), bin_width) for t in times])
    else:
        durations = np.full(len(times), duration)
    spikes = Spikes(
        np.repeat(np.arange(len(events)), [len(its) for its in events]),
        np.concatenate(channels),
        np.concatenate(times),
        durations,
        width * height * polarities,
    )
    return binned_trials(
        spikes, bin_width, labels=labels, metadata={"sensor_size": [width, height, polarities]}
    )


def _checked_size(sensor_size: Any) -> tuple[int, int, int]:
    if not isinstance(sensor_size, (tuple, list)) or len(sensor_size) != 3:
        raise ValueError(
            f"sensor_size must be (width, height, polarities), got {shown(sensor_size)}"
        )
    names = ("width", "height", "polarities")
    width, height, polarities = (
        whole(f"the {name} of sensor_size", size, low=1, high=MAX_INPUTS)
        for name, size in zip(names, sensor_size, strict=True)
    )
    whole("the number of channels", width * height * polarities, low=1, high=MAX_INPUTS)
    return width, height, polarities


def _checked_events(k: int, events: Any) -> NDArray[Any]:
    names = getattr(getattr(events, "dtype", None), "names", None)
    if not isinstance(events, np.ndarray) or not names or "t" not in names or events.ndim != 1:
        raise ValueError(
            f"recording {k} must be a structured array (events,) with a field t, "
            f"got {shown(events)}"
        )
    for name in {"t", "x", "y", "p"} & set(names):
        if events.dtype[name].kind not in "biuf":
            raise ValueError(
                f"recording {k} must have numbers as {name}, got {events.dtype[name]} values"
            )
    return events


def _field(k: int, events: NDArray[Any], name: str, size: int) -> NDArray[np.int64]:
    """A coordinate of each event, 0 where events have none of that name."""
    if name not in (events.dtype.names or ()):
        return np.zeros(len(events), np.int64)
    values = events[name].astype(np.int64)
    if len(values) and not (0 <= values.min() and values.max() < size):
        raise ValueError(
            f"recording {k} must have {name} in 0 … {size - 1} as sensor_size says, "
            f"got {values.min()} … {values.max()}"
        )
    return values


def _no_column(name: str) -> Iterable[Any]:
    raise ValueError(f"label must be a function or a number for each trial, got {name!r}")
