"""What agents hear: the stream of a task, drawn on the way, or the trials of a data set."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gnm_env.batches import Batch, DataAhead, draw_batch, new_batch, take_batch
from gnm_env.checks import shown
from gnm_env.task import Patterns, Task, task_arrays
from gnm_env.trial import Trial, draw_trial
from gnm_env.trials import Trials


class Source:
    """Base of what agents hear."""

    fill: ClassVar[Any]
    """Compiled: fill a batch with trials; see `gnm_env.batches.draw_batch`."""
    n_inputs: int
    n_classes: int
    mean_bins: float
    """Mean length of a trial, in bins."""
    events_per_bin: float
    n_trials: int = 0
    """Trials of a data set; 0 for a stream, which has no end."""
    labels_only: bool = False
    """Whether presentations are not known, but labels are."""
    binary: bool = False
    """Whether no label is above 1."""

    def ahead(self, rng: Generator, trials: int) -> Any:
        """What compiled code takes the next `trials` trials from."""
        raise NotImplementedError

    def batches(
        self, rng: Generator, ahead: Any, trials: int
    ) -> Iterator[tuple[int, Batch, int, int]]:
        """The next `trials` trials, `ahead` being `self.ahead(…)` for them, in batches.

        Gives the number of trials that came before, the batch, the number of trials in it and the
        bins of the longest.
        """
        batch, done = new_batch(), 0
        while done < trials:
            batch, drawn, longest = type(self).fill(rng, ahead, done, trials - done, batch)
            batch = Batch(*batch)
            yield done, batch, drawn, longest
            done += drawn

    def trials(self, rng: Generator, n: int) -> list[Trial]:
        """The next `n` trials."""
        raise NotImplementedError

    def restart(self, in_order: bool = False) -> None:
        """Begin a new epoch; of a data set in its own order, if so wanted."""

    def stream(self) -> Any:
        """What compiled code draws the endless stream from; ValueError if there is none."""
        raise NotImplementedError


class TaskSource(Source):
    """Trials of a task with its patterns, drawn from the caller's generator."""

    fill = draw_batch

    def __init__(self, task: Task, patterns: Patterns) -> None:
        self.arrays = task_arrays(task, patterns)
        self.task, self.patterns = task, patterns
        self.n_inputs, self.n_classes = task.n_inputs, task.n_classes
        self.mean_bins = task.background_bins + task.mean_pattern_bins
        self.events_per_bin = task.rate * task.n_inputs

    def ahead(self, rng: Generator, trials: int) -> Any:
        return self.arrays

    def trials(self, rng: Generator, n: int) -> list[Trial]:
        return [draw_trial(self.task, self.patterns, rng) for _ in range(n)]

    def stream(self) -> Any:
        return self.arrays


class DataSource(Source):
    """The trials of a data set, each once an epoch, in an order drawn from the caller's generator.

    A new epoch begins with the source, and when all trials have been heard.
    """

    fill = take_batch

    def __init__(self, data: Trials) -> None:
        if len(data) == 0:
            raise ValueError("a data set must have at least one trial to be heard, got none")
        self.data = data
        self.n_inputs, self.n_classes, self.n_trials = data.n_inputs, data.n_classes, len(data)
        self.mean_bins = float(np.max(data.n_bins))
        self.events_per_bin = float(data.n_spikes.sum() / data.n_bins.sum())
        self.labels_only = bool(data.label_only.any())
        self.binary = bool(data.labels.max() <= 1)
        self._left = np.empty(0, np.int64)

    def ahead(self, rng: Generator, trials: int) -> Any:
        return DataAhead(self.data.arrays, self.order(rng, trials))

    def order(self, rng: Generator, trials: int) -> NDArray[np.int64]:
        """Numbers of the next `trials` trials."""
        parts = [self._left]
        while sum(map(len, parts)) < trials:
            parts.append(rng.permutation(self.n_trials))
        order = np.concatenate(parts)
        self._left = order[trials:]
        return order[:trials]

    def restart(self, in_order: bool = False) -> None:
        self._left = np.arange(self.n_trials if in_order else 0)

    def trials(self, rng: Generator, n: int) -> list[Trial]:
        return [self.data[int(k)] for k in self.order(rng, n)]

    def stream(self) -> Any:
        raise ValueError(
            "a data set of trials has no endless stream to survive on: score it with "
            "agents.answers, or hide patterns in its noise"
        )


def source_of(task: Any, patterns: Any = None) -> Source:
    """What the first arguments of `train_many` and its like mean."""
    if isinstance(task, Source):
        return task
    if isinstance(task, Trials):
        if patterns is not None:
            raise ValueError(
                "a data set of trials takes the place of task and patterns, got patterns as well; "
                "the number of trials is given as trials=…"
            )
        return DataSource(task)
    if isinstance(task, Task):
        return TaskSource(task, patterns)
    raise ValueError(
        f"task must be a gnm_env.Task, with patterns after it, or gnm_env.Trials, got {shown(task)}"
    )
