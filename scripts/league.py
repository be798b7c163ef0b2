"""One table and one picture for every learner: neurons, the network, RL agents, silence, an oracle.

    python scripts/league.py                       the quick size, one class: minutes
    python scripts/league.py --size full --jobs 16
    python scripts/league.py --part rl --seeds 100-104 --jobs 4

All hear the same patterns and are scored on the same streams; they are compared at the same number
of bins heard, and with each one's whole budget. Each training is one process, and one block of the
store: a run that is stopped goes on from what is there.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("league", "pictures,reproduce,rl"):
    from experiments.league import PARTS, league
    from figures_league import draw, read_league, rows, text_table
    from sweep import pattern_seeds, sweep

RESULTS = Path("results") / "league"


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Compute what is missing, then print and draw what is there."""
    if options.jobs < 1:
        raise ValueError(f"--jobs must be at least 1, got {options.jobs}")
    if options.steps is not None and options.steps < 1:
        raise ValueError(f"--steps must be at least 1, got {options.steps}")
    folder = options.out or RESULTS / options.size
    _one_thread()
    for part in () if options.so_far else options.part or PARTS:
        wanted = league(part, options.size, options.seeds, options.steps)
        with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as executor:
            sweep(wanted, folder / part, executor, repair=options.repair)
    results = [read_league(folder / part) for part in PARTS if (folder / part).exists()]
    if not results:
        raise ValueError(f"there is no league in {folder}: leave --so-far out to train one")
    table = rows(results)
    print(text_table(table))
    pictures = draw(results, folder)
    return {"table": table, "pictures": [str(path) for path in pictures], "store": str(folder)}


def _one_thread() -> None:
    """Each process started from here keeps to one core, so that times can be compared."""
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--size", choices=("quick", "full"), default="quick", help="default: %(default)s")
    add("--part", choices=PARTS, action="append", help="only this half; default: both")
    add("--seeds", type=pattern_seeds, metavar="SEEDS", help="pattern seeds: 10, 3,5,8 or 100-104")
    add(
        "--jobs", type=int, default=1, metavar="N", help="trainings at a time; default: %(default)s"
    )
    add("--steps", type=int, metavar="N", help="bins that RL agents hear, to try things out")
    add("--out", type=Path, metavar="FOLDER", help=f"default: {RESULTS}/SIZE")
    add("--so-far", action="store_true", help="train nothing: print and draw what is finished")
    add("--repair", action="store_true", help="compute damaged blocks again")
    add("--json", action="store_true", help="end with one JSON object")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    chosen = parse()
    commandline.run(lambda: main(chosen), as_json=chosen.json, name="league", resumes=True)
