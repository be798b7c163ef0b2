"""Score a saved agent of any kind: noisy performance, mistakes, responses to each class.

    gnm evaluate runs/train/agent.npz
    gnm evaluate runs/ppo-cost

A model of Stable-Baselines3 holds pickled objects, which may run any program when they are opened:
one that no run of yours wrote is opened with --trust alone.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from agents import load_checkpoint
from agents.commands.scoring import report, score
from agents.commands.terminal import EVALUATION_SEED, Parser, at_least, share
from gnm_env import Patterns, Task
from gnm_env.rules import MAX_EPISODE_BINS


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("checkpoint", type=Path, help="a file of gnm train or a folder of gnm train-rl")
    share(parser, "--runs")
    add("--cap", type=at_least(1), default=MAX_EPISODE_BINS, metavar="N",
        help=f"most bins per run (default {MAX_EPISODE_BINS})")
    add("--trials", type=at_least(1), default=2_000, metavar="N",
        help="trials for the table of responses (default 2000)")
    share(parser, "--seed", default=EVALUATION_SEED, help="of the first stream")
    share(parser, "--pattern-seed", help="other patterns than those it was saved with")
    share(parser, "--import")
    share(parser, "--trust")
    # fmt: on


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Score, and print the score."""
    began = time.monotonic()
    agent, task, patterns = loaded(options.checkpoint, options.pattern_seed, options.trust)
    result = score(
        agent, task, patterns,
        runs=options.runs, cap=options.cap, seed=options.seed, trials=options.trials,
    )  # fmt: skip
    print(report(result))
    return result | {"seconds": time.monotonic() - began, "checkpoint": str(options.checkpoint)}


def loaded(
    path: Path, pattern_seed: int | None = None, trust: bool = False
) -> tuple[Any, Task, Patterns]:
    """A saved agent with its task and patterns; ValueError if it was saved without them."""
    agent, task, patterns = _opened(path, trust)
    if task is None:
        raise ValueError(
            f"{path} was saved without its task: save it with "
            "agent.save(path, task=task, patterns=patterns)"
        )
    if pattern_seed is not None:
        patterns = Patterns.draw(task, pattern_seed)
    if patterns is None:
        raise ValueError(f"{path} was saved without its patterns: name them with --pattern-seed")
    return agent, task, patterns


def _opened(path: Path, trust: bool) -> tuple[Any, Task | None, Patterns | None]:
    if not path.is_dir():
        saved = load_checkpoint(path)
        return saved.agent, saved.task, saved.patterns
    from agents import rl
    from agents.rl.checkpoint import BEST, MODEL
    from agents.rl.trust import require_trust

    require_trust(trust, path / MODEL, path / BEST)
    return rl.load(path)
