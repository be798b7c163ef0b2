"""Print the reference table: every neuron and rule on one to four classes, beside the prototype.

gnm reference-table --size paper     48 pattern seeds; computed first if need be
"""

from __future__ import annotations

import argparse
from typing import Any

from agents.commands.sweep import workers
from agents.commands.terminal import RESULTS, Parser, share, share_run
from agents.experiments.listing import experiment
from agents.experiments.store import read
from agents.experiments.sweep import sweep
from agents.experiments.table import REFERENCE, reference

LOWEST = 1 / 1.6
"""A mean below this share of the prototype's, on one or two classes, is marked."""

RESUMES = True


def options(parser: Parser) -> None:
    share_run(parser)
    share(parser, "--seeds")
    share(parser, "--store", help=f"(default {RESULTS}/SIZE/table)")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Compute what is missing, and print."""
    wanted = experiment("table", options.size, options.seeds)
    folder = options.store or RESULTS / options.size / wanted.name
    with workers(options) as executor:
        sweep(wanted, folder, executor, repair=options.repair)
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
    ratios = {name: [cell.ratio for cell in cells] for name, cells in table.items()}
    return {"store": str(folder), "ratios": ratios, "prototype": REFERENCE, "low": low}
