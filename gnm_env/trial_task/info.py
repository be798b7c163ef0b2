"""What is told at the end of a trial: the keys of the terminal `info`, for one and for many."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.trial import Trial


class TerminalInfo(NamedTuple):
    """`info` at the end of a trial, and at no other time: each field is a key.

    In a single environment each is a number or a list, in a vector environment an array over
    environments, of numbers or of lists.
    """

    label: Any
    """Output owed by the whole trial."""
    emitted: Any
    """Output given."""
    onsets: Any
    """First bin of each presentation."""
    classes: Any
    """Class of each presentation, from 0."""
    targets: Any
    """Output owed by each presentation."""
    ends: Any
    """The bin after the last of each presentation."""
    pattern_bins: Any
    """Bins of each presentation; 0 where they differ, or where there is none to tell."""


def info_of(trial: Trial, emitted: float) -> dict[str, Any]:
    """The terminal `info` of one trial."""
    told = TerminalInfo(
        label=trial.label,
        emitted=emitted,
        onsets=trial.onsets.tolist(),
        classes=trial.classes.tolist(),
        targets=trial.targets.tolist(),
        ends=trial.ends.tolist(),
        pattern_bins=trial.pattern_bins or 0,
    )
    info = told._asdict()
    if trial.label_only:
        info["label_only"] = True
    return info


def masked(
    told: TerminalInfo, mask: NDArray[np.bool_], label_only: NDArray[np.bool_]
) -> dict[str, Any]:
    """The terminal `info` of many environments, in those of `mask`, as Gymnasium has it."""
    info: dict[str, Any] = {}
    for key, value in zip(told._fields, told, strict=True):
        info[key], info[f"_{key}"] = value, mask
    if label_only.any():
        info["label_only"], info["_label_only"] = label_only.copy(), label_only.copy()
    return info
