"""What all formats share: cutting into trials, binning, and labels by a function or by name."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.binning import ROUNDING, warn_of_merged
from gnm_env.checks import MAX_BINS, MAX_INPUTS, MAX_LABEL, real, shown, whole
from gnm_env.trials import Trials

Times = NDArray[np.float64]
Label = Callable[[Any], int] | str | Iterable[int]
"""How a trial's label is found: by a function of what the format knows of the trial, in a column of
that name, or in a row of one number for each trial."""


@dataclass
class Presentations:
    """Presentations in the order in which they were found, with times from their trial's start."""

    trial: list[int] = field(default_factory=list)
    onset: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    class_: list[int] = field(default_factory=list)
    target: list[int] = field(default_factory=list)

    def add(self, trial: int, onset: float, end: float, class_: int, target: int) -> None:
        self.trial.append(trial)
        self.onset.append(onset)
        self.end.append(end)
        self.class_.append(class_)
        self.target.append(target)


@dataclass(frozen=True)
class Spikes:
    """Spikes of n trials, in any order.

    Attributes:
        trial, channel: (events,), number of the trial and channel of each spike.
        time: (events,), from the start of its trial, in the unit of the bin width.
        durations: (n,), length of each trial in that unit.
        n_inputs: number of channels.
    """

    trial: NDArray[np.int64]
    channel: NDArray[np.int64]
    time: Times
    durations: Times
    n_inputs: int


def checked_duration(duration: Any) -> float | None:
    """The length of every trial, where one is given; ValueError if it is none."""
    return None if duration is None else real("duration", duration, above=0.0)


def binned_trials(
    spikes: Spikes,
    bin_width: float,
    *,
    labels: NDArray[np.int64] | None = None,
    presentations: Presentations | None = None,
    n_classes: int | None = None,
    columns: Mapping[str, Iterable[Any]] | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Trials:
    """Trials of spikes with times; several of a channel in one bin count as one, with a warning.

    A trial has as many bins as cover its duration. A spike right at its end is in the last bin, and
    one before its start or beyond its end is refused.
    """
    bin_width = real("bin_width", bin_width, above=0.0)
    n_inputs = whole("the number of channels", spikes.n_inputs, low=1, high=MAX_INPUTS)
    n_bins = _bins_up_to(spikes.durations, bin_width, "the duration of trial")
    if np.any(spikes.durations <= 0.0):
        k = int(np.argmax(spikes.durations <= 0.0))
        raise ValueError(f"trial {k} must last longer than 0, got {spikes.durations[k]:g}")
    time, trial = spikes.time, spikes.trial
    wrong = ~((time >= 0.0) & (time <= spikes.durations[trial]))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(
            f"spike times must lie within their trial, of duration {spikes.durations[trial[k]]:g}: "
            f"channel {spikes.channel[k]} has {time[k]:g} after the start of trial {trial[k]}"
        )
    bins = np.floor(time / bin_width + ROUNDING).astype(np.int64)
    bins = np.minimum(bins, n_bins[trial] - 1)
    whole("all bins · channels", int(n_bins.sum()) * n_inputs, low=1, high=2**62)
    first_bin = np.append(0, np.cumsum(n_bins))
    cells = np.unique((first_bin[trial] + bins) * n_inputs + spikes.channel)
    warn_of_merged(len(time) - len(cells), stacklevel=4)
    at = cells // n_inputs
    of = np.searchsorted(first_bin, at, side="right") - 1
    return Trials.from_arrays(
        n_inputs,
        n_bins,
        np.bincount(of, minlength=len(n_bins)),
        cells % n_inputs,
        at - first_bin[of],
        labels=labels,
        n_classes=n_classes,
        columns=columns,
        metadata=metadata,
        **(
            {} if presentations is None else _binned_presentations(presentations, n_bins, bin_width)
        ),
    )


def _bins_up_to(times: Times, bin_width: float, what: str) -> NDArray[np.int64]:
    """Bins that cover the time from 0 to each of `times`, one at least."""
    bins = np.ceil(np.asarray(times, np.float64) / bin_width - ROUNDING)
    wrong = ~(bins <= MAX_BINS)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"{what} {k} must be at most {MAX_BINS:,} bins, got {bins[k]:g}")
    return np.maximum(bins, 1).astype(np.int64)


def _binned_presentations(
    p: Presentations, n_bins: NDArray[np.int64], bin_width: float
) -> dict[str, Any]:
    """Keywords of `Trials.from_arrays`; a presentation covers every bin that it touches."""
    trial = np.array(p.trial, np.int64)
    onsets = np.floor(np.array(p.onset, np.float64) / bin_width + ROUNDING).astype(np.int64)
    ends = _bins_up_to(np.array(p.end, np.float64), bin_width, "the end of presentation")
    order = np.lexsort((onsets, trial))
    return dict(
        presentations=np.bincount(trial, minlength=len(n_bins)),
        onsets=onsets[order],
        ends=np.maximum(ends, onsets + 1)[order],
        targets=np.array(p.target, np.int64)[order],
        classes=np.array(p.class_, np.int64)[order],
    )


def cut(channels: Sequence[Any], begins: NDArray[Any], ends: NDArray[Any]) -> Spikes:
    """The spikes of each channel, sorted or not, that lie in each of the intervals."""
    begins, ends = np.asarray(begins, np.float64), np.asarray(ends, np.float64)
    trials, of, times = [], [], []
    for channel, spikes in enumerate(channels):
        train = np.sort(np.asarray(spikes, np.float64))
        first, last = np.searchsorted(train, begins), np.searchsorted(train, ends)
        counts = np.maximum(last - first, 0)
        trial = np.repeat(np.arange(len(begins)), counts)
        place = np.arange(len(trial)) - np.repeat(np.cumsum(counts) - counts, counts)
        trials.append(trial)
        of.append(np.full(len(trial), channel))
        times.append(train[first[trial] + place] - begins[trial])
    if not channels:
        raise ValueError("there must be at least one channel, got none")
    return Spikes(
        np.concatenate(trials),
        np.concatenate(of),
        np.concatenate(times),
        ends - begins,
        len(channels),
    )


def resolved_labels(
    label: Label, known: Sequence[Any], column: Callable[[str], Iterable[Any]]
) -> NDArray[np.int64]:
    """The label of each trial; `known` is what a function is called with, `column` finds a name."""
    values: list[Any]
    if callable(label):
        values = [_by_function(label, k, what) for k, what in enumerate(known)]
    elif isinstance(label, str):
        values = list(column(label))
    else:
        try:
            values = list(label)
        except TypeError:
            raise ValueError(
                "label must be a function, the name of a column or a number for each trial, "
                f"got {shown(label)}"
            ) from None
    if len(values) != len(known):
        raise ValueError(
            f"there must be one label for each of the {len(known)} trials, got {len(values)}"
        )
    return np.array([_whole_label(k, value) for k, value in enumerate(values)], np.int64)


def _by_function(label: Callable[[Any], Any], k: int, what: Any) -> Any:
    """The label of trial `k`, of which the function is told `what`."""
    try:
        return label(what)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"label must be a function that tells the label of a trial from what is known of it, "
            f"but of trial {k}, {shown(what)}, it says: {error}"
        ) from error


def _whole_label(k: int, value: Any) -> int:
    """A label as a whole number: tables often keep them as floats or bools."""
    if isinstance(value, (bool, np.bool_)):
        value = int(value)
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        value = int(value)
    return whole(f"the label of trial {k}", value, low=0, high=MAX_LABEL)


def owed(targets: Mapping[Any, int]) -> dict[Any, tuple[int, int]]:
    """Class and target by name, the classes in the order of the dictionary."""
    if not isinstance(targets, Mapping) or not targets:
        raise ValueError(
            "targets must be a dictionary from names of presentations to the output spikes that "
            f"they are owed, got {shown(targets)}"
        )
    return {
        name: (class_, whole(f"targets[{name!r}]", target, low=0))
        for class_, (name, target) in enumerate(targets.items())
    }


def require_one(label: Any, targets: Any, of: str) -> None:
    """ValueError unless either is given."""
    if (label is None) == (targets is None):
        raise ValueError(
            f"say what trials owe: give either label, for each trial, or targets, for each {of}, "
            + ("got neither" if label is None else "got both")
        )


def library(name: str, extra: str) -> Any:
    """The module `name`, or a sentence that says how to get it."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ImportError(
            f"this needs {name}, which is not installed: pip install 'gnm-env[{extra}]'"
        ) from None
