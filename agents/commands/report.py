"""Write a report: on your own agents, or on the paper's claims.

    gnm report results/mine                            your agents' place in the league
    gnm report results/mine --same-as results/again    … and whether both hold the same scores
    gnm report                                         judge the paper's claims

The first two read what gnm_env.results.Recorder wrote; the place is a table here, and a picture in
the folder. The last one writes one page with every figure, from the stores of gnm sweep.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agents.commands.terminal import REPORT, RESULTS, Parser, share
from gnm_env.results import read_results


def options(parser: Parser) -> None:
    add = parser.add_argument
    add("folder", type=Path, nargs="?", help="results of your agents (default: the paper's claims)")
    add("--same-as", type=Path, metavar="FOLDER", help="other results; exit code 1 if they differ")
    share(parser, "--size")
    share(parser, "--results")
    share(parser, "--out", help=f"(default {REPORT}, or the folder of the results)")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Write the report that the command line asks for."""
    if options.folder is not None:
        return _placed(options.folder, options.out or options.folder, options.same_as)
    if options.same_as is not None:
        raise ValueError("--same-as compares with the results in a folder: name that folder too")
    from agents.experiments.report import write

    place = options.results or RESULTS / options.size
    written = write(place, options.size, options.out or REPORT)
    print_verdicts(written)
    return written


def print_verdicts(written: Mapping[str, Any]) -> None:
    """One line per claim, and where the page is."""
    for claim, verdict in written["verdicts"].items():
        print(f"{claim:4s} {verdict}")
    print(f"report: {written['report']}")


def _placed(folder: Path, out: Path, same_as: Path | None) -> dict[str, Any]:
    """Place the agents of a folder in the league; compare two folders, if there is another."""
    from agents.suite.placing import place

    # First: what cannot be read is told before anything is printed.
    differences = None if same_as is None else differing(folder, same_as)
    placing = place(folder)
    print(placing.text())
    pictures = placing.draw(out)
    print(f"\npicture: {pictures[0]}")
    told: dict[str, Any] = {
        "rows": list(placing.rows),
        "notes": list(placing.notes),
        "pictures": [str(path) for path in pictures],
    }
    if differences is not None:
        lines = differences or [f"{folder} and {same_as} hold the same scores, bin by bin"]
        print("\n".join(lines))
        told |= {"differences": differences, "failed": bool(differences)}
    return told


def differing(one: Path, other: Path) -> list[str]:
    """A line for each training whose scores are not the same numbers in both folders."""
    tables = [
        {(r.learner, r.level, r.pattern_seed): r for r in read_results(folder)}
        for folder in (one, other)
    ]
    lines = []
    for key in sorted(tables[0].keys() | tables[1].keys()):
        name = f"{key[0]}, {key[1]}, pattern seed {key[2]}"
        first, second = tables[0].get(key), tables[1].get(key)
        if first is None or second is None:
            lines.append(f"{name}: only in {other if first is None else one}")
            continue
        scores = [[(s.heard, s.survived) for s in r.scores] for r in (first, second)]
        if scores[0] != scores[1]:
            means = [r.last.mean for r in (first, second)]
            lines.append(f"{name}: other scores, {means[0]:,.2f} and {means[1]:,.2f} bins at last")
    return lines
