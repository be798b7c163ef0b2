"""Draw how a neuron works.

gnm show hysteresis                       figures 1c and 1d of the paper
gnm show responses runs/train/agent.npz   V(t) of a trained agent over each class
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from agents.commands.evaluate import loaded
from agents.commands.terminal import Parser, share
from agents.experiments.constant_input import both_levels, draw
from agents.plotting import plot_responses, save


def options(parser: Parser) -> None:
    add = parser.add_argument
    add("what", choices=("hysteresis", "responses"), nargs="?", default="hysteresis")
    add("checkpoint", type=Path, nargs="?", help="for responses: a saved agent")
    share(parser, "--import")
    share(parser, "--out", default=Path("runs/show"))


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Draw what the command line asks for."""
    if options.what == "hysteresis":
        figure = draw(*both_levels())
    elif options.checkpoint is None:
        raise ValueError("responses needs a checkpoint: gnm show responses CHECKPOINT")
    else:
        figure = plot_responses(*loaded(options.checkpoint))
    path = save(figure, options.out, options.what, ("png",))["png"]
    print(f"picture {path}")
    return {"picture": str(path)}
