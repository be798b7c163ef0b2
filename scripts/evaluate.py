"""Score a saved agent of any kind: noisy performance, mistakes, answers per class.

python scripts/evaluate.py runs/train/agent.npz
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import commandline
from agents import load_checkpoint
from gnm_env import Patterns, Task
from scoring import EVALUATION_SEED, report, score


def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "checkpoint", type=Path, help="a file of scripts/train.py or a folder of train_rl.py"
    )
    parser.add_argument("--runs", type=int, default=100, metavar="N", help="(default 100)")
    parser.add_argument(
        "--cap", type=int, default=10_000, metavar="N", help="most bins per run (default 10000)"
    )
    parser.add_argument(
        "--trials", type=int, default=2_000, metavar="N",
        help="trials for the table of answers (default 2000)",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=int, default=EVALUATION_SEED, metavar="N",
        help=f"of the first stream (default {EVALUATION_SEED})",
    )  # fmt: skip
    parser.add_argument(
        "--pattern-seed", type=int, metavar="N", help="other patterns than those it was saved with"
    )
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


def loaded(options: argparse.Namespace) -> tuple[Any, Task, Patterns]:
    """The agent with its task and patterns."""
    agent, task, patterns = _opened(options.checkpoint)
    if task is None:
        raise ValueError(
            f"{options.checkpoint} was saved without its task; save it with "
            "agent.save(path, task=task, patterns=patterns)"
        )
    if options.pattern_seed is not None:
        patterns = Patterns.draw(task, options.pattern_seed)
    if patterns is None:
        raise ValueError(
            f"{options.checkpoint} was saved without its patterns; name them with --pattern-seed"
        )
    return agent, task, patterns


def _opened(path: Path) -> tuple[Any, Task | None, Patterns | None]:
    if not path.is_dir():
        saved = load_checkpoint(path)
        return saved.agent, saved.task, saved.patterns
    try:
        from agents import rl
    except ImportError as error:
        raise ValueError(str(error)) from None
    return rl.load(path)


def main(options: argparse.Namespace) -> dict[str, Any]:
    began = time.monotonic()
    agent, task, patterns = loaded(options)
    result = score(
        agent, task, patterns,
        runs=options.runs, cap=options.cap, seed=options.seed, trials=options.trials,
    )  # fmt: skip
    print(report(result))
    return result | {
        "seconds": time.monotonic() - began,
        "checkpoint": str(options.checkpoint),
    }


if __name__ == "__main__":
    arguments = parser().parse_args()
    commandline.run(lambda: main(arguments), as_json=arguments.json, name="evaluate.py")
