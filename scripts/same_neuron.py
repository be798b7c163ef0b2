"""One GNM of 100 weights, taught in different ways, at equal experience.

    python scripts/same_neuron.py --seeds 105-109

Local rules (ALL, CriticalThreshold, PolicyGradient, MSTDPET; `train_many`) beside PPO with the
neuron as its whole policy ("gnm-ppo") and beside PPO on a layer of such neurons ("spiking-ppo").
All hear 1.6 million bins of the same patterns and are scored on the same streams. Local rules have
the settings that the league's search has found on pattern seeds 0 to 3 (for 20,000 trials), with
their rate falling over what they hear here; those of PPO were chosen on pattern seed 50.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # run by itself, from a checkout
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import torch

from agents import noisy_performance, train_many
from agents.commands.terminal import Parser, at_least, run, share
from agents.experiments.training import make_agent
from agents.experiments.tuning import chosen_settings, for_trials
from agents.rl import SB3Agent, make_rl_agent, training_env
from gnm_env import Patterns, Task

RULES = ("GNM, ALL", "GNM, CriticalThreshold", "GNM, PolicyGradient", "GNM, MSTDPET")
RL = (("gnm-ppo", "cost"), ("gnm-ppo", "dense"), ("spiking-ppo", "cost"))
SCORE_SEED = 1_000_000


def options(parser: Parser) -> None:
    share(parser, "--seeds")
    parser.add_argument("--bins", type=at_least(1), default=1_600_000, metavar="N")
    parser.add_argument("--n-classes", type=at_least(1), default=1, metavar="N")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Train, score and print each learner on each pattern seed."""
    torch.set_num_threads(1)
    task = Task(n_classes=options.n_classes)
    seeds = options.seeds or range(105, 110)
    table: dict[str, list[float]] = {}
    for seed in seeds:
        patterns = Patterns.draw(task, seed)
        for name in (*RULES, *(f"{kind}, {feedback}" for kind, feedback in RL)):
            begun = time.monotonic()
            agent = _taught(name, task, patterns, seed, options.bins)
            score = noisy_performance(agent, task, patterns, seed=SCORE_SEED).mean()
            table.setdefault(name, []).append(float(score))
            print(f"{seed} {name:24} {score:7,.0f}  {time.monotonic() - begun:.0f} s", flush=True)
    for name, scores in table.items():
        told = " ".join(f"{score:,.0f}" for score in scores)
        print(f"{name:24} median {np.median(scores):7,.0f}   {told}")
    return {"scores": table, "seeds": list(seeds)}


def _taught(name: str, task: Task, patterns: Patterns, seed: int, bins: int) -> Any:
    if name in RULES:
        trials = round(bins / (task.background_bins + task.mean_pattern_bins))
        setting = for_trials(chosen_settings()[name], trials)
        agent = make_agent({**setting, "pattern_seed": seed}, task)
        train_many([agent], task, patterns, trials, 1_000 * seed)
        return agent
    kind, feedback = name.split(", ")
    env = training_env(task, patterns, kind, feedback=feedback)
    model = make_rl_agent(kind, env, 1_000 * seed).learn(bins)
    env.close()
    return SB3Agent(model, task)


if __name__ == "__main__":
    run(lambda: sys.modules[__name__], sys.argv[1:], "same_neuron.py")
