"""A data set of trials: recorded, made or labelled, as good as a task to draw them from."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, overload

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import (
    MAX_BINS,
    MAX_INPUTS,
    MAX_LABEL,
    MAX_SEED,
    MAX_TARGET,
    real,
    require_memory,
    shown,
    whole,
    whole_array,
)
from gnm_env.generators import Generators
from gnm_env.segments import TrialArrays
from gnm_env.task import Patterns, Task, task_arrays
from gnm_env.trial import Trial, common_length
from gnm_env.trials_file import read_trials, write_trials
from gnm_env.trials_kernels import (
    MAX_TRIALS,
    TrialsArrays,
    bins_of,
    check_arrays,
    checked_counts,
    delayed,
    draw,
    lay_out,
    one_trial,
    segments_of,
    starts,
    take,
)

__all__ = ["Trials", "TrialsArrays", "lay_out"]


class Trials:
    """Trials that share their channels, in memory proportional to their spikes. Unchangeable.

    A number as index gives a `Trial`; a slice, a mask or an array of numbers gives Trials.

    Args:
        trials: at least one Trial, all with the same number of channels.
        n_classes: number of classes; by default one more than the largest class.
        columns: what is known of each trial, by name: rows of one JSON value for each trial, which
            go along when trials are selected.
        metadata: what is known of all of them, as JSON values.

    Raises ValueError if the trials do not fit each other, or what is known is not JSON.
    """

    __slots__ = ("__weakref__", "_arrays", "_columns", "_metadata", "_n_classes", "_pattern_bins")

    _arrays: TrialsArrays
    _n_classes: int
    _pattern_bins: int | None
    _columns: dict[str, tuple[Any, ...]]
    _metadata: dict[str, Any]

    def __init__(
        self,
        trials: Iterable[Trial],
        *,
        n_classes: int | None = None,
        columns: Mapping[str, Iterable[Any]] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> None:
        held = _checked_list(trials)
        first_spike = starts(np.array([len(trial.arrays.channels) for trial in held]))
        first_edge = starts(np.array([len(trial.arrays.edges) for trial in held]))
        bins, target = np.empty(first_spike[-1], np.int32), np.zeros(first_edge[-1], np.int64)
        for i, trial in enumerate(held):
            bins_of(trial.arrays.offsets, bins[first_spike[i] : first_spike[i + 1]])
            target[first_edge[i] : first_edge[i + 1] - 1] = trial.arrays.target
        arrays = TrialsArrays(
            held[0].n_inputs,
            np.concatenate([trial.arrays.channels for trial in held]),
            bins,
            first_spike,
            np.concatenate([trial.arrays.edges for trial in held]),
            target,
            first_edge,
            np.concatenate([trial.classes for trial in held]),
            np.array([trial.label_only for trial in held]),
        )
        lengths = {trial.pattern_bins for trial in held}
        self._set(arrays, n_classes, lengths.pop() if len(lengths) == 1 else None)
        self._tell(columns, metadata)

    def _set(self, arrays: TrialsArrays, n_classes: int | None, pattern_bins: int | None) -> None:
        least = int(arrays.classes.max(initial=-1)) + 1
        self._arrays = arrays
        self._pattern_bins = pattern_bins
        self._n_classes = least
        self._columns, self._metadata = {}, {}
        if n_classes is not None:
            self._n_classes = whole("n_classes", n_classes, low=0, high=MAX_INPUTS + 1)
            if self._n_classes < least:
                raise ValueError(
                    f"n_classes must be more than the largest class, {least - 1}, got {n_classes}"
                )

    def _tell(
        self, columns: Mapping[str, Iterable[Any]] | None, metadata: Mapping[str, Any] | None
    ) -> None:
        for name, value in (("columns", columns), ("metadata", metadata)):
            if not isinstance(value, Mapping | None):
                raise ValueError(f"{name} must be a dictionary, got {shown(value)}")
        self._metadata = _json("metadata", dict(metadata or {}))
        for name, column in (columns or {}).items():
            if not isinstance(column, Iterable):
                raise ValueError(
                    f"column {name!r} must have one entry per trial, got {shown(column)}"
                )
            entries = tuple(_json(f"column {name!r}", list(column)))
            if len(entries) != len(self):
                raise ValueError(
                    f"column {name!r} must have one entry per trial, {len(self)}, "
                    f"got {len(entries)}"
                )
            self._columns[str(name)] = entries

    @classmethod
    def _of(cls, arrays: TrialsArrays, n_classes: int | None, pattern_bins: int | None) -> Trials:
        """Trials of arrays that are known to be right and that nobody else holds."""
        trials = object.__new__(cls)
        trials._set(arrays, n_classes, pattern_bins)
        return trials

    # --- where they come from -----------------------------------------------------------------

    @classmethod
    def draw(cls, task: Task, patterns: Patterns, n: int, seed: int | Generator) -> Trials:
        """`n` trials of `task` with `patterns`: those that `draw_trial` draws from that seed.

        `seed` is a number, as for numpy.random.default_rng, or a Generator to draw from.
        """
        numbers = task_arrays(task, patterns)
        n = whole("n", n, low=1, high=MAX_TRIALS)
        bins = task.background_bins + task.mean_pattern_bins
        spikes = n * bins * task.rate * task.n_inputs
        require_memory(
            f"{n:,} trials of {spikes / n:,.0f} spikes each",
            16.0 * spikes + 200.0 * n,
            "draw fewer",
        )
        held = Generators([seeded(seed)]).held
        arrays = TrialsArrays(task.n_inputs, *draw(held, numbers, n, int(1.02 * spikes) + 64))
        return cls._of(arrays, task.n_classes, task.pattern_bins)

    @classmethod
    def from_arrays(
        cls,
        n_inputs: int,
        n_bins: ArrayLike,
        spikes: ArrayLike,
        channels: ArrayLike,
        bins: ArrayLike,
        *,
        labels: ArrayLike | None = None,
        presentations: ArrayLike | None = None,
        onsets: ArrayLike = (),
        ends: ArrayLike = (),
        targets: ArrayLike = (),
        classes: ArrayLike | None = None,
        n_classes: int | None = None,
        columns: Mapping[str, Iterable[Any]] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> Trials:
        """n trials from flat arrays, in which one trial stands behind the other.

        Args:
            n_inputs: N, number of input channels.
            n_bins: (n,), length of each trial.
            spikes: (n,), how many input spikes each trial has.
            channels, bins: (Σ spikes,), channel and bin of each input spike, the bin counted from
                the first of its trial; sorted by trial, bin and channel, none twice.
            labels: (n,), what each trial is owed, where only that is known. Otherwise:
            presentations: (n,), how many presentations each trial has.
            onsets, ends, targets, classes: (Σ presentations,), first bin, bin after the last,
                output spikes owed and class (None: all of class 0) of each presentation; sorted by
                trial and bin.
            n_classes, columns, metadata: as for `Trials`.

        Raises ValueError if these do not fit each other.
        """
        n_inputs = whole("n_inputs", n_inputs, low=1, high=MAX_INPUTS)
        lengths = whole_array("n_bins", n_bins, 1, MAX_BINS)
        if not 1 <= len(lengths) <= MAX_TRIALS:
            raise ValueError(f"there must be 1 … {MAX_TRIALS:,} trials, got {len(lengths)} n_bins")
        n = len(lengths)
        zeros = np.zeros(n, np.int64)
        if (labels is None) == (presentations is None):
            raise ValueError("give either labels or presentations, with onsets, ends and targets")
        shown_in = zeros if presentations is None else presentations
        first, last = (
            whole_array("onsets", onsets, 0, MAX_BINS),
            whole_array("ends", ends, 0, MAX_BINS),
        )
        owed = whole_array("targets", targets, 0, MAX_TARGET)
        which = np.zeros(len(first), np.int64) if classes is None else classes
        which = whole_array("classes", which, 0, MAX_INPUTS)
        shown_in = _one_each(
            "presentations", whole_array("presentations", shown_in, 0, MAX_BINS), n
        )
        for name, values in (
            ("onsets", first),
            ("ends", last),
            ("targets", owed),
            ("classes", which),
        ):
            if len(values) != shown_in.sum():
                raise ValueError(
                    f"{name} must have one entry for each of the {shown_in.sum()} presentations, "
                    f"got {len(values)}"
                )
        label = zeros if labels is None else whole_array("labels", labels, 0, MAX_LABEL)
        label = _one_each("labels", label, n)
        edges, target, first_edge = segments_of(first, last, owed, starts(shown_in), lengths, label)
        arrays = TrialsArrays(
            n_inputs,
            whole_array("channels", channels, 0, n_inputs - 1, np.int32),
            whole_array("bins", bins, 0, MAX_BINS, np.int32),
            starts(_one_each("spikes", whole_array("spikes", spikes, 0, 2**40), n)),
            edges,
            target,
            first_edge,
            which,
            np.full(n, labels is not None),
        )
        check_arrays(arrays)
        trials = cls._of(arrays, n_classes, _length_of_all(arrays))
        trials._tell(columns, metadata)
        return trials

    @classmethod
    def concatenate(cls, parts: Iterable[Trials]) -> Trials:
        """All trials of some data sets, one after the other.

        Columns that a part lacks are None there; of the metadata stays what all parts agree on.
        """
        held = list(parts) if isinstance(parts, Iterable) else [parts]
        if not held or not all(isinstance(part, Trials) for part in held):
            raise ValueError(f"give at least one Trials to concatenate, got {shown(held)}")
        _require_equal("n_inputs", [part.n_inputs for part in held])
        pieces = [part._arrays for part in held]

        def joined(field: str) -> NDArray[Any]:
            return np.concatenate([getattr(piece, field) for piece in pieces])

        def joined_starts(field: str) -> NDArray[np.int64]:
            found: NDArray[np.int64] = starts(
                np.concatenate([np.diff(getattr(piece, field)) for piece in pieces])
            )
            return found

        arrays = TrialsArrays(
            pieces[0].n_inputs,
            joined("channels"),
            joined("bins"),
            joined_starts("first_spike"),
            joined("edges"),
            joined("target"),
            joined_starts("first_edge"),
            joined("classes"),
            joined("label_only"),
        )
        lengths = {part._pattern_bins for part in held}
        trials = cls._of(
            arrays,
            max(part.n_classes for part in held),
            lengths.pop() if len(lengths) == 1 else None,
        )
        names = dict.fromkeys(name for part in held for name in part._columns)
        for name in names:
            columns = [part._columns.get(name, (None,) * len(part)) for part in held]
            trials._columns[name] = tuple(entry for column in columns for entry in column)
        trials._metadata = {
            name: copy.deepcopy(value)
            for name, value in held[0]._metadata.items()
            if all(name in part._metadata and part._metadata[name] == value for part in held)
        }
        return trials

    def __add__(self, other: Trials) -> Trials:
        if not isinstance(other, Trials):
            return NotImplemented
        return Trials.concatenate([self, other])

    # --- what they are ------------------------------------------------------------------------

    @property
    def arrays(self) -> TrialsArrays:
        """The trials for compiled code, which must only read them; see `lay_out`."""
        return self._arrays

    @property
    def n_inputs(self) -> int:
        """N, number of input channels."""
        return self._arrays.n_inputs

    @property
    def n_classes(self) -> int:
        """Number of classes of presentations; 0 where only labels are known."""
        return self._n_classes

    @property
    def pattern_bins(self) -> int | None:
        """M, bins of each presentation; None where they differ or none says."""
        return self._pattern_bins

    @property
    def n_bins(self) -> NDArray[np.int64]:
        """Length of each trial in bins, (n,)."""
        return self._arrays.edges[self._arrays.first_edge[1:] - 1]

    @property
    def n_spikes(self) -> NDArray[np.int64]:
        """Number of input spikes of each trial, (n,)."""
        return np.diff(self._arrays.first_spike)

    @property
    def labels(self) -> NDArray[np.int64]:
        """The aggregate label of each trial: output spikes owed by it, (n,)."""
        return np.add.reduceat(self._arrays.target, self._arrays.first_edge[:-1])

    @property
    def label_only(self) -> NDArray[np.bool_]:
        """Whether only the label of a trial is known, and not where it was earned; (n,)."""
        return self._arrays.label_only.copy()

    @property
    def rates(self) -> NDArray[np.float64]:
        """Spikes per bin of each channel over all trials, (N,): between 0 and 1."""
        spikes = np.bincount(self._arrays.channels, minlength=self.n_inputs)
        return spikes / self.n_bins.sum()

    @property
    def columns(self) -> Mapping[str, tuple[Any, ...]]:
        """What is known of each trial, by name: one JSON value for each trial."""
        return MappingProxyType(self._columns)

    @property
    def metadata(self) -> dict[str, Any]:
        """What is known of all trials, as JSON values; a copy."""
        return copy.deepcopy(self._metadata)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self._arrays[1:])

    def __len__(self) -> int:
        return len(self._arrays.label_only)

    def __repr__(self) -> str:
        only = int(self._arrays.label_only.sum())
        known = "" if only == 0 else f", {'all' if only == len(self) else f'{only:,}'} label only"
        return (
            f"Trials({len(self):,} of {_range(self.n_bins)} bins, {self.n_inputs:,} channels, "
            f"{self.rates.mean():.3g} spikes per bin and channel, "
            f"{self.n_classes} classes, labels {_range(self.labels)}{known})"
        )

    # --- parts of them ------------------------------------------------------------------------

    @overload
    def __getitem__(self, key: int | np.integer[Any]) -> Trial: ...

    @overload
    def __getitem__(self, key: slice | Sequence[Any] | NDArray[Any]) -> Trials: ...

    def __getitem__(self, key: Any) -> Trial | Trials:
        if isinstance(key, (int, np.integer)) and not isinstance(key, bool):
            if not -len(self) <= key < len(self):
                raise IndexError(f"there are {len(self):,} trials, got number {shown(key)}")
            return self._trial(range(len(self))[key])
        which = self._numbers(key)
        if len(which) == 0:
            raise ValueError("a data set has at least one trial, the selection has none")
        return self._selected(which)

    def _trial(self, i: int) -> Trial:
        channels, offsets, edges, target, classes = one_trial(self._arrays, i)
        length = self._pattern_bins
        if length is None:
            length = common_length(edges[1:-1:2], edges[2::2], None)
        arrays = TrialArrays(channels, offsets, edges, target)
        only = bool(self._arrays.label_only[i])
        return Trial._trusted(arrays, classes, self.n_inputs, length, only)

    def _numbers(self, key: Any) -> NDArray[np.int64]:
        """The trials that an index asks for, (selected,), each in 0 … n − 1; or IndexError."""
        if isinstance(key, slice):
            return np.arange(len(self))[key]
        try:
            array = np.asarray(key)
            if array.ndim != 1 or array.dtype.kind not in ("biu" if array.size else "biuf"):
                raise TypeError
            return np.arange(len(self))[array if array.size else []]
        except (TypeError, ValueError, IndexError):
            raise IndexError(
                f"trials are selected by a number in 0 … {len(self) - 1}, a slice, a row of "
                f"numbers, or a mask of {len(self)} bools, got {shown(key)}"
            ) from None

    def _selected(self, which: NDArray[np.int64]) -> Trials:
        trials = Trials._of(take(self._arrays, which), self._n_classes, self._pattern_bins)
        trials._columns = {
            name: tuple(column[i] for i in which) for name, column in self._columns.items()
        }
        trials._metadata = copy.deepcopy(self._metadata)
        return trials

    def __iter__(self) -> Iterator[Trial]:
        return map(self._trial, range(len(self)))

    def split(
        self, fraction: float, seed: int | Generator, *, by: str | None = None
    ) -> tuple[Trials, Trials]:
        """Two data sets that share no trial: a random `fraction` of the trials, and the others.

        Both keep the order of the trials. With `by`, the name of a column, trials with equal
        entries there stay together: no voice, animal or session is on both sides. The first part
        then has as many whole groups as come closest to the fraction.

        Raises ValueError if a part would be empty.
        """
        fraction = real("fraction", fraction, low=0.0, high=1.0)
        rng = seeded(seed)
        groups = np.arange(len(self)) if by is None else self._groups(by)
        order = rng.permutation(int(groups.max()) + 1)
        sizes = np.append(0, np.cumsum(np.bincount(groups)[order]))
        chosen = order[: int(np.argmin(np.abs(sizes - fraction * len(self))))]
        in_first = np.isin(groups, chosen)
        if in_first.all() or not in_first.any():
            raise ValueError(
                f"both parts must have a trial, fraction = {fraction:g} of {len(self)} trials "
                f"({len(order)} groups) leaves one empty"
            )
        return self._selected(np.nonzero(in_first)[0]), self._selected(np.nonzero(~in_first)[0])

    def _groups(self, by: str) -> NDArray[np.int64]:
        """For each trial the number of its entry in a column, counted in order of appearance."""
        if not isinstance(by, str) or by not in self._columns:
            raise ValueError(
                f"by must be one of the columns, {list(self._columns)}, got {shown(by)}"
            )
        numbers: dict[str, int] = {}
        entries = map(json.dumps, self._columns[by])
        return np.array([numbers.setdefault(entry, len(numbers)) for entry in entries])

    def shuffled(self, seed: int | Generator) -> Trials:
        """The same trials in random order."""
        return self._selected(seeded(seed).permutation(len(self)))

    def delayed(self, delays: Iterable[int]) -> Trials:
        """Trials with a copy of every channel for each delay, so many bins later.

        Copy d of channel i is channel d·N + i, hence N · len(delays) channels. Spikes delayed past
        the end of their trial are dropped. Presentations and labels stay as they are.
        """
        try:
            given = list(delays)
        except TypeError:
            raise ValueError(
                f"delays must be a row of whole numbers, got {shown(delays)}"
            ) from None
        bins = whole_array("delays", given, 0, MAX_BINS)
        if len(bins) == 0:
            raise ValueError("delays must be at least one number of bins, got none")
        n_inputs = whole("channels · delays", self.n_inputs * len(bins), low=1, high=MAX_INPUTS)
        spikes = len(self._arrays.channels) * len(bins)
        require_memory(f"{len(bins)} copies of all spikes", 8.0 * spikes, "take fewer delays")
        channels, later, first_spike = delayed(self._arrays, bins)
        arrays = self._arrays._replace(
            n_inputs=n_inputs, channels=channels, bins=later, first_spike=first_spike
        )
        trials = Trials._of(arrays, self._n_classes, self._pattern_bins)
        trials._columns, trials._metadata = self._columns, self._metadata
        return trials

    # --- files --------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all to one compressed file without pickle, replaced whole or not at all.

        Raises ValueError if it cannot be written.
        """
        known = {
            "n_classes": self._n_classes,
            "pattern_bins": self._pattern_bins,
            "columns": self._columns,
            "metadata": self._metadata,
        }
        write_trials(path, self._arrays, known)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Trials:
        """Read what `save` wrote; ValueError if the file is anything else, or damaged."""
        return read_trials(path, cls._known)

    @classmethod
    def _known(
        cls,
        arrays: TrialsArrays,
        n_classes: int,
        pattern_bins: int | None,
        columns: dict[str, Any],
        metadata: dict[str, Any],
    ) -> Trials:
        """Trials of arrays that have been checked, and of what has not."""
        trials = cls._of(arrays, n_classes, None)
        if pattern_bins is not None:
            pattern_bins = whole("pattern_bins", pattern_bins, low=1, high=MAX_BINS)
            if len(arrays.classes) and _length_of_all(arrays) != pattern_bins:
                raise ValueError(f"presentations must all have pattern_bins = {pattern_bins} bins")
        trials._pattern_bins = pattern_bins
        trials._tell(columns, metadata)
        return trials

    def __reduce__(self) -> tuple[Any, ...]:
        """Through the checks, as a file is."""
        state = (self._arrays, self._n_classes, self._pattern_bins, self._columns, self._metadata)
        return _unpickled, state


def _unpickled(
    arrays: TrialsArrays,
    n_classes: int,
    pattern_bins: int | None,
    columns: dict[str, Any],
    metadata: dict[str, Any],
) -> Trials:
    n_inputs = whole("n_inputs", arrays.n_inputs, low=1, high=MAX_INPUTS)
    checked = TrialsArrays(
        n_inputs,
        whole_array("channels", arrays.channels, 0, n_inputs - 1, np.int32),
        whole_array("bins", arrays.bins, 0, MAX_BINS, np.int32),
        starts(checked_counts("spikes", np.diff(arrays.first_spike), len(arrays.channels))),
        whole_array("edges", arrays.edges, 0, MAX_BINS),
        whole_array("target", arrays.target, 0, MAX_LABEL),
        starts(checked_counts("segments", np.diff(arrays.first_edge), len(arrays.edges))),
        whole_array("classes", arrays.classes, 0, MAX_INPUTS),
        np.array(arrays.label_only, np.bool_),
    )
    check_arrays(checked)
    return Trials._known(checked, n_classes, pattern_bins, columns, metadata)


def _checked_list(trials: Iterable[Trial]) -> list[Trial]:
    try:
        held = list(trials)
    except TypeError:
        raise ValueError(f"trials must be a list of gnm_env.Trial, got {shown(trials)}") from None
    wrong = [trial for trial in held if not isinstance(trial, Trial)]
    if wrong or not held:
        raise ValueError(
            "trials must be at least one gnm_env.Trial, got "
            + (f"{shown(wrong[0])} among them" if held else "none")
        )
    _require_equal("n_inputs", [trial.n_inputs for trial in held])
    return held


def _require_equal(name: str, values: list[int]) -> None:
    for k, value in enumerate(values):
        if value != values[0]:
            raise ValueError(
                f"all must have the same {name}, got {values[0]} and, at place {k}, {value}"
            )


def _one_each(name: str, values: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    if len(values) != n:
        raise ValueError(f"{name} must have one entry per trial, {n} as n_bins, got {len(values)}")
    return values


def _length_of_all(a: TrialsArrays) -> int | None:
    """The length of all presentations; None where they differ or there is none."""
    # Every trial has an even number of edges, so presentations begin at odd places; and so does
    # the step from the last edge of a trial to the first of the next.
    lengths = np.delete(np.diff(a.edges)[1::2], a.first_edge[1:-1] // 2 - 1)
    return int(lengths[0]) if len(lengths) and np.all(lengths == lengths[0]) else None


def seeded(seed: Any) -> Generator:
    """The generator of a seed, or the Generator that is given in its place."""
    if isinstance(seed, Generator):
        return seed
    return np.random.default_rng(whole("seed", seed, low=0, high=MAX_SEED))


def _json(name: str, value: Any) -> Any:
    """A copy of `value` as JSON gives it back, or ValueError."""
    try:
        return json.loads(json.dumps(value, default=_plain))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(
            f"{name} must be JSON: numbers, text, lists, dictionaries; {error}"
        ) from None


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, as JSON knows them."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"got {type(value).__name__}")


def _range(values: NDArray[Any]) -> str:
    low, high = values.min(), values.max()
    return f"{low:,}" if low == high else f"{low:,} … {high:,}"
