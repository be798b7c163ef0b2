"""Spike times into time bins: sorted, at most one spike of a channel in a bin."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gnm_env.checks import MAX_BINS, MAX_INPUTS, real, require_memory, shown, whole

ROUNDING = 1e-6
"""A time this little before the end of a bin, in bins, belongs to the next one: 0.3 / 0.1 < 3."""


def times_in_bins(times: Any, bin_width: float, n_bins: int, where: str) -> NDArray[np.int64]:
    """The bin of each of `times`, from 0; ValueError, naming `where`, for those outside."""
    try:
        spikes = np.asarray(times, np.float64)
    except (TypeError, ValueError):
        raise ValueError(
            f"spike times must be a row of numbers for each channel, {where} has {shown(times)}"
        ) from None
    if spikes.ndim != 1:
        raise ValueError(
            f"spike times must be a row of numbers for each channel, {where} has "
            + (f"shape {spikes.shape}" if spikes.ndim else f"the single number {spikes}")
        )
    wrong = ~((spikes >= 0.0) & (spikes < n_bins * bin_width))
    if wrong.any():
        raise ValueError(
            f"spike times must be >= 0 and < {n_bins * bin_width:g} (n_bins = {n_bins} bins of "
            f"{bin_width:g}), {where} has {spikes[wrong][0]:g}"
        )
    bins = spikes / bin_width
    # Whole numbers are what they are where a bin is the unit.
    bins = np.floor(bins if bin_width == 1.0 else bins + ROUNDING)
    return np.minimum(bins.astype(np.int64), n_bins - 1)


def binned(
    times: Sequence[Any], n_bins: Any, bin_width: Any, n_inputs: int | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int64], int]:
    """Channels and offsets of spike times per channel, and how many spikes were merged.

    `times` holds one array for each of the `n_inputs` channels (None: as many as there are).
    O(spikes · log(spikes) + bins).
    """
    n_bins = whole("n_bins", n_bins, low=1, high=MAX_BINS)
    bin_width = real("bin_width", bin_width, above=0.0)
    require_memory(f"a trial of {n_bins:,} bins", 16.0 * n_bins, "take wider bins or cut it up")
    channels = _rows(times, n_inputs)
    bins = [
        times_in_bins(spikes, bin_width, n_bins, f"channel {i}")
        for i, spikes in enumerate(channels)
    ]
    n_spikes = sum(map(len, bins))
    warn_of_unit(channels, n_spikes, bin_width)
    of = np.repeat(np.arange(len(channels), dtype=np.int64), [len(b) for b in bins])
    cells = np.unique(np.concatenate(bins) * len(channels) + of)
    offsets = np.zeros(n_bins + 1, np.int64)
    np.cumsum(np.bincount(cells // len(channels), minlength=n_bins), out=offsets[1:])
    return (cells % len(channels)).astype(np.int32), offsets, n_spikes - len(cells)


def _rows(times: Any, n_inputs: int | None) -> list[Any]:
    if isinstance(times, (str, bytes, dict)) or not hasattr(times, "__iter__"):
        raise ValueError(f"times must hold one array per channel, got {shown(times)}")
    rows = list(times)
    if n_inputs is not None and len(rows) != n_inputs:
        raise ValueError(
            f"times must hold one array per channel, n_inputs = {n_inputs}, got {len(rows)}"
        )
    if not 1 <= len(rows) <= MAX_INPUTS:
        raise ValueError("times must hold one array per channel, got none")
    return rows


def warn_of_unit(channels: Sequence[Any], n_spikes: int, bin_width: float) -> None:
    """Warn where times look like seconds and bins were not said to be shorter than one."""
    if bin_width != 1.0 or n_spikes < 2:
        return
    latest = max((float(np.max(spikes)) for spikes in channels if len(spikes)), default=math.inf)
    if latest < 1.0:
        warnings.warn(
            f"all {n_spikes} spike times lie below 1, so all spikes fall into bin 0: "
            "give bin_width, the length of a bin in the unit of the times (0.001 for "
            "milliseconds in seconds)",
            UserWarning,
            stacklevel=4,
        )


def warn_of_merged(merged: int, stacklevel: int = 3) -> None:
    """Say once how many spikes found their channel's bin taken."""
    if merged:
        warnings.warn(
            f"{merged} {'spike falls' if merged == 1 else 'spikes fall'} into a bin in which the "
            "channel has spiked already: several count as one; take a smaller bin_width to keep "
            "them apart",
            UserWarning,
            stacklevel=stacklevel,
        )
