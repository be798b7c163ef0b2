"""See a saved agent of any kind answer: in a window, or as a GIF or MP4, with its potential.

    gnm watch runs/train/agent.npz
    gnm watch runs/train/agent.npz --to watch.gif --bins 300

A window needs pip install "gnm-env[rendering]", a file pip install "gnm-env[video]".
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from agents.commands.evaluate import loaded
from agents.commands.terminal import EVALUATION_SEED, Parser, at_least, share
from agents.watching import STREAM, TRIALS, play


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("checkpoint", type=Path, help="a file of gnm train or a folder of gnm train-rl")
    add("--to", type=Path, metavar="FILE", help="a .gif or .mp4 to write (default: a window)")
    add("--hears", choices=(STREAM, TRIALS), default=STREAM,
        help="the endless stream, anew after each mistake, or trials (default stream)")
    add("--bins", type=at_least(1), default=600, metavar="N", help="to be answered (default 600)")
    add("--fps", type=float, default=25.0, metavar="X", help="frames per second (default 25)")
    add("--every", type=at_least(1), default=2, metavar="N",
        help="bins from frame to frame of a file (default 2)")
    add("--scale", type=float, default=1.0, metavar="X",
        help="size of a file's frames, at most 1 (default 1)")
    share(parser, "--seed", default=EVALUATION_SEED, help="of the stream")
    share(parser, "--pattern-seed", help="other patterns than those it was saved with")
    share(parser, "--import")
    share(parser, "--trust")
    # fmt: on


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Show the agent that the command line names."""
    agent, task, patterns = loaded(options.checkpoint, options.pattern_seed, options.trust)
    told = play(
        agent, task, patterns, options.to, hears=options.hears, bins=options.bins,
        seed=options.seed, fps=options.fps, every=options.every, scale=options.scale,
    )  # fmt: skip
    print(f"{told['bins']} bins, {told['mistakes']} mistakes")
    if told["path"]:
        print(f"in {told['path']}")
    return told
