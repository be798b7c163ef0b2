"""Compile what a training and its score need by two processes at once, where it is not kept yet.

Most of compiling is Python, of which one process does one thing at a time, so a thread would not
help. The second process is started by the first function that is compiled here: where everything is
kept on disk from an earlier start, there is none. It leaves what it compiles on disk, from where
this process loads it, and does nothing else: no number is drawn from anybody's generator. Where it
fails, is late or is killed, this process compiles the rest itself, as it would have done alone; and
it ends when this process ends.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core import event

from agents.recording import record
from agents.registry import load_module
from agents.training.many import thread_count, train_many
from agents.training.source import TaskSource
from gnm_env import Patterns, Task, Trial
from gnm_env.batches import draw_batch
from gnm_env.compiled import is_kept

PATIENCE = 2.0
"""This process waits at most so many times as long as its own part took."""

_KILLED = 5.0
"""Seconds in which a process that is killed should be gone."""

_SECOND = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from agents.commands import ahead
ahead.serve()
"""


def compile_ahead(agent: Any, task: Task, patterns: Patterns) -> None:
    """Have compiled, and kept on disk, what training and scoring `agent` alone will need.

    Raises what `train_many` would, before anything is compiled.
    """
    train_many([agent], task, patterns, 0, np.random.default_rng(0), 1)
    if thread_count(None) < 2 or not sys.executable or not is_kept(draw_batch):
        return
    began = time.monotonic()
    second = _Second(agent, task, patterns)
    try:
        with event.install_listener("numba:compile", _AtFirst(second.start)):
            _first_part(agent, TaskSource(task, patterns))
        second.wait(PATIENCE * (time.monotonic() - began))
    finally:
        second.end()


def _first_part(agent: Any, source: TaskSource) -> None:
    """What draws from the task: compiled once, it serves training and scoring."""
    rng = np.random.default_rng(0)
    next(source.batches(rng, source.ahead(rng, 1), 1))
    type(agent).batch([agent], source).survive(rng, 0)


def _second_part(agent: Any, task: Task, patterns: Patterns) -> None:
    """What hears trials that are drawn already; about as long to compile as the first part."""
    batch = type(agent).batch([agent], TaskSource(task, patterns))
    batch.hear_nothing()
    silence = np.zeros((1, task.n_inputs), bool)
    record(agent, Trial.from_dense(silence, [], [], task))


class _AtFirst(event.Listener):
    """Calls `start` when the first function is compiled that was not kept on disk."""

    def __init__(self, start: Callable[[], None]) -> None:
        self._start = start
        self._called = False

    def on_start(self, event: Any) -> None:
        if not self._called:
            self._called = True
            self._start()

    def on_end(self, event: Any) -> None:
        pass


class _Second:
    """The process that compiles the second part. Nothing here raises because of it."""

    def __init__(self, *work: Any) -> None:
        self._work = work
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        with contextlib.suppress(Exception):  # a class of the user's that pickle does not take
            homes = [type(part) for part in (self._work[0].model, self._work[0].rule)]
            files = [(cls.__module__, sys.modules[cls.__module__].__file__) for cls in homes]
            message = pickle.dumps(sys.path) + pickle.dumps(files) + pickle.dumps(self._work)
            self._process = subprocess.Popen(
                [sys.executable, "-c", _SECOND],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                bufsize=0,
            )
            # By a thread: a process that does not read must not stop this one.
            threading.Thread(target=self._send, args=(message,), daemon=True).start()

    def _send(self, message: bytes) -> None:
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):  # it has ended
            while message:
                message = message[self._process.stdin.write(message) :]

    def wait(self, seconds: float) -> None:
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)

    def end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self.wait(_KILLED)
            assert self._process.stdin is not None
            self._process.stdin.close()


def serve() -> None:
    """The life of the second process: its standard input tells what to do, and its end to end."""
    files = pickle.load(sys.stdin.buffer)
    for module, file in files:
        try:
            importlib.import_module(module)
        except ImportError:  # a file of the user's own
            load_module(file)
    work = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_the_first, daemon=True).start()
    _second_part(*work)
    os._exit(0)  # not by the interpreter, which would wait for the thread


def _end_with_the_first() -> None:
    """Wait for the end of standard input: that the first process has ended, however it did."""
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)
