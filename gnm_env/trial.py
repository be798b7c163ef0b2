"""A trial: what a neuron hears between two pieces of feedback, and what it owes for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import whole
from gnm_env.compiled import compiled
from gnm_env.generators import Generators
from gnm_env.sampling import append_trial
from gnm_env.task import Patterns, Task, TaskArrays, dense, sparse, task_arrays


@dataclass(frozen=True, eq=False)
class Trial:
    """One trial of T bins and K occurrences, sparse. All arrays are read-only.

    Make one with `draw_trial`, or from your own data with `from_dense` or `from_times`.

    Attributes:
        channels: int32 (events,), the channel of each input spike; ascending within a bin.
        offsets: int64 (T + 1,); the spikes of bin t are channels[offsets[t] : offsets[t + 1]].
        onsets: int64 (K,), first bin of each occurrence, ascending.
        classes: int64 (K,), class of each occurrence, from 0.
        targets: int64 (K,), output spikes owed by each occurrence.
        n_inputs: N, number of input channels.
        pattern_bins: M, bins of each occurrence.
    """

    channels: NDArray[np.int32]
    offsets: NDArray[np.int64]
    onsets: NDArray[np.int64]
    classes: NDArray[np.int64]
    targets: NDArray[np.int64]
    n_inputs: int
    pattern_bins: int

    def __post_init__(self) -> None:
        for array in (self.channels, self.offsets, self.onsets, self.classes, self.targets):
            array.setflags(write=False)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Unpickled arrays can be written to until told otherwise."""
        self.__dict__.update(state)
        self.__post_init__()

    @property
    def n_bins(self) -> int:
        """T, length of the trial in bins."""
        return len(self.offsets) - 1

    @property
    def label(self) -> int:
        """The aggregate label: output spikes owed by the whole trial."""
        return int(self.targets.sum())

    def dense(self) -> NDArray[np.bool_]:
        """The raster as a new bool array (T, N)."""
        return dense(self.channels, self.offsets, self.n_inputs).view(np.bool_)

    def owner(self) -> NDArray[np.int64]:
        """For each bin the number of the occurrence that it belongs to, −1 in noise; (T,)."""
        owner = np.full(self.n_bins, -1, np.int64)
        for k, onset in enumerate(self.onsets):
            owner[onset : onset + self.pattern_bins] = k
        return owner

    @classmethod
    def from_dense(
        cls, raster: ArrayLike, onsets: ArrayLike, classes: ArrayLike, task: Task
    ) -> Trial:
        """A trial from a binary raster (T, N) and the first bin and class of each occurrence.

        Raises ValueError if the raster is not binary or not N wide, or if occurrences overlap,
        leave the trial, or have no such class.
        """
        bits = np.asarray(raster)
        if bits.ndim != 2 or bits.shape[1] != task.n_inputs or len(bits) == 0:
            raise ValueError(
                f"a raster must have shape (bins >= 1, n_inputs = {task.n_inputs}), "
                f"got {bits.shape}"
            )
        channels, offsets = sparse(bits, "a raster")
        return cls._with_occurrences(channels, offsets, onsets, classes, task)

    @classmethod
    def from_times(
        cls,
        times: Sequence[ArrayLike],
        n_bins: int,
        onsets: ArrayLike,
        classes: ArrayLike,
        task: Task,
    ) -> Trial:
        """A trial of `n_bins` bins from the spike times of each channel, in bins.

        `times` holds one array per channel; a spike at time 3.7 lies in bin 3, and several spikes
        of a channel within one bin count as one. Raises ValueError as `from_dense` does, and for
        times outside 0 … n_bins.
        """
        n_bins = whole("n_bins", n_bins, low=1)
        if len(times) != task.n_inputs:
            raise ValueError(
                f"times must hold one array per channel, n_inputs = {task.n_inputs}, "
                f"got {len(times)}"
            )
        raster = np.zeros((n_bins, task.n_inputs), np.bool_)
        for channel, spikes in enumerate(times):
            bins = np.floor(np.asarray(spikes, np.float64))
            if not np.all((bins >= 0) & (bins < n_bins)):
                raise ValueError(
                    f"spike times must lie in 0 … {n_bins} (n_bins), channel {channel} has others"
                )
            raster[bins.astype(np.int64), channel] = True
        return cls.from_dense(raster, onsets, classes, task)

    @classmethod
    def _with_occurrences(
        cls,
        channels: NDArray[np.int32],
        offsets: NDArray[np.int64],
        onsets: ArrayLike,
        classes: ArrayLike,
        task: Task,
    ) -> Trial:
        first, which = _whole_array("onsets", onsets), _whole_array("classes", classes)
        if len(first) != len(which):
            raise ValueError(
                f"onsets and classes must have one entry per occurrence each, "
                f"got {len(first)} and {len(which)}"
            )
        if not np.all((which >= 0) & (which < task.n_classes)):
            raise ValueError(
                f"classes must lie in 0 … {task.n_classes - 1} (n_classes = {task.n_classes}), "
                f"got {which.tolist()}"
            )
        order = np.argsort(first, kind="stable")
        first, which = first[order], which[order]
        last_onset = len(offsets) - 1 - task.pattern_bins
        if not np.all((first >= 0) & (first <= last_onset)):
            raise ValueError(
                f"every occurrence must lie within the trial: onsets in 0 … {last_onset}, "
                f"got {first.tolist()}"
            )
        if np.any(np.diff(first) < task.pattern_bins):
            raise ValueError(
                f"occurrences must not overlap: onsets at least pattern_bins = "
                f"{task.pattern_bins} apart, got {first.tolist()}"
            )
        targets = np.array(task.owed, np.int64)[which]
        return cls(channels, offsets, first, which, targets, task.n_inputs, task.pattern_bins)


def _whole_array(name: str, values: ArrayLike) -> NDArray[np.int64]:
    array = np.atleast_1d(np.asarray(values))
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must be whole numbers, got {array.dtype} values")
    return array.astype(np.int64).ravel()


def draw_trial(task: Task, patterns: Patterns, rng: Generator) -> Trial:
    """Draw one trial of `task` with `patterns` from `rng`: O(events + bins), compiled.

    For each class c, k_c ~ Poisson(mean_occurrences) occurrences, each inserted before a background
    bin chosen uniformly; T = background_bins + M·Σ k_c. The environments draw the same trials from
    the same generator.
    """
    return draw_next(task, task_arrays(task, patterns), Generators([rng]))


def draw_next(task: Task, numbers: TaskArrays, generators: Generators) -> Trial:
    """`draw_trial` from the first of `generators`, for a caller who keeps them: at less cost."""
    channels, offsets, onsets, classes, targets = _draw(generators.held, numbers)
    return Trial(channels, offsets, onsets, classes, targets, task.n_inputs, task.pattern_bins)


@compiled
def _draw(
    held: Any, task: TaskArrays
) -> tuple[
    NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]
]:
    """Channels, offsets, onsets, classes and targets of one trial, in arrays of their own."""
    channels, offsets, onsets, classes, n_bins, n_occurrences, _ = append_trial(
        held[0],
        task,
        np.empty(256, np.int32),
        np.zeros(512, np.int64),
        np.empty(8, np.int64),
        np.empty(8, np.int64),
        0,
        0,
    )
    classes = classes[:n_occurrences].copy()
    return (
        channels[: offsets[n_bins]].copy(),
        offsets[: n_bins + 1].copy(),
        onsets[:n_occurrences].copy(),
        classes,
        task.targets[classes],
    )
