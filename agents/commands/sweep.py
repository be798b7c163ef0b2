"""Compute an experiment, block by block, into its store. May be stopped and started at will.

    gnm sweep F3 --size quick
    gnm sweep F3 --size paper --scheduler tcp://node1:8786
    gnm sweep my_experiment.py:experiment

Your own is an Experiment, or a function of the size and the pattern seeds that makes one (see
agents.experiments.training).
"""

from __future__ import annotations

import argparse
from contextlib import AbstractContextManager
from typing import Any

from agents.commands.terminal import RESULTS, Parser, share, share_run
from agents.experiments.listing import experiment, experiments
from agents.experiments.progress import duration
from agents.experiments.store import Summary
from agents.experiments.sweep import sweep
from agents.experiments.workers import Executor, cluster, threads

RESUMES = True


def options(parser: Parser) -> None:
    parser.add_argument(
        "name", help=f"{', '.join(experiments())}, or your own as module:name or file.py:name"
    )
    share_run(parser)
    share(parser, "--seeds")
    share(parser, "--store")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Run the sweep that the command line asks for."""
    wanted = experiment(options.name, options.size, options.seeds)
    folder = options.store or RESULTS / options.size / wanted.name
    with workers(options) as executor:
        summary = sweep(wanted, folder, executor, repair=options.repair)
    print(
        f"{wanted.name}: {wanted.cells:,} cells in {summary.blocks} blocks, "
        f"{duration(summary.wall)} of work, in {folder}"
    )
    return {"experiment": wanted.name, "store": str(folder), **described(summary)}


def workers(options: argparse.Namespace) -> AbstractContextManager[Executor]:
    """The cluster that the options name, or threads of this process."""
    if not options.scheduler:
        return threads(options.threads)
    path = getattr(options, "name", "").rpartition(":")[0]
    return cluster(options.scheduler, [path] if path.endswith(".py") else [])


def described(summary: Summary) -> dict[str, Any]:
    """A summary for JSON."""
    return {
        "blocks": summary.blocks,
        "done": summary.done,
        "block_seconds": round(summary.seconds, 1),
        "wall_seconds": round(summary.wall, 1),
        "commits": list(summary.commits),
    }
