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
from agents.experiments.sweep import sweep
from agents.experiments.workers import cluster
from tests.agents.experiments import toys


def counted(folder: str, block: Block) -> Any:
    """Leave a note, then work."""
    (Path(folder) / f"{block.number}-{os.getpid()}").touch()
    return toys.work(block)


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
            while len(list(notes.iterdir())) < 5:
                threading.Event().wait(0.02)
            os.kill(min(pids), signal.SIGKILL)

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
