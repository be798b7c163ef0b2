"""A program: train some neurons and print the peak of memory that it took, in bytes, as JSON.

    python -m benchmarks.peak_memory N_INPUTS LANES BACKGROUND_BINS THREADS

A process of its own, since a peak cannot be taken back.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from agents import GNM, ErrorTrace, NeuronAgent, train_many
from gnm_env import Patterns, Task


def task_of(n_inputs: int, background_bins: int) -> Task:
    """A task whose trials are all of the same length."""
    return Task(n_inputs=n_inputs, background_bins=background_bins, mean_occurrences=0.0)


def peak(n_inputs: int, lanes: int, background_bins: int, threads: int) -> int:
    """Bytes by which the resident memory grows at most, from agents to the end of training.

    The rule is ET, which keeps more of a trial than ALL does. A short training before has compiled
    everything and has loaded it.
    """
    _train(n_inputs, 32, 10, 1)
    _forget_peak()
    before = _status("VmRSS")
    _train(n_inputs, lanes, background_bins, threads)
    return _status("VmHWM") - before


def _train(n_inputs: int, lanes: int, background_bins: int, threads: int) -> None:
    task = task_of(n_inputs, background_bins)
    agents = [NeuronAgent(GNM(), ErrorTrace(), n_inputs, seed=k) for k in range(lanes)]
    train_many(agents, task, Patterns.draw(task, 0), 3, 0, threads)


def _forget_peak() -> None:
    """The kernel's high-water mark begins again from what is resident now."""
    Path("/proc/self/clear_refs").write_text("5")


def _status(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024
    raise OSError(f"/proc/self/status has no {field}")


if __name__ == "__main__":
    print(json.dumps(peak(*map(int, sys.argv[1:]))))
