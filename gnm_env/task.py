"""What is to be learned: the numbers of the task, and the fixed patterns that hide in the noise."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Sized
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import (
    MAX_INPUTS,
    MAX_SEED,
    MAX_TARGET,
    read_only,
    real,
    require_memory,
    shown,
    whole,
    whole_array,
)
from gnm_env.compiled import compiled

MAX_MEAN_BINS = 100_000_000
"""Longest mean trial that a Task accepts, in bins: beyond it one draw would fill the memory."""

MAX_CLASSES = 1_000_000
"""Most classes of patterns."""


_LIMITS = {
    "n_inputs": MAX_INPUTS,
    "pattern_bins": MAX_MEAN_BINS,
    "n_classes": MAX_CLASSES,
    "background_bins": MAX_MEAN_BINS,
}


@dataclass(frozen=True)
class Task:
    """The numbers that define the stream of noise and patterns; time is counted in bins.

    Raises ValueError if a field is out of range, naming the field, the value and the range.

    Attributes:
        n_inputs: N, number of input channels.
        pattern_bins: M, length of a pattern in bins.
        rate: p, probability of an input spike per channel and bin, in noise and in patterns alike.
        n_classes: C, number of patterns, each a class of its own.
        targets: output spikes owed per class, one whole number >= 0 each; 0 makes the class a
            distractor. None means (1, 2, …, C).
        background_bins: noise bins in a trial, into which the patterns are inserted.
        mean_occurrences: mean of the Poisson number of presentations per class and trial.
        onset_probability: q, probability that a pattern starts, per noise bin of the endless
            stream.
        jitter_bins: j; each spike of each presentation is moved by an integer uniform on −j … j and
            held at the pattern's first or last bin where that would carry it outside.
        deletion: probability that a spike of a presentation is dropped.
        rates: in place of `rate` one probability for each channel, say those of a recording
            (`Trials.rates`); `rate` is then their mean.
    """

    n_inputs: int = 100
    pattern_bins: int = 50
    rate: float = 0.005
    n_classes: int = 1
    targets: tuple[int, ...] | None = None
    background_bins: int = 100
    mean_occurrences: float = 2.0
    onset_probability: float = 0.01
    jitter_bins: int = 0
    deletion: float = 0.0
    rates: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        for name, high in _LIMITS.items():
            put(name, whole(name, getattr(self, name), low=1, high=high))
        put("rates", self._checked_rates())
        if self.rates is not None:
            put("rate", math.fsum(self.rates) / self.n_inputs)
        for name in ("rate", "onset_probability", "deletion"):
            put(name, real(name, getattr(self, name), low=0.0, high=1.0))
        put("mean_occurrences", real("mean_occurrences", self.mean_occurrences, low=0.0))
        put("jitter_bins", whole("jitter_bins", self.jitter_bins, low=0, high=MAX_MEAN_BINS))
        put("targets", self._checked_targets())
        mean_bins = self.background_bins + self.mean_pattern_bins
        if mean_bins > MAX_MEAN_BINS:
            raise ValueError(
                f"a trial must have at most {MAX_MEAN_BINS:,} bins on average, got "
                f"{mean_bins:,.0f}; lower background_bins, pattern_bins, n_classes or "
                "mean_occurrences"
            )

    def _checked_targets(self) -> tuple[int, ...]:
        targets = self.targets
        if targets is None:
            return tuple(range(1, self.n_classes + 1))
        if isinstance(targets, str) or not isinstance(targets, Iterable):
            raise ValueError(f"targets must be a sequence of whole numbers, got {shown(targets)}")
        given = list(itertools.islice(targets, self.n_classes + 1))  # it may be endless
        checked = tuple(
            whole(f"targets[{c}]", t, low=0, high=MAX_TARGET) for c, t in enumerate(given)
        )
        if len(checked) != self.n_classes:
            raise ValueError(
                f"targets must have one entry per class, n_classes = {self.n_classes}, "
                f"got {len(targets) if isinstance(targets, Sized) else 'another number'}"
            )
        return checked

    def _checked_rates(self) -> tuple[float, ...] | None:
        rates = self.rates
        if rates is None:
            return None
        if isinstance(rates, str) or not isinstance(rates, Iterable):
            raise ValueError(f"rates must be a sequence of probabilities, got {shown(rates)}")
        given = list(itertools.islice(rates, self.n_inputs + 1))
        if len(given) != self.n_inputs:
            raise ValueError(
                f"rates must have one entry per channel, n_inputs = {self.n_inputs}, "
                f"got {len(rates) if isinstance(rates, Sized) else 'another number'}"
            )
        return tuple(real(f"rates[{i}]", p, low=0.0, high=1.0) for i, p in enumerate(given))

    def __reduce__(self) -> tuple[Any, ...]:
        """Through the constructor, so that what is unpickled is checked."""
        return Task, tuple(getattr(self, field.name) for field in fields(Task))

    @property
    def owed(self) -> tuple[int, ...]:
        """Output spikes owed per class, shape (C,): `targets`, never None."""
        assert self.targets is not None  # set in __post_init__
        return self.targets

    @property
    def mean_pattern_bins(self) -> float:
        """Mean number of bins of a trial that belong to patterns."""
        return self.mean_occurrences * self.n_classes * self.pattern_bins

    @property
    def silent_score(self) -> float:
        """Mean noisy performance, in bins, of a neuron that never spikes: (1−q)/q + M − 1.

        It survives the noise before the first pattern and all but the last bin of that pattern.
        Holds where every class owes a spike and before any cap; infinite at q = 0.
        """
        q = self.onset_probability
        return (1.0 - q) / q + self.pattern_bins - 1 if q > 0 else float("inf")

    @staticmethod
    def from_keywords(task: Task | None, keywords: dict[str, Any]) -> Task:
        """`task`, or the Task of `keywords`; ValueError if both are given or a name is wrong."""
        names = [field.name for field in fields(Task)]
        unknown = sorted(set(keywords) - set(names))
        if unknown:
            raise ValueError(
                f"unknown keyword {unknown[0]!r}: a Task has the fields {', '.join(names)}"
            )
        if task is None:
            return Task(**keywords)
        if keywords:
            raise ValueError(
                f"give either task or its fields as keywords, got task and {', '.join(keywords)}; "
                "use dataclasses.replace(task, …) to change a field"
            )
        require_task(task)
        return task


def require_task(task: Any) -> None:
    """ValueError unless `task` is a Task."""
    if not isinstance(task, Task):
        raise ValueError(f"task must be a gnm_env.Task, got {shown(task)}")


@dataclass(frozen=True, eq=False, repr=False)
class Patterns:
    """C fixed spatio-temporal patterns. Make them with `Patterns.draw` or `Patterns.from_dense`.

    The constructor copies the arrays, and raises ValueError if they do not fit each other.

    Attributes:
        channels: int32 (events,), the channel of each spike; ascending within a bin.
        offsets: int64 (C·M + 1,); the spikes of bin m of class c are
            channels[offsets[c·M + m] : offsets[c·M + m + 1]].
        shape: (C, M, N).
    """

    channels: NDArray[np.int32]
    offsets: NDArray[np.int64]
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        def put(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        if not isinstance(self.shape, (tuple, list)) or len(self.shape) != 3:
            raise ValueError(f"shape must be (classes, bins, channels), got {shown(self.shape)}")
        limits = (MAX_CLASSES, MAX_MEAN_BINS, MAX_INPUTS)
        axes = ("classes", "bins", "channels")
        put("shape", tuple(map(whole, axes, self.shape, (1, 1, 1), limits)))
        channels, offsets = checked_events(self.channels, self.offsets, self.shape[2])
        if len(offsets) != self.shape[0] * self.shape[1] + 1:
            raise ValueError(
                f"offsets must have one entry for each of the classes · bins = "
                f"{self.shape[0] * self.shape[1]:,} bins and one more, got {len(offsets):,}"
            )
        for name, array in (("channels", channels), ("offsets", offsets)):
            put(name, read_only(array))

    def __reduce__(self) -> tuple[Any, ...]:
        """Through the constructor, so that what is unpickled is checked."""
        return Patterns, (self.channels, self.offsets, self.shape)

    @classmethod
    def draw(cls, task: Task, seed: int) -> Patterns:
        """Draw patterns of `task` at random: each bit is 1 with the probability `task.rate`.

        With `task.rates`, each channel has its own.

        The generator is default_rng((seed, 1)), so that equal seeds mean equal patterns everywhere
        and a stream with the same seed shares no bits with them.
        """
        require_task(task)
        seed = whole("pattern seed", seed, low=0, high=MAX_SEED)
        shape = (task.n_classes, task.pattern_bins, task.n_inputs)
        require_memory(
            f"drawing patterns of shape {shape}",
            9.0 * math.prod(shape),
            "lower n_classes, pattern_bins or n_inputs",
        )
        rates = task.rate if task.rates is None else np.array(task.rates)
        return cls.from_dense(np.random.default_rng((seed, 1)).random(shape) < rates)

    @classmethod
    def from_dense(cls, array: ArrayLike) -> Patterns:
        """Patterns from a binary array of shape (C, M, N); ValueError if it is anything else."""
        try:
            bits = np.asarray(array)
        except (TypeError, ValueError):
            raise ValueError("patterns must all have one shape (bins, channels)") from None
        if bits.ndim != 3 or 0 in bits.shape:
            raise ValueError(
                "patterns must have shape (classes, bins, channels) with no empty axis, "
                f"got {bits.shape}"
            )
        channels, offsets = sparse(bits.reshape(-1, bits.shape[2]), "patterns")
        return cls(channels, offsets, bits.shape)

    def dense(self) -> NDArray[np.bool_]:
        """The patterns as a new bool array of shape (C, M, N)."""
        return dense(self.channels, self.offsets, self.shape[2]).reshape(self.shape).view(np.bool_)

    def __repr__(self) -> str:
        classes, bins, channels = self.shape
        return (
            f"Patterns({classes} of {bins} bins, {channels} channels, {len(self.channels)} spikes)"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Patterns):
            return NotImplemented
        return (
            self.shape == other.shape
            and np.array_equal(self.channels, other.channels)
            and np.array_equal(self.offsets, other.offsets)
        )

    def __hash__(self) -> int:
        return hash((self.shape, self.channels.tobytes(), self.offsets.tobytes()))


def checked_events(
    channels: Any, offsets: Any, n_inputs: int
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Copies of channels and offsets that compiled code may rely on; ValueError if they are not.

    Offsets begin with 0, never fall and end with the number of channels; channels lie in
    0 … n_inputs − 1 and ascend within a bin.
    """
    spikes = whole_array("channels", channels, 0, n_inputs - 1, np.int32)
    ends = whole_array("offsets", offsets, 0, len(spikes))
    if len(ends) < 2 or ends[0] != 0 or ends[-1] != len(spikes):
        raise ValueError(
            "offsets must have one entry more than there are bins (>= 1), from 0 to the number of "
            f"channels, {len(spikes)}, got {shown(ends.tolist()[:8])}"
        )
    if np.any(np.diff(ends) < 0):
        bin_ = int(np.argmax(np.diff(ends) < 0))
        raise ValueError(f"offsets must never fall, got {ends[bin_]}, {ends[bin_ + 1]}")
    ascends = np.diff(spikes) > 0
    begins = ends[(ends > 0) & (ends < len(spikes))]
    ascends[begins - 1] = True
    if not ascends.all():
        bin_ = int(np.searchsorted(ends, int(np.argmin(ascends)), side="right")) - 1
        raise ValueError(
            "channels must ascend within a bin, "
            f"got {shown(spikes[ends[bin_] : ends[bin_ + 1]].tolist())} in bin {bin_}"
        )
    return spikes, ends


def sparse(bits: ArrayLike, name: str) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Channels and offsets per bin of a raster (bins, channels); ValueError if not binary."""
    raster = np.asarray(bits)
    # One that takes no memory itself may be spread out: np.broadcast_to, a file mapped to memory.
    require_memory(f"{name} of shape {raster.shape}", 2.0 * raster.size, "give less of it")
    if raster.dtype != np.bool_:
        numbers = np.issubdtype(raster.dtype, np.integer) or np.issubdtype(
            raster.dtype, np.floating
        )
        if not numbers or not np.isin(raster, (0, 1)).all():
            raise ValueError(f"{name} must be binary (0 and 1 only), got {raster.dtype} values")
        raster = raster != 0
    offsets = np.zeros(len(raster) + 1, np.int64)
    np.cumsum(raster.sum(axis=1), out=offsets[1:])
    return np.nonzero(raster)[1].astype(np.int32), offsets


def dense(
    channels: NDArray[Any], offsets: NDArray[Any], n_inputs: int, silent_bins: int = 0
) -> NDArray[np.int8]:
    """The raster of sparse events, int8 (bins + silent_bins, channels), as a new array."""
    bins = len(offsets) - 1 + silent_bins
    require_memory(
        f"a raster of {bins:,} bins and {n_inputs:,} channels",
        float(bins * n_inputs),
        "take fewer bins or channels",
    )
    raster = np.zeros((bins, n_inputs), np.int8)
    _scatter(channels, offsets, raster)
    return raster


@compiled
def _scatter(channels: NDArray[Any], offsets: NDArray[Any], raster: NDArray[Any]) -> None:
    for t in range(offsets.size - 1):
        for e in range(offsets[t], offsets[t + 1]):
            raster[t, channels[e]] = 1


class PatternNoise(NamedTuple):
    """Noise on the presentations of patterns; see the fields of `Task`."""

    jitter_bins: int
    deletion: float


class TaskArrays(NamedTuple):
    """Task and patterns in the form in which compiled code takes them. Made by `task_arrays`."""

    n_inputs: int
    pattern_bins: int
    background_bins: int
    n_classes: int
    noise: PatternNoise | None
    """None where patterns come as they are: code that adds it is then not even compiled."""
    mean_occurrences: float
    hazard: float
    """−ln(1−p): a unit exponential over it, rounded down, is the geometric gap between spikes."""
    onset_hazard: float
    """−ln(1−q), likewise for the noise bins before a pattern of the endless stream."""
    targets: NDArray[np.int64]
    pattern_channels: NDArray[np.int32]
    pattern_offsets: NDArray[np.int64]
    kept: NDArray[np.float64]
    """Where channels have rates of their own, (N,): each over the largest, to which `hazard`
    belongs; the share of its spikes that are kept. Else empty."""


def task_arrays(task: Task, patterns: Patterns) -> TaskArrays:
    """Task and patterns for compiled code; ValueError if they do not fit each other."""
    for name, value, kind, remedy in (
        ("task", task, Task, "use Task(…)"),
        ("patterns", patterns, Patterns, "use Patterns.from_dense(array)"),
    ):
        if not isinstance(value, kind):
            raise ValueError(
                f"{name} must be gnm_env.{kind.__name__}, got {shown(value)}; {remedy}"
            )
    expected = (task.n_classes, task.pattern_bins, task.n_inputs)
    if patterns.shape != expected:
        raise ValueError(
            f"patterns must have shape (n_classes, pattern_bins, n_inputs) = {expected} as the "
            f"task says, got {patterns.shape}"
        )
    return _task_arrays(task, patterns)


@functools.lru_cache(maxsize=64)
def _task_arrays(task: Task, patterns: Patterns) -> TaskArrays:
    # Buffers of channels, which grow by doubling, and of offsets.
    bins = task.background_bins + task.mean_pattern_bins
    require_memory(
        f"a trial of {bins:,.0f} bins on average with {task.rate * task.n_inputs:g} spikes in each",
        (8.0 * task.rate * task.n_inputs + 16.0) * bins,
        "lower background_bins, pattern_bins, mean_occurrences, n_inputs or rate",
    )
    rates = np.array([] if task.rates is None else task.rates, np.float64)
    most = task.rate if task.rates is None else max(task.rates)
    noisy = task.jitter_bins > 0 or task.deletion > 0.0
    with np.errstate(divide="ignore"):
        return TaskArrays(
            task.n_inputs,
            task.pattern_bins,
            task.background_bins,
            task.n_classes,
            PatternNoise(task.jitter_bins, task.deletion) if noisy else None,
            task.mean_occurrences,
            float(-np.log1p(-most)),
            float(-np.log1p(-task.onset_probability)),
            np.array(task.owed, np.int64),
            # Copies, which can be written to as those that pickle makes can: compiled code is made
            # anew for read-only arrays.
            patterns.channels.copy(),
            patterns.offsets.copy(),
            rates / most if most > 0.0 else rates,
        )
