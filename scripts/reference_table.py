"""Print the reference table: every neuron and rule on one to four classes, beside the prototype.

python scripts/reference_table.py --size paper     48 pattern seeds; computed first if need be
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("reference_table", "reproduce"):
    from experiments.methods import REFERENCE
    from experiments.registry import experiment
    from report import reference
    from store import read
    from sweep import RESULTS, add_run_options, pattern_seeds, sweep, workers

LOWEST = 1 / 1.6
"""A mean below this share of the prototype's, on one or two classes, is marked."""


def main(arguments: argparse.Namespace) -> dict[str, Any]:
    """Compute what is missing, and print."""
    wanted = experiment("table", arguments.size, arguments.seeds)
    folder = arguments.store or RESULTS / arguments.size / wanted.name
    with workers(arguments.scheduler, arguments.threads) as executor:
        sweep(wanted, folder, executor, repair=arguments.repair)
    data = read(folder)
    table = reference({"table": data})
    low = [
        f"{name}, C = {classes}"
        for name, cells in table.items()
        for classes, cell in zip((1, 2), cells, strict=False)
        if cell.ratio < LOWEST
    ]
    print(f"mean [95 % interval] / median over {data.sizes['pattern_seed']} pattern seeds")
    print("(× our mean over the prototype's)")
    for name, cells in table.items():
        print(name)
        for classes, cell in enumerate(cells, 1):
            print(
                f"   C = {classes}   {cell.mean} / {cell.median}   "
                f"prototype {cell.reference}   (× {cell.ratio:.2f})"
            )
    print("means below the prototype's over 1.6, C = 1 and 2: " + ("; ".join(low) or "none"))
    means = {name: [cell.ratio for cell in cells] for name, cells in table.items()}
    return {"store": str(folder), "ratios": means, "prototype": REFERENCE, "low": low}


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    add_run_options(parser)
    parser.add_argument(
        "--seeds", type=pattern_seeds, metavar="SEEDS", help="pattern seeds: 10, 3,5,8 or 10-19"
    )
    parser.add_argument("--store", type=Path, help=f"default: {RESULTS}/SIZE/table")
    return parser.parse_args()


if __name__ == "__main__":
    options = parse()
    commandline.run(
        lambda: main(options), as_json=options.json, name="reference_table", resumes=True
    )
