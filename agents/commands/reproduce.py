"""Run every experiment of the paper, draw its figures and write the report with the verdicts.

    gnm reproduce                 minutes: few seeds, coarse grids
    gnm reproduce --size paper    the paper's own size, under an hour on two cores

May be stopped at any moment: what is finished is kept, and the next start goes on from there.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

from agents.commands.forensics import search
from agents.commands.report import print_verdicts
from agents.commands.sweep import described, workers
from agents.commands.terminal import REPORT, RESULTS, Parser, share, share_run
from agents.experiments.forensics import SIZES
from agents.experiments.forensics_page import write as write_forensics
from agents.experiments.listing import experiment, experiments
from agents.experiments.progress import duration
from agents.experiments.report import FORENSICS, write
from agents.experiments.sweep import sweep

RESUMES = True


def options(parser: Parser) -> None:
    share_run(parser)
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help="some experiments: " + ", ".join(experiments())
    )
    share(parser, "--results")
    share(parser, "--out", default=REPORT, help="folder of the report")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Run what the command line asks for."""
    began = time.monotonic()
    wanted = [experiment(name, options.size) for name in options.only or experiments()]
    results = options.results or RESULTS / options.size
    costs = {}
    with workers(options) as executor:
        for one in wanted:
            summary = sweep(one, results / one.name, executor, repair=options.repair)
            costs[one.name] = described(summary)
            print(f"{one.name}: {one.cells:,} cells, {duration(summary.wall)} of work", flush=True)
        if not options.only:
            size = SIZES[options.size]
            search(size, results, executor, repair=options.repair)
            write_forensics(size, results, options.size, options.out / FORENSICS)
    written = write(results, options.size, options.out)
    print_verdicts(written)
    seconds = time.monotonic() - began
    print(f"this run: {duration(seconds)}")
    return {**written, "experiments": costs, "seconds": round(seconds, 1)}
