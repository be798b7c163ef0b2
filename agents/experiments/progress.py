"""How far a long run is: a bar on a terminal, elsewhere a line a minute."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import TextIO, TypeVar

from tqdm import tqdm


class Progress:
    """Counts what is finished. Use as a context manager.

    Args:
        name: what is being done.
        total: how much there is in all.
        done: what was there already; it does not count for the rate.
        unit: of what is counted, in the plural.
        stream: where to write, standard error by default.
        interval: seconds between lines where there is no terminal.
    """

    def __init__(
        self,
        name: str,
        total: int,
        done: int = 0,
        *,
        unit: str = "blocks",
        stream: TextIO | None = None,
        interval: float = 60.0,
    ) -> None:
        self.name, self.total, self.done = name, total, done
        self.unit, self.interval = unit, interval
        self._stream = stream or sys.stderr
        self._new = 0
        self._began = self._spoke = time.monotonic()
        self._bar = None
        if self._stream.isatty():
            self._bar = tqdm(
                total=total, initial=done, desc=name, unit=f" {unit}", unit_scale=total >= 10_000,
                file=self._stream,
            )  # fmt: skip

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()
        elif kind is None:
            self._say(f"{self.name}: {self.done}/{self.total} {self.unit}, {self.seconds:.0f} s")

    @property
    def seconds(self) -> float:
        """Time since the beginning."""
        return time.monotonic() - self._began

    def advance(self, count: int = 1, note: str = "") -> None:
        """So many more are finished; `note` stands beside the bar."""
        self.done += count
        self._new += count
        if self._bar is not None:
            self._bar.set_postfix_str(note, refresh=False)
            self._bar.update(count)
        self.tick()

    def tick(self) -> None:
        """To be called now and then: writes the line when it is due."""
        now = time.monotonic()
        if self._bar is None and now - self._spoke >= self.interval:
            self._spoke = now
            self._say(self.line())

    def line(self) -> str:
        """How much is done, the rate and the time left."""
        rate = self._new / max(self.seconds, 1e-9)
        done = f"{self.name}: {self.done}/{self.total} {self.unit}"
        if not rate:
            return f"{done}, {duration(self.seconds)} so far"
        return f"{done}, {60 * rate:.1f}/min, {duration((self.total - self.done) / rate)} left"

    def _say(self, text: str) -> None:
        print(text, file=self._stream, flush=True)


def duration(seconds: float) -> str:
    """Seconds as a person says them: "8 s", "4 min 10 s", "2 h 5 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


_Item = TypeVar("_Item")


def counted(name: str, unit: str) -> Callable[[Iterable[_Item]], Iterator[_Item]]:
    """What wraps a list of things to do and shows how many are done; as for `Progress`."""

    def shown(items: Iterable[_Item]) -> Iterator[_Item]:
        todo = list(items)
        with Progress(name, len(todo), unit=unit) as progress:
            for item in todo:
                yield item
                progress.advance()

    return shown
