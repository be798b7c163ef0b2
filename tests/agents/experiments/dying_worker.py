"""A sweep on a real Dask cluster of two workers, one of which dies at its work."""

from __future__ import annotations

import functools
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from distributed import LocalCluster, get_worker

from agents.experiments.design import Block
from agents.experiments.journal import read_journal
from agents.experiments.sweep import sweep
from agents.experiments.workers import cluster
from tests.agents.experiments import toys


def die_at_work(notes: str, folder: str, block: Block) -> Any:
    """Leave a note, and work; the first worker to begin a second block dies at it."""
    (Path(notes) / f"{block.number}-{os.getpid()}").touch()
    begun = {int(note.name.partition("-")[0]) for note in Path(notes).glob(f"*-{os.getpid()}")}
    if len(begun) > 1 and _is_first(Path(notes).with_name("killed")):
        # What it has finished is in the store, and the scheduler has no more need of it: without
        # waiting for both, how much is done twice would be a matter of time.
        while not begun - {block.number} <= set(read_journal(Path(folder)).blocks):
            time.sleep(0.01)
        while get_worker().data:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)
    return toys.work(block)


def _is_first(place: Path) -> bool:
    """Whether nobody was here before; leaves the number of this process."""
    try:
        with place.open("x") as file:
            file.write(str(os.getpid()))
    except FileExistsError:
        return False
    return True


def main(folder: Path) -> None:
    """Run the sweep, in which a worker dies, and tell what happened."""
    notes = folder.with_name("notes")
    notes.mkdir()
    compute = functools.partial(die_at_work, str(notes), str(folder))
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        cluster(local.scheduler_address) as executor,
    ):
        first = {worker.process.pid for worker in local.workers.values()}
        sweep(toys.toy(pause=0.2, compute=compute), folder, executor)
    told = {
        "workers": sorted(first),
        "killed": int(folder.with_name("killed").read_text()),
        "begun": len(list(notes.iterdir())),
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
