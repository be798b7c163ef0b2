"""What the end of a trial tells an agent in the standard loop, checked against what it heard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import MAX_BINS, MAX_LABEL, MAX_TARGET, shown, whole, whole_array
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

    With `presentations` their onsets, ends and targets are needed, else the label alone: it may
    then be any that a user wants, below 0 too; presentations that are there must still be possible.
    """
    least = 0 if presentations else -MAX_LABEL
    label = whole("label", _needed(info, "label", rule), low=least, high=MAX_LABEL)
    if presentations and info.get("label_only", False):
        raise ValueError(
            f"{rule.__name__} needs to know where the presentations were, and of this trial only "
            "the label is known: use a rule such as AggregateLabel or CriticalThreshold"
        )
    if presentations:
        for key in ("onsets", "targets") + (() if "ends" in info else ("pattern_bins",)):
            _needed(info, key, rule)
    told = _segments(n_bins, info, label)
    if not presentations or told is None:
        return whole_trial(n_bins, float("nan"), float(label))
    if len(info["onsets"]) and told.target.sum() != label:
        raise ValueError(
            f"label must be the sum of the targets, {told.target.sum()}, got {label}: "
            "give the terminal info of the trial that was heard"
        )
    return told


def _segments(n_bins: int, info: Mapping[str, Any], label: int) -> Told | None:
    """The segments of a trial of `n_bins` bins; None if `info` does not tell them.

    Raises ValueError for presentations that cannot be those of such a trial.
    """
    if "onsets" not in info or not ("ends" in info or "pattern_bins" in info):
        return None
    onsets = whole_array("onsets", info["onsets"], 0, MAX_BINS)
    if "ends" in info:
        ends = whole_array("ends", info["ends"], 0, MAX_BINS)
    else:
        least = min(len(onsets), 1)  # without presentations it may be anything
        ends = onsets + whole("pattern_bins", info["pattern_bins"], low=least, high=MAX_BINS)
    if "targets" in info:
        owed = whole_array("targets", info["targets"], 0, MAX_TARGET)
    else:
        owed = np.zeros(len(onsets), np.int64)
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
            f"{shown(onsets.tolist())} and ends {shown(ends.tolist())}: an agent must hear every "
            "bin of a trial"
        )
    return Told(edges, target, float(label), float("nan"))


def _needed(info: Mapping[str, Any], key: str, rule: type) -> Any:
    if key not in info:
        raise ValueError(
            f"{rule.__name__} needs {key!r} in the terminal info, as gnm/PatternTrial-v0 gives it, "
            f"got {sorted(map(str, info))}"
        )
    return info[key]
