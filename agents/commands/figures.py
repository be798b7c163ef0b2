"""Draw the figures from finished stores. Nothing is trained.

gnm figures                 every figure whose data are there
gnm figures F3 F7 --size paper
"""

from __future__ import annotations

import argparse
from typing import Any

from agents.commands.terminal import RESULTS, Parser, share
from agents.experiments.figures import draw, load
from agents.experiments.listing import pictures


def options(parser: Parser) -> None:
    parser.add_argument("names", nargs="*", help="(default all of " + ", ".join(pictures()) + ")")
    share(parser, "--size")
    share(parser, "--results")
    share(parser, "--out", help=f"(default {RESULTS}/SIZE/figures)")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Draw what the command line asks for."""
    known = pictures()
    unknown = [name for name in options.names if name not in known]
    if unknown:
        raise ValueError(f"there is no figure {unknown[0]!r}: choose from {', '.join(known)}")
    chosen = {name: known[name] for name in options.names or known}
    needed = sorted({need for picture in chosen.values() for need in picture.needs})
    results, absent = load(options.results or RESULTS / options.size, needed)
    drawn = draw(chosen, results, options.out or RESULTS / options.size / "figures")
    for line in absent:
        print(f"left out: {line}")
    for name, paths in drawn.items():
        print(f"{name}: {paths['pdf']}, {paths['png']}")
    if not drawn:
        raise ValueError("no figure could be drawn: run gnm reproduce first")
    return {
        "figures": {name: {k: str(p) for k, p in paths.items()} for name, paths in drawn.items()}
    }
