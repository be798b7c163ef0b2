"""What a recurrent agent needs to learn from raw bits: trainings that differ in one thing each.

    python scripts/recurrent.py
    python scripts/recurrent.py --pattern-seed 1 --feedback cost --steps 1600000

Prints the table of docs/reinforcement-learning.md: the kind "recurrent-ppo" as it is, with the
start of PyTorch's LSTM, and without its last action. "as sampled" is the score of answers that are
drawn from the policy, where scores elsewhere take the most likely one.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # run by itself, from a checkout
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import torch

from agents import noisy_performance
from agents.commands.terminal import Parser, at_least, run
from agents.rl import HYPERPARAMETERS, RAW, SB3Agent, make_rl_agent, training_env
from gnm_env import Patterns, Task

KIND = "recurrent-ppo"
_AS_IT_IS = HYPERPARAMETERS[KIND]
VARIANTS = {
    "as it is": _AS_IT_IS,
    "PyTorch's start": replace(_AS_IT_IS, policy="MlpLstmPolicy"),
    "without its last action": replace(_AS_IT_IS, observation=RAW),
    "leaky integrators": HYPERPARAMETERS["leaky-ppo"],
}


class AsSampled:
    """An agent whose answers are drawn from its policy."""

    def __init__(self, agent: SB3Agent) -> None:
        self._agent = agent

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, best: bool = True
    ) -> Any:
        """One draw a bin."""
        return self._agent.predict(observation, state, episode_start, deterministic=False)


def trained(
    name: str, task: Task, patterns: Patterns, options: argparse.Namespace
) -> dict[str, float]:
    """Train and score one variant."""
    HYPERPARAMETERS[name] = VARIANTS[name]
    env = training_env(task, patterns, name, feedback=options.feedback)
    model = make_rl_agent(name, env, seed=options.seed)
    start = time.process_time()
    model.learn(options.steps)
    seconds = time.process_time() - start
    agent = SB3Agent(model, task)
    best, sampled = (
        noisy_performance(one, task, patterns, seed=1_000_000, threads=1).mean()
        for one in (agent, AsSampled(agent))
    )
    return {
        "reward": float(np.mean([episode["r"] for episode in model.ep_info_buffer or ()])),
        "score": float(best),
        "as sampled": float(sampled),
        "bins/s": model.num_timesteps / seconds,
    }


def options(parser: Parser) -> None:
    add = parser.add_argument
    add("--n-classes", type=at_least(1), default=1, metavar="N")
    add("--pattern-seed", type=at_least(0), default=0, metavar="N")
    add("--seed", type=at_least(0), default=0, metavar="N", help="of the training")
    add("--feedback", choices=("cost", "dense"), default="dense")
    add("--steps", type=at_least(1), default=600_000, metavar="N", help="bins to hear")
    add("--only", choices=tuple(VARIANTS), action="append")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Print a row per variant."""
    torch.set_num_threads(1)  # on networks this small, threads only get in each other's way
    task = Task(n_classes=options.n_classes)
    patterns = Patterns.draw(task, options.pattern_seed)
    print("| | reward per trial | score | as sampled | bins/s |\n|---|---|---|---|---|")
    rows = {}
    for name in options.only or VARIANTS:
        rows[name] = trained(name, task, patterns, options)
        reward, best, sampled, speed = rows[name].values()
        print(
            f"| {name} | {reward:.2f} | {best:,.0f} | {sampled:,.0f} | {speed:,.0f} |", flush=True
        )
    return {"rows": rows}


if __name__ == "__main__":
    run(lambda: sys.modules[__name__], sys.argv[1:], "recurrent.py")
