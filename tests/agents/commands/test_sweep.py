from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from agents.commands.terminal import pattern_seeds
from agents.experiments.design import Block
from agents.experiments.journal import DATA
from agents.experiments.store import read, summarise
from agents.experiments.sweep import sweep
from agents.experiments.workers import cluster, threads
from tests.agents.experiments.toys import toy, work

ROOT = Path(__file__).resolve().parents[3]


def run(folder: Path, **settings: Any) -> xr.Dataset:
    with threads(2) as executor:
        sweep(toy(**settings), folder, executor)
    return read(folder)


def script(name: str, *arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / "scripts" / name), *map(str, arguments)],
        capture_output=True, text=True, timeout=600, cwd=cwd,
    )  # fmt: skip


def test_a_finished_sweep_computes_nothing_again(tmp_path: Path) -> None:
    first = run(tmp_path / "toy")

    def never(block: Block) -> dict[str, Any]:
        raise AssertionError(f"computed block {block.number} again")

    xr.testing.assert_identical(run(tmp_path / "toy", compute=never), first)


def test_a_sweep_may_be_told_to_compute_some_blocks_only(tmp_path: Path) -> None:
    with threads(1) as executor:
        some = sweep(toy(), tmp_path / "toy", executor, only=lambda block: block.number % 3 == 0)
        assert (some.done, some.blocks) == (6, 18)
        assert sweep(toy(), tmp_path / "toy", executor).done == 18


def helper(name: str, *arguments: object) -> dict[str, Any]:
    """Run one of the programs beside this file; its last line is what it has to tell."""
    ended = subprocess.run(
        [sys.executable, "-m", f"tests.agents.experiments.{name}", *map(str, arguments)],
        capture_output=True, text=True, timeout=600, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    told: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
    return told


def test_a_sweep_killed_at_ten_random_moments_ends_with_the_same_values(tmp_path: Path) -> None:
    folder = tmp_path / "toy"
    told = helper("killed_sweep", folder)
    assert told["ends"] == [signal.SIGKILL] * 10
    assert told["done"] == sorted(told["done"])
    assert 0 < told["done"][-1] < 216, "kills should meet a sweep at work"

    survivor = run(folder, seeds=36, pause=0.04)

    xr.testing.assert_identical(survivor, run(tmp_path / "whole", seeds=36, pause=0.04))
    assert summarise(folder).done == summarise(folder).blocks == 216
    assert not list((folder / DATA).rglob("*.partial"))


def test_a_block_that_fails_costs_no_finished_block(tmp_path: Path) -> None:
    def fails_late(block: Block) -> dict[str, Any]:
        if block.number == 9:
            time.sleep(0.2)
            raise ValueError("block 9 has no answer")
        return work(block)

    with pytest.raises(ValueError, match="block 9 has no answer"):
        run(tmp_path / "toy", compute=fails_late)
    assert 0 < summarise(tmp_path / "toy").done < 18
    run(tmp_path / "toy")


class KilledWorker(Exception):
    """As Dask raises it."""

    __module__ = "distributed.scheduler"


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (
            CancelledError(),
            r"a worker or the scheduler was lost \(CancelledError\) while computing",
        ),
        (KilledWorker("at\nlength"), r"a worker or the scheduler was lost \(KilledWorker\) while"),
        (BrokenProcessPool(), r"a worker or the scheduler was lost \(BrokenProcessPool\) while"),
        (TimeoutError(), r"a worker or the scheduler was lost \(TimeoutError\) while computing"),
        (OSError(24, "Too many open files"), "Too many open files while computing classes 2, patt"),
    ],
)
def test_what_goes_wrong_with_a_block_is_not_said_of_writing(
    tmp_path: Path, error: Exception, told: str
) -> None:
    def fails(block: Block) -> dict[str, Any]:
        if block.number == 9:
            time.sleep(0.2)
            raise error
        return work(block)

    with pytest.raises(
        OSError, match=told + r".*; \d+ of 18 blocks are kept: .*run it again"
    ) as info:
        run(tmp_path / "toy", compute=fails)
    assert "make room" not in str(info.value)
    assert len(str(info.value).splitlines()) == 1


def test_a_full_disk_is_one_line_with_what_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path / "whole")
    put, calls = sys.modules["zarr.storage._local"]._put, []

    def nearly_full(path: Path, *arguments: Any, **options: Any) -> Any:
        calls.append(path)
        if "/c/" in str(path) and "survived" in str(path) and len(calls) > 20:
            raise OSError(28, "No space left on device")
        return put(path, *arguments, **options)

    monkeypatch.setattr("zarr.storage._local._put", nearly_full)
    kept = r"No space left on device while writing .*toy; \d+ of 18 blocks are kept"
    with pytest.raises(OSError, match=kept):
        run(tmp_path / "toy")
    monkeypatch.undo()
    xr.testing.assert_identical(run(tmp_path / "toy"), read(tmp_path / "whole"))


@pytest.mark.parametrize(
    ("text", "seeds"), [("3", (0, 1, 2)), ("3,5,8", (3, 5, 8)), ("4-6", (4, 5, 6))]
)
def test_seeds_are_a_number_a_list_or_a_range(text: str, seeds: tuple[int, ...]) -> None:
    assert pattern_seeds(text) == seeds


@pytest.mark.parametrize("text", ["0-99999999999", "99999999999", "8999-9000", "3,9000"])
def test_seeds_beyond_the_last_are_refused_before_they_are_listed(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=r"must be in 0 … 8999, got"):
        pattern_seeds(text)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["F99"], "there is no experiment 'F99': choose one of F1, F1b"),
        (["F1", "--store", "/proc/nowhere/F1"], "cannot write in /proc/nowhere (No such file"),
        (["F1", "--threads", "0"], "--threads: must be >= 1, got 0"),
        (["F1", "--seeds", "3"], "F1 has no pattern seeds: leave --seeds out"),
    ],
)
def test_bad_input_ends_with_one_line_and_code_2(
    tmp_path: Path, arguments: list[str], complaint: str
) -> None:
    ended = script("sweep.py", *arguments, cwd=tmp_path)

    assert ended.returncode == 2
    assert complaint in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1, ended.stderr


def test_a_script_ends_with_one_json_object_and_a_line_of_progress(tmp_path: Path) -> None:
    ended = script("sweep.py", "F1", "--json", cwd=tmp_path)

    assert ended.returncode == 0, ended.stderr
    summary = json.loads(ended.stdout.splitlines()[-1])
    assert (summary["experiment"], summary["done"], summary["blocks"]) == ("F1", 2, 2)
    assert ended.stderr == "F1: 2/2 blocks, 0 s\n" or ended.stderr.startswith("F1: 2/2 blocks, ")
    assert read(tmp_path / "results" / "quick" / "F1").sizes["bin"] == 200


@pytest.mark.parametrize(
    ("script", "words", "extras"),
    [("sweep.py", ["F1"], "reproduce"), ("reproduce.py", [], "chemistry,reproduce")],
)
def test_without_an_extra_a_script_says_in_one_line_which(
    tmp_path: Path, script: str, words: list[str], extras: str
) -> None:
    (tmp_path / "zarr.py").write_text("raise ModuleNotFoundError(name='zarr')")
    ended = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / script), *words],
        capture_output=True, text=True, timeout=600, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
    )  # fmt: skip

    assert ended.returncode == 2
    assert ended.stderr == f'{script}: zarr is not installed: pip install "gnm-env[{extras}]"\n'


@pytest.fixture
def nowhere() -> str:
    """The address of a scheduler that is not there."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{free.getsockname()[1]}"


def test_a_scheduler_that_is_not_there_is_refused(
    nowhere: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("agents.experiments.workers.CONNECTION_SECONDS", 0.3)

    with (
        pytest.raises(ValueError, match=f"no Dask scheduler answers at {nowhere} .*: start one"),
        cluster(nowhere),
    ):
        pass


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_said_in_one_line(tmp_path: Path, nowhere: str) -> None:
    ended = script("sweep.py", "F1", "--scheduler", nowhere, cwd=tmp_path)

    assert ended.returncode == 2
    assert ended.stderr.startswith(f"sweep.py: no Dask scheduler answers at {nowhere}")
    assert len(ended.stderr.strip().splitlines()) == 1, ended.stderr


@pytest.mark.slow
def test_a_dask_worker_that_dies_costs_its_block_only(tmp_path: Path) -> None:
    told = helper("dying_worker", tmp_path / "toy")

    assert told["killed"] in told["workers"]
    assert told["begun"] == 18 + 1, "only the block at which the worker died is done twice"
    xr.testing.assert_identical(read(tmp_path / "toy"), run(tmp_path / "whole", pause=0.2))


OWN = """
from agents.experiments import Axis, class_counts, pattern_seeds, training

def mine(size, seeds):
    axes = (class_counts(1), pattern_seeds(seeds or (0, 1)), Axis("rate", (0.01, 0.02)),
            Axis("alpha", (0.2, 0.3), chunk=0))
    return training("mine", "My neuron", axes, neuron=NEURON, trials=50, runs=2, cap=100)

wrong = lambda size, seeds: training(
    "wrong", "", (class_counts(1), pattern_seeds((0,)), Axis("colour", ("red",))))
something = 7
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A folder away from the checkout with a neuron and an experiment of one's own."""
    shutil.copy(ROOT / "tests" / "agents" / "own" / "my_neurons.py", tmp_path)
    text = OWN.replace("NEURON", repr("my_neurons.py:ALIF"))
    (tmp_path / "my_experiment.py").write_text(text)
    return tmp_path


def test_an_experiment_of_ones_own_runs_with_a_neuron_of_ones_own(own: Path) -> None:
    ended = script("sweep.py", "my_experiment.py:mine", "--seeds", "3", "--json", cwd=own)
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout.splitlines()[-1])
    assert told["done"] == told["blocks"] == 2 * 3
    results = read(own / told["store"])
    assert results["survived"].dims == ("classes", "pattern_seed", "rate", "alpha", "run")
    again = script("sweep.py", "my_experiment:mine", "--seeds", "3", cwd=own)
    assert again.returncode == 0, again.stderr


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("my_experiment.py:wrong", "nothing takes the setting 'colour': neither the task"),
        ("my_experiment.py:something", "must be an Experiment, or a function"),
        ("my_experiment.py:nothing", "must be an Experiment, or a function"),
        ("nowhere.py:mine", "there is no file nowhere.py"),
    ],
)
def test_what_is_no_experiment_is_refused_and_leaves_no_store(
    own: Path, name: str, complaint: str
) -> None:
    ended = script("sweep.py", name, cwd=own)
    assert ended.returncode == 2
    assert complaint in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1, ended.stderr
    assert not (own / "results").exists()


def test_an_agent_with_classes_of_ones_own_is_scored_once_they_are_imported(own: Path) -> None:
    words = ("--neuron", "my_neurons.py:ALIF", "--trials", "20", "--alpha", "0.2")
    ended = script("train.py", *words, "--out", "run", cwd=own)
    assert ended.returncode == 0, ended.stderr
    missing = script("evaluate.py", "run/agent.npz", "--runs", "2", cwd=own)
    assert missing.returncode == 2 and "import my_neurons first" in missing.stderr
    scored = script(
        "evaluate.py", "run/agent.npz", "--runs", "2", "--import", "my_neurons.py", cwd=own
    )
    assert scored.returncode == 0, scored.stderr
