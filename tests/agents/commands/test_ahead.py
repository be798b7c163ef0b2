"""Compiling ahead in a second process: it helps where it can, and cannot harm."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from numba import njit

from agents import GNM, LIF, AggregateLabel, NeuronAgent
from agents.commands import ahead
from agents.training.many import thread_count
from gnm_env import Patterns, Task

ROOT = Path(__file__).resolve().parents[3]
TASK = Task(n_inputs=10)
PATTERNS = Patterns.draw(TASK, 0)

LISTED = """
from numba.core import event
class Listener(event.Listener):
    def on_start(self, happened): print("compiled", happened.data["dispatcher"])
    def on_end(self, happened): pass
event.register("numba:compile", Listener())
from agents.commands import run
run("train")
"""


def agent() -> NeuronAgent:
    return NeuronAgent(GNM(), AggregateLabel(learning_rate=1e-4), TASK.n_inputs, seed=0)


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Every second process of the test; the first part is one function that is kept nowhere."""
    processes: list[Any] = []
    real = subprocess.Popen

    def noted(*arguments: Any, **settings: Any) -> Any:
        processes.append(real(*arguments, **settings))
        return processes[-1]

    monkeypatch.setattr(subprocess, "Popen", noted)
    monkeypatch.setattr(ahead, "thread_count", lambda threads: 2)
    monkeypatch.setattr(ahead, "_first_part", lambda *_: njit(lambda: 1)())
    return processes


def test_nothing_is_started_where_nothing_has_to_be_compiled(
    started: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ahead, "_first_part", lambda *_: None)
    ahead.compile_ahead(agent(), TASK, PATTERNS)
    assert started == []


def test_nothing_is_started_where_there_is_one_core(
    started: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ahead, "thread_count", lambda threads: 1)
    ahead.compile_ahead(agent(), TASK, PATTERNS)
    assert started == []


@pytest.mark.parametrize(
    "code", ["raise SystemExit(3)", "not python", "import time; time.sleep(1e6)"]
)
def test_a_second_process_that_fails_or_hangs_is_given_up_and_gone(
    started: list[Any], monkeypatch: pytest.MonkeyPatch, code: str, capfd: Any
) -> None:
    monkeypatch.setattr(ahead, "_SECOND", code)
    ahead.compile_ahead(agent(), TASK, PATTERNS)
    (process,) = started
    assert process.returncode is not None  # ended, and waited for
    assert capfd.readouterr() == ("", "")


def test_a_second_process_that_cannot_be_started_stops_nothing(
    started: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", str(ROOT / "no such program"))
    ahead.compile_ahead(agent(), TASK, PATTERNS)
    assert started == []


def test_a_neuron_that_cannot_be_sent_stops_nothing(started: list[Any]) -> None:
    class Mine(LIF):
        name = "unsendable"

    mine = NeuronAgent(Mine(), AggregateLabel(learning_rate=1e-4), TASK.n_inputs, seed=0)
    ahead.compile_ahead(mine, TASK, PATTERNS)
    assert started == []


def test_the_second_process_ends_with_the_first_one() -> None:
    code = (
        "import time; from agents.commands import ahead\n"
        "ahead._second_part = lambda *work: (print('at work', flush=True), time.sleep(1e6))\n"
        "ahead.serve()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
    )
    assert process.stdin is not None and process.stdout is not None
    with process:
        process.stdin.write(pickle.dumps([]) + pickle.dumps((agent(), TASK, PATTERNS)))
        process.stdin.flush()
        assert process.stdout.readline().strip() == b"at work"
        process.stdin.close()
        assert process.wait() != 0


@pytest.mark.slow
@pytest.mark.skipif(thread_count(None) < 2, reason="needs two cores")
def test_two_processes_share_the_compiling_of_a_first_start(tmp_path: Path) -> None:
    def start() -> str:
        return subprocess.run(
            [sys.executable, "-c", LISTED, "--trials", "20", "--out", str(tmp_path / "out")],
            capture_output=True,
            text=True,
            check=True,
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path]),
                "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
            },
        ).stdout

    printed = start()
    parts = ("draw_batch", "survive", "train", "answer", "record")
    assert [part for part in parts if re.search(rf"compiled .*{part}", printed)] == [*parts[:2]]
    assert "compiled" not in start()
