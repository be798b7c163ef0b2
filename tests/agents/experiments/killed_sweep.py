"""Start a sweep ten times and kill it each time, once a random number of blocks more is there.

Each start is a fork of this process, which has imported everything: it starts fast.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import dask.array  # noqa: F401  (what xarray imports for the first store that a process makes)

from agents.experiments.store import summarise
from agents.experiments.sweep import sweep
from agents.experiments.workers import threads
from tests.agents.experiments.toys import toy


def start(folder: Path) -> int:
    """A sweep in a child process; returns its process number."""
    child = os.fork()
    if child == 0:
        with threads(2) as executor:
            sweep(toy(seeds=36, pause=0.04), folder, executor)
        os._exit(0)
    return child


def done(folder: Path) -> int:
    """Finished blocks."""
    return summarise(folder).done if folder.exists() else 0


def main(folder: Path) -> None:
    """Print how each of the ten ended and how many blocks were there then."""
    moments, ends, reached = random.Random(1), [], [0]
    for _ in range(10):
        child = start(folder)
        wanted = reached[-1] + moments.randint(0, 14)
        while done(folder) < wanted:
            time.sleep(0.001)
        time.sleep(moments.uniform(0.0, 0.05))  # in the middle of a block, or of writing it
        os.kill(child, signal.SIGKILL)
        ends.append(os.waitpid(child, 0)[1])
        reached.append(done(folder))
    print(json.dumps({"ends": ends, "done": reached[1:]}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
