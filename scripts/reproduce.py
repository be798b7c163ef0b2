"""Run every experiment of the paper, draw its figures and write the report with the verdicts.

    python scripts/reproduce.py                 minutes: few seeds, coarse grids
    python scripts/reproduce.py --size paper    the paper's own size, under an hour on two cores

May be stopped at any moment: what is finished is kept, and the next start goes on from there.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("reproduce", "reproduce"):
    from experiments.registry import NAMES, experiment
    from progress import duration
    from report import REPORT, print_verdicts, write
    from sweep import RESULTS, add_run_options, described, sweep, workers


def main(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run what the command line asks for."""
    began = time.monotonic()
    wanted = [experiment(name, arguments.size) for name in arguments.only or NAMES]
    results = arguments.results or RESULTS / arguments.size
    costs = {}
    with workers(arguments.scheduler, arguments.threads) as executor:
        for one in wanted:
            summary = sweep(one, results / one.name, executor, repair=arguments.repair)
            costs[one.name] = described(summary)
            print(f"{one.name}: {one.cells:,} cells, {duration(summary.wall)} of work", flush=True)
    written = write(results, arguments.size, arguments.out)
    print_verdicts(written)
    seconds = time.monotonic() - began
    print(f"this run: {duration(seconds)}")
    return {**written, "experiments": costs, "seconds": round(seconds, 1)}


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    add_run_options(parser)
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help="some experiments: " + ", ".join(NAMES)
    )
    parser.add_argument("--results", type=Path, help=f"folder of stores; default: {RESULTS}/SIZE")
    parser.add_argument(
        "--out", type=Path, default=REPORT, help="folder of the report; default: %(default)s"
    )
    return parser.parse_args()


if __name__ == "__main__":
    options = parse()
    commandline.run(lambda: main(options), as_json=options.json, name="reproduce", resumes=True)
