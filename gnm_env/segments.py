"""A trial as a list of segments: noise, presentation, noise, … , noise.

K presentations make 2K + 1 segments. `edges` (2K + 2) holds the first bin of each segment and the
end of the last; `target` (2K + 1) the output spikes that each segment is owed: 0 in noise. Segments
with even numbers are noise, some of them empty; those with odd numbers are presentations. Counts of
output spikes, the error trace, dense feedback, the survival rule and the question of who owns a bin
all follow from this one list.

Where only the label of a trial is known and not where it was earned, there is one segment, the
whole trial, and it is owed the label. So the label is the sum of `target` in every trial.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gnm_env.compiled import compiled, inlined


class TrialArrays(NamedTuple):
    """One trial as compiled code takes it: who spikes in which bin, and the segments."""

    channels: NDArray[np.int32]
    """The channel of each input spike; ascending within a bin."""
    offsets: NDArray[np.int64]
    """(T + 1,); the spikes of bin t are channels[offsets[t] : offsets[t + 1]]."""
    edges: NDArray[np.int64]
    """(2K + 2,); segment s covers the bins edges[s] … edges[s + 1] − 1."""
    target: NDArray[np.int64]
    """(2K + 1,), output spikes owed by each segment."""


@compiled
def fill_segments(
    onsets: NDArray[np.int64],
    ends: NDArray[np.int64],
    owed: NDArray[np.int64],
    n_bins: int,
    edges: NDArray[np.int64],
    target: NDArray[np.int64],
) -> None:
    """Write the segments of a trial with presentations from `onsets` up to `ends`, (K,) each.

    `edges` has room for 2K + 2 numbers, `target` for 2K + 1.
    """
    n = onsets.size
    edges[0] = 0
    target[0] = 0
    for k in range(n):
        edges[2 * k + 1] = onsets[k]
        edges[2 * k + 2] = ends[k]
        target[2 * k + 1] = owed[k]
        target[2 * k + 2] = 0
    edges[2 * n + 1] = n_bins


@compiled
def owner_of(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each bin the number of the presentation that it belongs to, −1 in noise; (T,)."""
    owner = np.full(edges[edges.size - 1], -1, np.int64)
    for k in range((edges.size - 2) // 2):
        for t in range(edges[2 * k + 1], edges[2 * k + 2]):
            owner[t] = k
    return owner


def segment_at(edges: Any, segment: int, bin_: int) -> int:
    """The segment that bin `bin_` lies in: `segment`, or one after it. Empty ones hold no bin."""
    while edges[segment + 1] <= bin_:
        segment += 1
    return segment


compiled_segment_at = inlined(segment_at)
