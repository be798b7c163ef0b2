"""Computing an experiment into its store, block by block. May be stopped and started at will."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from pathlib import Path

from agents.experiments.design import Block, Experiment
from agents.experiments.progress import Progress
from agents.experiments.store import Store, Summary, open_store, summarise
from agents.experiments.workers import Outcome, lost, timed


def sweep(
    experiment: Experiment,
    folder: Path,
    executor: Executor,
    *,
    repair: bool = False,
    interval: float = 60.0,
    only: Callable[[Block], bool] | None = None,
) -> Summary:
    """Compute what is missing in the store at `folder`; returns its summary.

    Args:
        experiment: what to compute.
        folder: its store, made if need be.
        executor: where blocks are computed.
        repair: compute damaged blocks again, instead of refusing the store.
        interval: seconds between lines of progress where there is no terminal.
        only: whether a block is wanted this time; None: all are.

    Raises StoreError, OSError (with the number of blocks that are kept; ConnectionError if workers
    are gone), or what a block raises.
    """
    with open_store(folder, experiment, repair=repair) as store:
        wanted = [block.number for block in experiment.blocks() if only is None or only(block)]
        chosen, total = set(wanted), len(wanted)
        pending = [block for block in store.pending() if block.number in chosen]
        if pending:
            with Progress(
                experiment.name, total, total - len(pending), interval=interval
            ) as progress:
                _compute(store, pending, executor, progress)
    return summarise(folder)


def _compute(store: Store, pending: list[Block], executor: Executor, progress: Progress) -> None:
    futures: dict[Future[Outcome], Block] = {}
    try:
        with _told("while handing out blocks", "run it again", progress):
            for block in pending:
                futures[executor.submit(timed, store.experiment.compute, block)] = block
        while futures:
            finished, _ = wait(futures, timeout=1.0, return_when=FIRST_COMPLETED)
            for future in finished:
                block = futures.pop(future)
                with _told(f"while computing {block.where}", "run it again", progress):
                    outcome = future.result()
                with _told(f"while writing {store.folder}", "make room and run it again", progress):
                    store.write(block, *outcome)
                progress.advance()
            progress.tick()
    finally:
        for future in futures:
            future.cancel()


@contextmanager
def _told(when: str, remedy: str, progress: Progress) -> Iterator[None]:
    """Make one sentence, with what is kept, of lost workers and of what the system refuses."""
    try:
        yield
    except Exception as error:
        kept = f"{when}; {progress.done} of {progress.total} blocks are kept"
        if lost(error):
            raise ConnectionError(
                f"a worker or the scheduler was lost ({type(error).__name__}) {kept}: see that "
                f"they run and have memory enough, and {remedy} to go on"
            ) from error
        if isinstance(error, OSError):
            raise OSError(
                error.errno or errno.EIO,
                f"{error.strerror or error} {kept}: {remedy} to go on",
            ) from error
        raise
