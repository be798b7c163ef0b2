"""Speed and size of recorded trials: from a file to 64 trained neurons, beside a drawn stream."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from agents import train_many
from benchmarks.rows import Findings, Row, Target, rate_rows
from benchmarks.timing import Settings, Subject, race
from benchmarks.training import LANES, bins, neurons
from gnm_env import Patterns, Task, Trials

SECTION = f"Recorded trials, {LANES} neurons"
RECORDED = 24_000
"""Trials of the file."""
MANY = 100_000
"""Trials whose size in memory is told."""
BYTES_PER_SPIKE = 8
"""A channel and a bin, four bytes each: what a list of spikes takes at least."""


def data_sets(settings: Settings) -> Findings:
    """From a file to 64 neurons that heard it once, beside trials drawn on the way; bytes."""
    task = Task()
    patterns = Patterns.draw(task, 0)
    recorded = Trials.draw(task, patterns, settings.trials, seed=settings.seed)
    drawn, heard = "drawn on the way", "recorded, in memory"
    subjects = [
        Subject(
            drawn,
            lambda agents: train_many(agents, task, patterns, settings.trials, settings.seed, 1),
            LANES * bins(task, settings.trials, settings.seed),
            neurons,
        ),
        Subject(
            heard,
            lambda agents: train_many(
                agents, recorded, trials=settings.trials, seed=settings.seed, threads=1
            ),
            LANES * float(recorded.n_bins.sum()),
            neurons,
        ),
    ]
    targets = {heard: (Target(0.7, "ratio"),)}
    rows = rate_rows(SECTION, race(subjects, settings), against=drawn, targets=targets)
    return Findings(rows=[*rows, _from_file(task, patterns, settings), _size(task, patterns)])


def _from_file(task: Task, patterns: Patterns, settings: Settings) -> Row:
    """Seconds from a file to neurons that have heard all of it once."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "trials.npz"
        Trials.draw(task, patterns, RECORDED, seed=settings.seed).save(file)

        def run(agents: list[Any]) -> None:
            trials = Trials.load(file)
            train_many(agents, trials, trials=len(trials), seed=settings.seed, threads=1)

        name = f"{RECORDED:,} trials, from the file to the last weight"
        timing = race([Subject(name, run, 1.0, neurons)], settings)[name]
    return Row(
        SECTION,
        name,
        "s",
        timing.seconds,
        more_is_better=False,
        targets=(Target(2.0),),
        cpu_share=timing.cpu_share,
        note=f"{task.n_inputs} channels, 200 bins on average; each trial heard once",
    )


def _size(task: Task, patterns: Patterns) -> Row:
    """Bytes of many trials, as a multiple of the bytes of their spikes."""
    trials = Trials.draw(task, patterns, MANY, seed=np.random.default_rng(0))
    return Row(
        SECTION,
        f"{MANY:,} trials in memory",
        "× the bytes of their spikes",
        (trials.nbytes / (BYTES_PER_SPIKE * int(trials.n_spikes.sum())),),
        more_is_better=False,
        targets=(Target(3.0),),
        note=f"a spike is {BYTES_PER_SPIKE} bytes, its channel and its bin",
    )
