"""Repeats of all competitors in turn, so that a disturbance of the machine hits all alike."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.cores import Cores


@dataclass(frozen=True)
class Settings:
    """How thoroughly to measure.

    Attributes:
        repeats: of each measurement.
        quick: whether to do less work per repeat: numbers for a first look.
        full: whether to do the whole work of a heat map instead of a part.
        seed: of the streams.
        cores: where to measure.
    """

    repeats: int
    quick: bool
    full: bool
    seed: int
    cores: Cores

    @property
    def trials(self) -> int:
        """Trials per training: the paper's, or a fifth."""
        return 12_000 if self.quick else 60_000

    @property
    def least_seconds(self) -> float:
        """A repeat of short work calls it again until this much time has gone."""
        return 0.05 if self.quick else 0.25


class Skip(Exception):
    """A measurement that cannot be made here, with the reason."""


@dataclass(frozen=True)
class Subject:
    """Something to be timed.

    Attributes:
        name: in the table.
        run: the timed work; is handed what `make` returned.
        work: units of work that one call of `run` does.
        make: prepares a call of `run`, untimed.
        warm: called once before all repeats: compiles what `run` needs. None: one call of `run`.
        cores: number of cores that it may use.
    """

    name: str
    run: Callable[[Any], object]
    work: float
    make: Callable[[], Any] = lambda: None
    warm: Callable[[], object] | None = None
    cores: int = 1


@dataclass(frozen=True)
class Timing:
    """What a race gives for one subject.

    Attributes:
        seconds: wall time per unit of work, one entry per repeat.
        cpu_share: CPU time of this process over wall time: below the number of cores that the work
            uses, others had a part of them.
    """

    seconds: tuple[float, ...]
    cpu_share: tuple[float, ...]


def race(subjects: Sequence[Subject], settings: Settings) -> dict[str, Timing]:
    """Time all subjects `settings.repeats` times, taking turns; every second round backwards."""
    for subject in subjects:
        with settings.cores.only(subject.cores):
            subject.warm() if subject.warm else subject.run(subject.make())
    wall: dict[str, list[float]] = {subject.name: [] for subject in subjects}
    share: dict[str, list[float]] = {subject.name: [] for subject in subjects}
    for k in range(settings.repeats):
        for subject in subjects if k % 2 == 0 else reversed(subjects):
            with settings.cores.only(subject.cores):
                seconds, cpu, calls = _timed(subject, settings.least_seconds)
            wall[subject.name].append(seconds / (calls * subject.work))
            share[subject.name].append(cpu / seconds)
    return {name: Timing(tuple(wall[name]), tuple(share[name])) for name in wall}


def _timed(subject: Subject, least_seconds: float) -> tuple[float, float, int]:
    """Wall and CPU seconds of as many runs as fill `least_seconds`, and their number."""
    wall = cpu = 0.0
    calls = 0
    gc.collect()
    while calls == 0 or wall < least_seconds:
        made = subject.make()
        wall_before, cpu_before = time.perf_counter(), time.process_time()
        subject.run(made)
        cpu += time.process_time() - cpu_before
        wall += time.perf_counter() - wall_before
        calls += 1
    return wall, cpu, calls
