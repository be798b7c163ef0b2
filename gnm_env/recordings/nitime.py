"""Receptor cells of a grasshopper's ear, and what they heard: a recording that comes with nitime.

Two trains of spikes, each 10 s long, of auditory receptors that hear a tone whose loudness varies
at random (up to 200 and 800 Hz); the sound's amplitude is stored beside them, 20,000
numbers a second.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import real
from gnm_env.recordings.common import Label, binned_trials, cut, library, resolved_labels
from gnm_env.trials import Trials

SAMPLE = 50e-6
"""Seconds from one value of the stored loudness to the next."""

DURATION = 10.0
"""Seconds of each recording."""

LATENCY = 0.006
"""Seconds that a spike comes after the sound that caused it: the peak of what precedes spikes."""

LOUD, SMOOTHED = 1.0, 0.003
"""A sound is loud where its mean over so many seconds exceeds that of its recording by so many
standard deviations."""


def grasshopper(
    *,
    bin_width: float = 0.001,
    window: float = 0.05,
    label: Callable[[NDArray[np.float64]], int] | Label | None = None,
) -> Trials:
    """The two recordings cut into trials of `window` seconds; needs the extra `nitime`.

    There is one channel. Only labels are known: by default how often the sound grows loud in the
    trial. `trials.delayed(…)` gives a neuron the recent past of the one channel. One receptor tells
    part of it: the number of its spikes in 50 ms correlates with that label by 0.34 in the first
    recording and by 0.12 in the second, whose sound varies too fast for it.

    Args:
        bin_width: length of a bin in seconds.
        window: length of a trial in seconds; what is left at the end of a recording is dropped.
        label: output spikes owed by a trial: a function of the loudness, LATENCY earlier (an array,
            20,000 values a second, of decibels in standard deviations from their mean), or one
            number for each trial.

    The column `recording` says from which of the two a trial is, 0 or 1, and `start` from when on.
    Raises ImportError without nitime.
    """
    window = real("window", window, low=real("bin_width", bin_width, above=0.0), high=DURATION)
    folder = Path(library("nitime", "nitime").__file__).parent / "data"
    per_recording = int(DURATION / window + 1e-6)
    starts = np.arange(per_recording) * window
    size = round(window / SAMPLE)
    parts, loudness = [], []
    for k in (1, 2):
        times = np.loadtxt(folder / f"grasshopper_spike_times{k}.txt") * 1e-6
        heard = np.loadtxt(folder / f"grasshopper_stimulus{k}.txt")[:, 1]
        heard = 20.0 * np.log10(heard)
        heard = (heard - heard.mean()) / heard.std()
        parts.append(cut([times], starts, starts + window))
        first = np.round(np.maximum(starts - LATENCY, 0.0) / SAMPLE).astype(np.int64)
        loudness += [heard[i : i + size] for i in first]
    labels = resolved_labels(times_loud if label is None else label, loudness, _no_column)
    halves = [slice(0, per_recording), slice(per_recording, None)]
    return Trials.concatenate(
        binned_trials(
            spikes,
            bin_width,
            labels=labels[half],
            columns={"recording": [k] * per_recording, "start": starts.tolist()},
        )
        for k, (spikes, half) in enumerate(zip(parts, halves, strict=True))
    )


def times_loud(loudness: NDArray[np.float64]) -> int:
    """How often the loudness rises above LOUD."""
    width = round(SMOOTHED / SAMPLE)
    smooth = np.convolve(loudness, np.full(width, 1.0 / width), "valid")
    return int(np.sum((smooth[1:] >= LOUD) & (smooth[:-1] < LOUD)))


def _no_column(name: str) -> Any:
    raise ValueError(f"label must be a function or a number for each trial, got {name!r}")
