"""Compute an experiment, block by block, into its store. May be stopped and started at will.

python scripts/sweep.py F3 --size quick
python scripts/sweep.py F3 --size paper --scheduler tcp://node1:8786
"""

from __future__ import annotations

import argparse
import errno
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("sweep", "reproduce"):
    from experiments.design import Block, Experiment
    from experiments.registry import NAMES, SIZES, experiment
    from experiments.training import LARGEST_SEED
    from progress import Progress, duration
    from store import Store, Summary, open_store, summarise
    from workers import Outcome, cluster, lost, threads, timed

RESULTS = Path("results")


def sweep(
    experiment: Experiment,
    folder: Path,
    executor: Executor,
    *,
    repair: bool = False,
    interval: float = 60.0,
) -> Summary:
    """Compute what is missing in the store at `folder`; returns its summary.

    Args:
        experiment: what to compute.
        folder: its store, made if need be.
        executor: where blocks are computed.
        repair: compute damaged blocks again, instead of refusing the store.
        interval: seconds between lines of progress where there is no terminal.

    Raises StoreError, OSError (with the number of blocks that are kept; ConnectionError if workers
    are gone), or what a block raises.
    """
    with open_store(folder, experiment, repair=repair) as store:
        pending, total = store.pending(), len(experiment.blocks())
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
                f"a worker or the scheduler was lost ({type(error).__name__}) {kept}: "
                f"see that they run and have memory enough, and {remedy} to go on"
            ) from error
        if isinstance(error, OSError):
            raise OSError(
                error.errno or errno.EIO,
                f"{error.strerror or error} {kept}: {remedy} to go on",
            ) from error
        raise


def workers(
    scheduler: str | None = None, count: int | None = None
) -> AbstractContextManager[Executor]:
    """The cluster at `scheduler`, or `count` threads of this process."""
    if count is not None and count < 1:
        raise ValueError(f"--threads must be at least 1, got {count}")
    return cluster(scheduler) if scheduler else threads(count)


def pattern_seeds(text: str) -> tuple[int, ...]:
    """ "10" means seeds 0 … 9, "3,5,8" these three, "10-19" these ten."""
    try:
        if "," in text:
            seeds: Sequence[int] = [int(part) for part in text.split(",") if part]
        elif "-" in text:
            first, last = text.split("-")
            seeds = range(int(first), int(last) + 1)
        else:
            seeds = range(int(text))
    except ValueError:
        seeds = ()
    if not seeds:
        raise argparse.ArgumentTypeError(
            f"expected a number of seeds (10), a list (3,5,8) or a range (10-19), got {text!r}"
        )
    # By the ends: a tuple of all of them might not fit in memory.
    if not 0 <= min(seeds[0], seeds[-1]) <= max(seeds[0], seeds[-1]) <= LARGEST_SEED:
        raise argparse.ArgumentTypeError(
            f"pattern seeds must be in 0 … {LARGEST_SEED}, got {text!r}"
        )
    return tuple(seeds)


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Options that every script that computes has."""
    parser.add_argument("--size", choices=SIZES, default="quick", help="default: %(default)s")
    parser.add_argument("--threads", type=int, metavar="N", help="default: one per core")
    parser.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="a running Dask scheduler")
    parser.add_argument("--repair", action="store_true", help="compute damaged blocks again")
    parser.add_argument("--json", action="store_true", help="end with one JSON object")


def described(summary: Summary) -> dict[str, Any]:
    """A summary for JSON."""
    return {
        "blocks": summary.blocks,
        "done": summary.done,
        "block_seconds": round(summary.seconds, 1),
        "wall_seconds": round(summary.wall, 1),
        "commits": list(summary.commits),
    }


def main(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run the sweep that the command line asks for."""
    wanted = experiment(arguments.name, arguments.size, arguments.seeds)
    if arguments.seeds and all(axis.name != "pattern_seed" for axis in wanted.axes):
        raise ValueError(f"{wanted.name} has no pattern seeds: leave --seeds out")
    folder = arguments.store or RESULTS / arguments.size / wanted.name
    with workers(arguments.scheduler, arguments.threads) as executor:
        summary = sweep(wanted, folder, executor, repair=arguments.repair)
    print(
        f"{wanted.name}: {wanted.cells:,} cells in {summary.blocks} blocks, "
        f"{duration(summary.wall)} of work, in {folder}"
    )
    return {"experiment": wanted.name, "store": str(folder), **described(summary)}


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("name", help="one of " + ", ".join(NAMES))
    add_run_options(parser)
    parser.add_argument(
        "--seeds", type=pattern_seeds, metavar="SEEDS", help="pattern seeds: 10, 3,5,8 or 10-19"
    )
    parser.add_argument("--store", type=Path, help=f"default: {RESULTS}/SIZE/NAME")
    return parser.parse_args()


if __name__ == "__main__":
    options = parse()
    commandline.run(lambda: main(options), as_json=options.json, name="sweep", resumes=True)
