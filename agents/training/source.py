"""What agents hear: the stream of a task, drawn on the way, or the trials of a data set."""

from __future__ import annotations

from typing import Any, ClassVar

from numpy.random import Generator

from gnm_env.task import Patterns, Task, task_arrays
from gnm_env.trial import Trial, draw_trial


class Source:
    """Base of what agents hear."""

    kind: ClassVar[str]
    """Names the compiled loops: a key of `agents.training.binding.SOURCES`."""
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

    def trials(self, rng: Generator, n: int) -> list[Trial]:
        """The next `n` trials."""
        raise NotImplementedError

    def stream(self) -> Any:
        """What compiled code draws the endless stream from; ValueError if there is none."""
        raise NotImplementedError


class TaskSource(Source):
    """Trials of a task with its patterns, drawn from the caller's generator."""

    kind = "task"

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


def source_of(task: Any, patterns: Any) -> Source:
    """What the first arguments of `train_many` and its like mean."""
    if isinstance(task, Source):
        return task
    if isinstance(task, Task):
        return TaskSource(task, patterns)
    raise ValueError(
        f"task must be a gnm_env.Task, with patterns after it, or gnm_env.Trials, "
        f"got {type(task).__name__}"
    )
