"""What the end of a trial tells an agent in the standard loop, checked against what it heard."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.segments import TrialArrays, fill_segments


@dataclass(frozen=True, eq=False)
class Told:
    """Segments and label of a trial, or what is known in their place."""

    edges: NDArray[np.int64]
    target: NDArray[np.int64]
    label: float
    told: float
    """What the correction is to be, where label and segments are not known; else NaN."""

    def arrays(self, channels: NDArray[np.int32], offsets: NDArray[np.int64]) -> TrialArrays:
        """The trial as compiled code takes it."""
        return TrialArrays(channels, offsets, self.edges, self.target)


def whole_trial(n_bins: int, told: float, label: float = 0.0) -> Told:
    """One segment that is the whole trial."""
    return Told(np.array([0, n_bins], np.int64), np.zeros(1, np.int64), label, told)


def segments_told(n_bins: int, info: Mapping[str, Any], presentations: bool, rule: type) -> Told:
    """What the terminal `info` of a trial of `n_bins` bins tells; ValueError if it cannot be.

    With `presentations` their onsets, ends and targets are needed, else the label alone.
    """
    label = _whole("label", _needed(info, "label", rule))
    if not presentations:
        return whole_trial(n_bins, float("nan"), float(label))
    if info.get("label_only", False):
        raise ValueError(
            f"{rule.__name__} needs to know where the presentations were, and of this trial only "
            "the label is known: use a rule such as AggregateLabel or CriticalThreshold"
        )
    onsets = _row("onsets", _needed(info, "onsets", rule))
    owed = _row("targets", _needed(info, "targets", rule))
    if "ends" in info:
        ends = _row("ends", info["ends"])
    else:
        ends = onsets + _whole("pattern_bins", _needed(info, "pattern_bins", rule))
    if not len(onsets) == len(ends) == len(owed):
        raise ValueError(
            "onsets, ends and targets must have one entry per presentation each, "
            f"got {len(onsets)}, {len(ends)} and {len(owed)}"
        )
    edges = np.zeros(2 * len(onsets) + 2, np.int64)
    target = np.zeros(2 * len(onsets) + 1, np.int64)
    fill_segments(onsets, ends, owed, n_bins, edges, target)
    if np.any(np.diff(edges) < 0):
        raise ValueError(
            f"presentations must follow one another within the {n_bins} bins heard, got onsets "
            f"{onsets.tolist()} and ends {ends.tolist()}: an agent must hear every bin of a trial"
        )
    if np.any(owed < 0):
        raise ValueError(f"targets must be >= 0, got {owed.tolist()}")
    return Told(edges, target, float(label), float("nan"))


def _needed(info: Mapping[str, Any], key: str, rule: type) -> Any:
    if key not in info:
        raise ValueError(
            f"{rule.__name__} needs {key!r} in the terminal info, as gnm/PatternTrial-v0 gives it, "
            f"got {sorted(map(str, info))}"
        )
    return info[key]


def _whole(name: str, value: Any) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        raise ValueError(f"{name} must be a whole number, got {value!r}") from None
    if abs(number) >= 2**53:
        raise ValueError(f"{name} must be in −2**53 … 2**53, got {number}")
    return number


def _row(name: str, values: Any) -> NDArray[np.int64]:
    array = np.asarray(values)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise ValueError(f"{name} must be whole numbers in a row, got {values!r}")
    return array.astype(np.int64)
