"""One table and one picture for every learner: neurons, the network, RL agents, silence, an oracle.

    gnm league                       the quick size, one class: minutes
    gnm league --size full --jobs 16
    gnm league --part rl --seeds 100-104 --jobs 4

All hear the same patterns and are scored on the same streams; they are compared at the same number
of bins heard, and with each one's whole budget. Each training is one process, and one block of the
store: a run that is stopped goes on from what is there.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from agents.commands.terminal import RESULTS, Parser, at_least, share
from agents.experiments.league import PARTS, draw, league, read_league, rows, text_table
from agents.experiments.sweep import sweep

RESUMES = True


def options(parser: Parser) -> None:
    add = parser.add_argument
    share(parser, "--size", choices=("quick", "full"))
    add("--part", choices=PARTS, action="append", help="only this half (default both)")
    share(parser, "--seeds")
    add("--jobs", type=at_least(1), default=1, metavar="N", help="trainings at a time (default 1)")
    add("--steps", type=at_least(1), metavar="N", help="bins that RL agents hear, to try it out")
    share(parser, "--out", help=f"(default {RESULTS}/league/SIZE)")
    add("--so-far", action="store_true", help="train nothing: print and draw what is finished")
    add("--keep", action="store_true", help="keep the table as the one that gnm report shows")
    share(parser, "--repair")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Compute what is missing, then print and draw what is there."""
    folder = options.out or RESULTS / "league" / options.size
    for part in () if options.so_far else options.part or PARTS:
        wanted = league(part, options.size, options.seeds, options.steps)
        # Each training keeps to one core, so that times can be compared.
        for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
            os.environ[name] = "1"
        with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as executor:
            sweep(wanted, folder / part, executor, repair=options.repair)
    results = [read_league(folder / part) for part in PARTS if (folder / part).exists()]
    if not results:
        raise ValueError(f"there is no league in {folder}: leave --so-far out to train one")
    table = rows(results)
    print(text_table(table))
    pictures = draw(results, folder)
    if options.keep:
        from agents.suite.league import keep

        print(f"kept in {keep(table)}")
    return {"table": table, "pictures": [str(path) for path in pictures], "store": str(folder)}
