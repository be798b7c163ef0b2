"""A few worker processes that survive what the cases do to them."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

WORKER = Path(__file__).with_name("worker.py")
STARTING = 300.0
"""Seconds that a worker may take to import everything, on a busy machine."""


class Worker:
    """One process; begun anew after each case that ended it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def run(self, number: int, timeout: float) -> tuple[str, str]:
        """What became of the case: as `worker.outcome` says, or crash, or hang."""
        if self._process is None:
            self._start()
        process = self._process
        assert process is not None and process.stdin is not None
        process.stdin.write(f"{number}\n")
        process.stdin.flush()
        answer = self._answer(timeout)
        if isinstance(answer, list):
            return answer[0], answer[1]
        self.stop()
        if answer is None:
            return "hang", f"no answer within {timeout:g} s"
        name = signal.Signals(-answer).name if answer < 0 else f"exit code {answer}"
        return "crash", name

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(WORKER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        if self._answer(STARTING) != "ready":
            raise RuntimeError("a worker does not start; run tests/campaign/worker.py to see why")

    def _answer(self, timeout: float) -> Any:
        """The next line, or the exit code, or None if neither comes in time."""
        process = self._process
        assert process is not None and process.stdout is not None
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            if not selector.select(timeout):
                return None
        line = process.stdout.readline()
        return json.loads(line) if line else process.wait()

    def stop(self) -> None:
        """End the process and all that it has started."""
        process, self._process = self._process, None
        if process is not None:
            with_children = getattr(os, "killpg", None)
            if process.poll() is None and with_children is not None:
                with_children(process.pid, signal.SIGKILL)
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with contextlib.suppress(OSError):
                        stream.close()


def run_cases(
    numbers: Iterable[int],
    jobs: int,
    timeout: float,
    told: Callable[[dict[int, tuple[str, str]]], None] | None = None,
) -> dict[int, tuple[str, str]]:
    """What became of each of the cases of `inputs.cases()`, by number.

    `told` is called every minute with what is known so far.
    """
    waiting = list(numbers)[::-1]
    results: dict[int, tuple[str, str]] = {}
    lock = threading.Lock()

    def serve() -> None:
        worker = Worker()
        try:
            while True:
                with lock:
                    if not waiting:
                        return
                    number = waiting.pop()
                results[number] = worker.run(number, timeout)
        finally:
            worker.stop()

    threads = [threading.Thread(target=serve) for _ in range(jobs)]
    for thread in threads:
        thread.start()
    last = time.monotonic()
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.05)
        if told is not None and time.monotonic() - last > 60:
            last = time.monotonic()
            told(dict(results))
    return dict(sorted(results.items()))
