"""A trial: what a neuron hears between two pieces of feedback, and what it owes for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from gnm_env.batches import draw_batch, new_batch
from gnm_env.binning import binned, warn_of_merged
from gnm_env.checks import (
    MAX_BINS,
    MAX_INPUTS,
    MAX_LABEL,
    MAX_TARGET,
    generator,
    read_only,
    shown,
    whole,
    whole_array,
)
from gnm_env.compiled import compiled
from gnm_env.generators import Generators
from gnm_env.sampling import append_trial
from gnm_env.segments import TrialArrays, fill_segments, owner_of
from gnm_env.task import (
    Patterns,
    Task,
    TaskArrays,
    checked_events,
    dense,
    require_task,
    sparse,
    task_arrays,
)


class Trial:
    """One trial of T bins and K presentations, sparse. Nothing about it can be changed.

    Make one with `draw_trial`, or from your own data with `from_dense` or `from_times`. The
    constructor takes the arrays themselves, copies them, and raises ValueError if they do not fit
    each other.

    Args:
        channels: (events,), the channel of each input spike, 0 … n_inputs − 1; ascending within a
            bin.
        offsets: (T + 1,); the spikes of bin t are channels[offsets[t] : offsets[t + 1]].
        onsets: (K,), first bin of each presentation; ascending.
        classes: (K,), class of each presentation, from 0. None: all of class 0.
        targets: (K,), output spikes owed by each presentation.
        n_inputs: N, number of input channels.
        pattern_bins: M, bins of each presentation; needed unless `ends` are given.
        ends: (K,), the bin after each presentation's last.
        label: output spikes owed by the whole trial, where only that is known: no presentations.
    """

    __slots__ = ("__weakref__", "_arrays", "_classes", "_label_only", "_n_inputs", "_pattern_bins")

    _arrays: TrialArrays
    _classes: NDArray[np.int64]
    _n_inputs: int
    _pattern_bins: int | None
    _label_only: bool

    def __init__(
        self,
        channels: ArrayLike,
        offsets: ArrayLike,
        onsets: ArrayLike,
        classes: ArrayLike | None,
        targets: ArrayLike,
        n_inputs: int,
        pattern_bins: int | None = None,
        ends: ArrayLike | None = None,
        label: int | None = None,
    ) -> None:
        self._n_inputs = whole("n_inputs", n_inputs, low=1, high=MAX_INPUTS)
        spikes, starts = checked_events(channels, offsets, self._n_inputs)
        n_bins = whole("the number of bins", len(starts) - 1, low=1, high=MAX_BINS)
        if pattern_bins is not None:
            pattern_bins = whole("pattern_bins", pattern_bins, low=1, high=MAX_BINS)
        first = whole_array("onsets", onsets, 0, n_bins - 1)
        last = _ends(first, pattern_bins, ends)
        owed = whole_array("targets", targets, 0, MAX_TARGET)
        which = np.zeros(len(first), np.int64) if classes is None else classes
        self._classes = whole_array("classes", which, 0, MAX_INPUTS)
        _check_presentations(first, last, self._classes, owed, n_bins)
        self._pattern_bins = common_length(first, last, pattern_bins)
        edges = np.empty(2 * len(first) + 2, np.int64)
        target = np.empty(2 * len(first) + 1, np.int64)
        fill_segments(first, last, owed, n_bins, edges, target)
        self._label_only = label is not None and len(first) == 0
        if label is not None:
            label = whole("label", label, low=0, high=MAX_LABEL)
            if self._label_only:
                target[0] = label
        self._arrays = TrialArrays(spikes, starts, edges, target)
        if label not in (None, self.label):
            raise ValueError(
                f"label must be the sum of the targets, {self.label}, got {label}; "
                "leave it out where the presentations are known"
            )

    @classmethod
    def _trusted(
        cls,
        arrays: TrialArrays,
        classes: NDArray[np.int64],
        n_inputs: int,
        pattern_bins: int | None,
        label_only: bool = False,
    ) -> Trial:
        """A trial of arrays that nobody else holds and that are known to be right: no checks."""
        trial = object.__new__(cls)
        trial._arrays = arrays
        trial._classes = classes
        trial._n_inputs = n_inputs
        trial._pattern_bins = pattern_bins
        trial._label_only = label_only
        return trial

    def __reduce__(self) -> tuple[Any, ...]:
        """Through the constructor, so that what is unpickled is checked."""
        label = self.label if self._label_only else None
        channels, offsets = self._arrays.channels, self._arrays.offsets
        segments = (self.onsets, self._classes, self.targets)
        return Trial, (
            *(channels, offsets, *segments),
            *(self._n_inputs, self._pattern_bins, self.ends, label),
        )

    @property
    def arrays(self) -> TrialArrays:
        """The trial for compiled code, which must only read it.

        These arrays can be written to, since compiled code is made anew for read-only arrays; what
        the other properties give cannot.
        """
        return self._arrays

    @property
    def channels(self) -> NDArray[np.int32]:
        """The channel of each input spike, ascending within a bin; (events,)."""
        return read_only(self._arrays.channels)

    @property
    def offsets(self) -> NDArray[np.int64]:
        """The spikes of bin t are channels[offsets[t] : offsets[t + 1]]; (T + 1,)."""
        return read_only(self._arrays.offsets)

    @property
    def edges(self) -> NDArray[np.int64]:
        """Segment s covers the bins edges[s] … edges[s + 1] − 1; (2K + 2,), see `segments`."""
        return read_only(self._arrays.edges)

    @property
    def target(self) -> NDArray[np.int64]:
        """Output spikes owed by each segment, 0 in noise; (2K + 1,).

        Where only the label is known the one segment is owed the label.
        """
        return read_only(self._arrays.target)

    @property
    def onsets(self) -> NDArray[np.int64]:
        """First bin of each presentation, ascending; (K,)."""
        return read_only(self._arrays.edges[1:-1:2].copy())

    @property
    def ends(self) -> NDArray[np.int64]:
        """The bin after the last of each presentation; (K,)."""
        return read_only(self._arrays.edges[2::2].copy())

    @property
    def classes(self) -> NDArray[np.int64]:
        """Class of each presentation, from 0; (K,)."""
        return read_only(self._classes)

    @property
    def targets(self) -> NDArray[np.int64]:
        """Output spikes owed by each presentation; (K,)."""
        return read_only(self._arrays.target[1::2].copy())

    @property
    def n_inputs(self) -> int:
        """N, number of input channels."""
        return self._n_inputs

    @property
    def n_bins(self) -> int:
        """T, length of the trial in bins."""
        return len(self._arrays.offsets) - 1

    @property
    def pattern_bins(self) -> int | None:
        """M, bins of each presentation; None where they differ or none says."""
        return self._pattern_bins

    @property
    def label(self) -> int:
        """The aggregate label: output spikes owed by the whole trial."""
        return int(self._arrays.target.sum())

    @property
    def label_only(self) -> bool:
        """Whether only the label is known, and not where it was earned."""
        return self._label_only

    def dense(self) -> NDArray[np.bool_]:
        """The raster as a new bool array (T, N)."""
        return dense(self._arrays.channels, self._arrays.offsets, self._n_inputs).view(np.bool_)

    def owner(self) -> NDArray[np.int64]:
        """For each bin the number of the presentation that it belongs to, −1 in noise; (T,)."""
        owner: NDArray[np.int64] = owner_of(self._arrays.edges)
        return owner

    def __repr__(self) -> str:
        known = "where it was earned is not known"
        if not self._label_only:
            known = f"presentations of classes {shown(self._classes.tolist())}"
        return (
            f"Trial({self.n_bins} bins, {self._n_inputs} channels, "
            f"{len(self._arrays.channels)} spikes, label {self.label}: {known})"
        )

    @classmethod
    def from_dense(
        cls,
        raster: ArrayLike,
        onsets: ArrayLike | None = None,
        classes: ArrayLike | None = None,
        task: Task | None = None,
        *,
        ends: ArrayLike | None = None,
        lengths: ArrayLike | None = None,
        targets: ArrayLike | None = None,
        label: int | None = None,
    ) -> Trial:
        """A trial from a binary raster (T, N) and what it owes, which is said in one of three ways.

        - `onsets`, `classes` and `task`: each presentation is owed what the task says of its class.
        - `onsets` and `targets`, in place of the task; the classes may then be left out.
        - `label` alone: how many output spikes the trial is owed, but not where.

        Onsets, ends and lengths count bins; presentations may come in any order. Their lengths are
        the task's `pattern_bins` unless `ends` (the bin after each presentation's last) or
        `lengths` (one for each, or one for all) are given.

        Raises ValueError if the raster is not binary or not N wide, or if presentations overlap,
        leave the trial, or have no such class.
        """
        bits = _raster(raster, _n_inputs(task))
        channels, offsets = sparse(bits, "a raster")
        presentations = _presentations(onsets, classes, task, ends, lengths, targets, label)
        return cls(channels, offsets, n_inputs=bits.shape[1], **presentations)

    @classmethod
    def from_times(
        cls,
        times: Sequence[ArrayLike],
        n_bins: int,
        onsets: ArrayLike | None = None,
        classes: ArrayLike | None = None,
        task: Task | None = None,
        *,
        bin_width: float = 1.0,
        ends: ArrayLike | None = None,
        lengths: ArrayLike | None = None,
        targets: ArrayLike | None = None,
        label: int | None = None,
    ) -> Trial:
        """A trial of `n_bins` bins from the spike times of each channel, in any order.

        `times` holds one array per channel; `bin_width` is the length of a bin in the unit of the
        times: a spike at 0.0037 s lies in bin 3 at bin_width=0.001, one at 3.7 in bin 3 at the
        default of 1, which takes times in bins. What the trial owes is said as for `from_dense`;
        onsets, ends and lengths are bins, whatever the bin width.

        Several spikes of a channel within one bin count as one, with a warning that says how many
        did. Raises ValueError as `from_dense` does, and for times outside 0 … n_bins · bin_width.
        """
        channels, offsets, merged = binned(times, n_bins, bin_width, _n_inputs(task))
        warn_of_merged(merged)
        presentations = _presentations(onsets, classes, task, ends, lengths, targets, label)
        return cls(channels, offsets, n_inputs=len(times), **presentations)


def _n_inputs(task: Task | None) -> int | None:
    """The width that the task asks for, where one is given; ValueError if it is none."""
    if task is None:
        return None
    require_task(task)
    return task.n_inputs


def _raster(raster: ArrayLike, n_inputs: int | None) -> NDArray[Any]:
    try:
        bits = np.asarray(raster)
    except (TypeError, ValueError):
        raise ValueError("a raster must be a table of bins and channels, got ragged rows") from None
    wide = n_inputs is None or bits.shape[1:] == (n_inputs,)
    if bits.ndim != 2 or 0 in bits.shape or not wide:
        width = "n_inputs >= 1" if n_inputs is None else f"n_inputs = {n_inputs}"
        raise ValueError(f"a raster must have shape (bins >= 1, {width}), got {bits.shape}")
    return bits


def _presentations(
    onsets: ArrayLike | None,
    classes: ArrayLike | None,
    task: Task | None,
    ends: ArrayLike | None,
    lengths: ArrayLike | None,
    targets: ArrayLike | None,
    label: int | None,
) -> dict[str, Any]:
    """What a trial owes, as keywords of the constructor, which checks it; sorted by onset."""
    if onsets is None:
        if label is None or not all(x is None for x in (classes, ends, lengths, targets)):
            raise ValueError(
                "say what the trial owes: onsets with classes and a task, or onsets with targets, "
                "or label alone where the presentations are not known"
            )
        return dict(onsets=(), classes=None, targets=(), label=label)
    first = whole_array("onsets", onsets, 0, MAX_BINS)
    which, owed = _owed(classes, targets, task, len(first))
    length = None if task is None or ends is not None else task.pattern_bins
    if lengths is not None:
        if ends is not None:
            raise ValueError("give either ends or lengths, got both")
        if not hasattr(lengths, "__len__") or getattr(lengths, "shape", None) == ():
            length = whole("lengths", lengths, low=1, high=MAX_BINS)
        else:
            length = None
            ends = first + _one_each("lengths", whole_array("lengths", lengths, 1, MAX_BINS), first)
    last = _ends(first, length, ends)
    order = np.argsort(first, kind="stable")
    return dict(
        onsets=first[order],
        classes=which[order],
        targets=owed[order],
        pattern_bins=length,
        ends=last[order],
        label=label,
    )


def _owed(
    classes: ArrayLike | None, targets: ArrayLike | None, task: Task | None, n: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Class and target of each of `n` presentations; the task's targets unless they are given."""
    if (task is None) == (targets is None):
        raise ValueError(
            "say what each presentation is owed: give either task (with classes) or targets, got "
            + ("neither" if task is None else "both")
        )
    per_presentation = np.empty(n)
    if task is None:
        owed = _one_each(
            "targets", whole_array("targets", targets, 0, MAX_TARGET), per_presentation
        )
        which = np.zeros(n, np.int64) if classes is None else classes
        which = whole_array("classes", which, 0, MAX_INPUTS)
        return _one_each("classes", which, per_presentation), owed
    if classes is None:
        raise ValueError("give classes, the class of each presentation, beside onsets and task")
    which = whole_array("classes", classes, 0, task.n_classes - 1)
    return _one_each("classes", which, per_presentation), np.array(task.owed, np.int64)[which]


def _one_each(name: str, values: NDArray[np.int64], onsets: NDArray[Any]) -> NDArray[np.int64]:
    """`values` if there is one for each presentation, else ValueError."""
    if len(values) != len(onsets):
        raise ValueError(
            f"onsets and {name} must have one entry per presentation each, "
            f"got {len(onsets)} and {len(values)}"
        )
    return values


def _ends(
    onsets: NDArray[np.int64], pattern_bins: int | None, ends: ArrayLike | None
) -> NDArray[np.int64]:
    """The bin after each presentation's last, given or at a common distance from the onsets."""
    if ends is not None:
        return _one_each("ends", whole_array("ends", ends, 1, 2 * MAX_BINS), onsets)
    if pattern_bins is None and len(onsets):
        raise ValueError(
            "say how long the presentations are: give ends or lengths in bins, or a task"
        )
    return onsets + (pattern_bins or 0)


def _check_presentations(
    onsets: NDArray[np.int64],
    ends: NDArray[np.int64],
    classes: NDArray[np.int64],
    targets: NDArray[np.int64],
    n_bins: int,
) -> None:
    """ValueError unless presentations lie in the trial, in order, one behind the other."""
    _one_each("classes", classes, onsets)
    _one_each("targets", targets, onsets)
    outside = (ends > n_bins) | (ends <= onsets)
    if outside.any():
        k = int(np.argmax(outside))
        raise ValueError(
            f"every presentation must have a bin and lie within the trial's {n_bins} bins, "
            f"number {k} has onset {onsets[k]} and end {ends[k]}"
        )
    overlaps = onsets[1:] < ends[:-1]
    if overlaps.any():
        k = int(np.argmax(overlaps))
        raise ValueError(
            f"presentations must come in order and must not overlap, number {k} covers bins "
            f"{onsets[k]} … {ends[k] - 1}, number {k + 1} bins {onsets[k + 1]} … {ends[k + 1] - 1}"
        )
    if targets.sum() > MAX_LABEL:
        raise ValueError(f"targets must add up to at most {MAX_LABEL:,}, got {targets.sum():,}")


def common_length(
    onsets: NDArray[np.int64], ends: NDArray[np.int64], given: int | None
) -> int | None:
    """The length of all presentations; `given` if there is none, None where they differ."""
    if len(onsets) == 0:
        return given
    lengths = ends - onsets
    if given is not None and np.any(lengths != given):
        raise ValueError(
            f"pattern_bins must be the length of all presentations, got {given} "
            f"and lengths {shown(lengths.tolist())}; leave it out where ends are given"
        )
    return int(lengths[0]) if np.all(lengths == lengths[0]) else None


def draw_trial(task: Task, patterns: Patterns, rng: Generator) -> Trial:
    """Draw one trial of `task` with `patterns` from `rng`: O(events + bins), compiled.

    For each class c, k_c ~ Poisson(mean_occurrences) presentations, each inserted before a
    background bin chosen uniformly; T = background_bins + M·Σ k_c. The environments draw the same
    trials from the same generator.
    """
    numbers = task_arrays(task, patterns)
    batch, _, n_bins = draw_batch(generator("rng", rng), numbers, 0, 1, new_batch(512))
    channels, offsets, edges, target, classes, _, edge_of, *_ = batch
    end = edge_of[1]
    offsets = offsets[: n_bins + 1].copy()
    arrays = TrialArrays(
        channels[: offsets[-1]].copy(), offsets, edges[:end].copy(), target[: end - 1].copy()
    )
    which = classes[1 : end - 1 : 2].copy()
    return Trial._trusted(arrays, which, task.n_inputs, task.pattern_bins)


def draw_next(task: Task, numbers: TaskArrays, generators: Generators) -> Trial:
    """`draw_trial` from the first of `generators`, for a caller who keeps them: at less cost."""
    arrays, classes = _draw(generators.held, numbers)
    return Trial._trusted(arrays, classes, task.n_inputs, task.pattern_bins)


@compiled
def _draw(held: Any, task: TaskArrays) -> tuple[TrialArrays, NDArray[np.int64]]:
    """One trial and the classes of its presentations, in arrays of their own."""
    channels, offsets, onsets, classes, n_bins, n, _ = append_trial(
        held[0],
        task,
        np.empty(256, np.int32),
        np.zeros(512, np.int64),
        np.empty(8, np.int64),
        np.empty(8, np.int64),
        0,
        0,
    )
    classes, onsets = classes[:n].copy(), onsets[:n]
    edges, target = np.empty(2 * n + 2, np.int64), np.empty(2 * n + 1, np.int64)
    fill_segments(onsets, onsets + task.pattern_bins, task.targets[classes], n_bins, edges, target)
    return (
        TrialArrays(
            channels[: offsets[n_bins]].copy(), offsets[: n_bins + 1].copy(), edges, target
        ),
        classes,
    )
