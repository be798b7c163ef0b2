"""A sweep on a real Dask cluster of two workers, one of which is killed at its work."""

from __future__ import annotations

import functools
import json
import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from distributed import LocalCluster

from agents.experiments.design import Block
from agents.experiments.journal import read_journal
from agents.experiments.sweep import sweep
from agents.experiments.workers import cluster
from tests.agents.experiments import toys


def counted(folder: str, block: Block) -> Any:
    """Leave a note, then work."""
    (Path(folder) / f"{block.number}-{os.getpid()}").touch()
    return toys.work(block)


def kill_at_work(pid: int, notes: Path, folder: Path) -> bool:
    """Kill the worker if it has begun exactly one block that is not in the store yet."""
    if not folder.exists():
        return False
    os.kill(pid, signal.SIGSTOP)
    begun = {int(note.name.partition("-")[0]) for note in notes.glob(f"*-{pid}")}
    finished = set(read_journal(folder).blocks)
    at_work = len(begun) > 1 and len(begun - finished) == 1
    os.kill(pid, signal.SIGKILL if at_work else signal.SIGCONT)
    return at_work


def main(folder: Path) -> None:
    """Run the sweep, kill a worker that has begun a block, and tell what happened."""
    notes = folder.with_name("notes")
    notes.mkdir()
    compute = functools.partial(counted, str(notes))
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        cluster(local.scheduler_address) as executor,
    ):
        pids = {worker.process.pid for worker in local.workers.values()}

        def kill_one() -> None:
            while not kill_at_work(min(pids), notes, folder):
                threading.Event().wait(0.02)

        threading.Thread(target=kill_one).start()
        sweep(toys.toy(pause=0.2, compute=compute), folder, executor)
        alive = {worker.process.pid for worker in local.workers.values()}
    told = {
        "workers": sorted(pids),
        "killed": min(pids),
        "workers_at_the_end": sorted(alive),
        "computed": len(list(notes.iterdir())),
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
