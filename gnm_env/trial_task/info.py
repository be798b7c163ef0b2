"""What is told at the end of a trial: the keys of the terminal `info`, for one and for many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.trial import Trial


def terminal_info(
    label: Any, emitted: Any, onsets: Any, classes: Any, targets: Any, pattern_bins: Any
) -> dict[str, Any]:
    """The keys of the terminal `info`; the contract with every agent.

    In a single environment each is a number or a list with one entry per presentation, in a vector
    environment an array over environments, of numbers or of lists.

    Args:
        label, emitted: output owed by the whole trial, and given.
        onsets, classes, targets: first bin, class from 0, and output owed of each presentation.
        pattern_bins: bins of each presentation; 0 where they differ.
    """
    return {
        "label": label,
        "emitted": emitted,
        "onsets": onsets,
        "classes": classes,
        "targets": targets,
        "pattern_bins": pattern_bins,
    }


_MASKS = [f"_{key}" for key in terminal_info(*range(6))]


def info_of(trial: Trial, emitted: float) -> dict[str, Any]:
    """The terminal `info` of one trial.

    `ends`, the bin after the last of each presentation, is there where they differ in length, and
    `label_only`, True, where only the label is known.
    """
    edges, target = trial.arrays.edges, trial.arrays.target
    info = terminal_info(
        trial.label,
        emitted,
        edges[1:-1:2].tolist(),
        trial.classes.tolist(),
        target[1::2].tolist(),
        trial.pattern_bins or 0,
    )
    if trial.pattern_bins is None and info["onsets"]:
        info["ends"] = edges[2::2].tolist()
    if trial.label_only:
        info["label_only"] = True
    return info


def masked(info: dict[str, Any], mask: NDArray[np.bool_]) -> dict[str, Any]:
    """The terminal `info` of many environments, in those of `mask`, as Gymnasium has it."""
    for key in _MASKS:
        info[key] = mask
    return info
