"""Find the protocol that explains the paper's numbers best, by a search fixed in advance.

    gnm forensics                 two minutes: few ways of training, few seeds
    gnm forensics --size paper    432 ways of training; under half an hour on two cores

The ways, the rule that scores them and the hypotheses stand in agents/experiments/forensics.py. May
be stopped at any moment: what is finished is kept, and the next start goes on from there.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from agents.commands.sweep import workers
from agents.commands.terminal import REPORT, RESULTS, Parser, share, share_run
from agents.experiments.design import Experiment
from agents.experiments.forensics import (
    SIZES,
    Size,
    best,
    coarse,
    conditions,
    confirmed,
    fine,
    ranking,
)
from agents.experiments.forensics_page import write
from agents.experiments.progress import duration
from agents.experiments.store import read
from agents.experiments.sweep import sweep
from agents.experiments.workers import Executor

RESUMES = True
FORENSICS = REPORT / "forensics"
"""Beside the report on the claims, which shows what it finds there."""


def options(parser: Parser) -> None:
    share_run(parser)
    share(parser, "--results")
    share(parser, "--out", default=FORENSICS)


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Run all stages; write forensics.json, forensics.md and figures/ in `--out`."""
    results = options.results or RESULTS / options.size
    size = SIZES[options.size]
    with workers(options) as executor:
        search(size, results, executor, repair=options.repair)
    told = write(size, results, options.size, options.out)
    for one in told["protocols"]:
        print(f"{one['points']} points, {one['back']} of {len(told['numbers'])}: {one['name']}")
    for one in told["hypotheses"]:
        print(f"{one['verdict']}: {one['words']} ({one['numbers']})")
    return {"forensics": str(options.out), "best": told["protocols"][0]["name"]}


def search(size: Size, results: Path, executor: Executor, *, repair: bool = False) -> None:
    """Compute what is missing of the stages, each of which follows from the one before."""

    def computed(wanted: Experiment) -> Any:
        summary = sweep(wanted, results / wanted.name, executor, repair=repair)
        print(f"{wanted.name}: {wanted.cells:,} neurons, {duration(summary.wall)}", flush=True)
        return read(results / wanted.name)

    first = computed(coarse(size))
    second = computed(fine(size, first))
    computed(confirmed(size, best(size, ranking(size, first, second))))
    computed(conditions(size))
