"""Keep a measurement on the cores that it is meant for, the idlest ones at that."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_TOPOLOGY = "/sys/devices/system/cpu/cpu{}/topology/thread_siblings_list"


class Cores:
    """The cores of this process. Two hardware threads of one physical core count once.

    Where the operating system cannot pin a process (macOS, Windows), nothing is pinned.

    Attributes:
        can_pin: whether it can.
        chosen: the cores to measure on, idlest first; empty if it cannot.
    """

    def __init__(self, watch: float = 0.5) -> None:
        self.can_pin = hasattr(os, "sched_setaffinity")
        self.chosen: list[int] = []
        if not self.can_pin:
            return
        self._all = os.sched_getaffinity(0)
        idle = _idle_shares(watch)
        # Without knowledge the highest number first: interrupts tend to go to the lowest.
        order = sorted(self._all, key=lambda core: (idle.get(core, 0.0), core), reverse=True)
        taken: set[int] = set()
        for core in order:
            if core not in taken:
                self.chosen.append(core)
                taken |= _siblings(core)

    @property
    def count(self) -> int:
        """Number of physical cores that a measurement can have."""
        return len(self.chosen) if self.can_pin else os.cpu_count() or 1

    @contextmanager
    def only(self, n: int) -> Iterator[None]:
        """Run on the `n` idlest cores. Threads that are made inside stay there too.

        Raises ValueError if there are fewer.
        """
        if n > self.count:
            raise ValueError(f"needs {n} cores, this process has {self.count}")
        if not self.can_pin:
            yield
            return
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, self.chosen[:n])
        try:
            yield
        finally:
            os.sched_setaffinity(0, before)


def _siblings(core: int) -> set[int]:
    """The hardware threads of the physical core that `core` belongs to."""
    try:
        text = Path(_TOPOLOGY.format(core)).read_text()
        ranges = [part.split("-") for part in text.strip().split(",")]
        return {n for ends in ranges for n in range(int(ends[0]), int(ends[-1]) + 1)}
    except (OSError, ValueError):
        return {core}


def _idle_shares(seconds: float) -> dict[int, float]:
    """How idle each core is over the next `seconds`; in tenths, less means nothing."""
    try:
        first = _idle_ticks()
        time.sleep(seconds)
        second = _idle_ticks()
    except (OSError, ValueError):
        return {}
    ticks = os.sysconf("SC_CLK_TCK") * seconds
    return {core: round((second[core] - first[core]) / ticks, 1) for core in second}


def _idle_ticks() -> dict[int, int]:
    lines = Path("/proc/stat").read_text().splitlines()
    fields = [line.split() for line in lines if line.startswith("cpu") and line[3].isdigit()]
    return {int(field[0][3:]): int(field[4]) for field in fields}
