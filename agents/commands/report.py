"""Judge the paper's claims and write the report, one page with every figure, from the stores."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from agents.commands.terminal import REPORT, RESULTS, Parser, share
from agents.experiments.report import write


def options(parser: Parser) -> None:
    share(parser, "--size")
    share(parser, "--results")
    share(parser, "--out", default=REPORT)


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Write the report that the command line asks for."""
    written = write(options.results or RESULTS / options.size, options.size, options.out)
    print_verdicts(written)
    return written


def print_verdicts(written: Mapping[str, Any]) -> None:
    """One line per claim, and where the page is."""
    for claim, verdict in written["verdicts"].items():
        print(f"{claim:4s} {verdict}")
    print(f"report: {written['report']}")
