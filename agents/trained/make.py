"""Training the agents that come with the package: by the best settings of the rules' comparison."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from agents.evaluation import bootstrap_interval, noisy_performance
from agents.experiments.rules import LEARNERS
from agents.experiments.training import make_agent, training_seed
from agents.trained import HERE, SCORES
from agents.training.many import train_many
from gnm_env.files import atomic_write
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.task import Patterns, Task

PATTERN_SEEDS = range(200, 206)
"""Each entry is trained on so many sets of patterns; the one that scores best is kept."""

CHOICE_SEED, SCORE_SEED = 5_000_000, 6_000_000
"""First streams on which the best is chosen, and on which it is scored."""

TRIALS = 60_000

ENTRIES: dict[str, tuple[str, int]] = {
    "gnm-all-1": ("A: GNM, ALL, paper", 1),
    "gnm-critical-1": ("A: GNM, CriticalThreshold, tuned", 1),
    "gnm-critical-2": ("A: GNM, CriticalThreshold, tuned", 2),
    "gnm-critical-3": ("A: GNM, CriticalThreshold, tuned", 3),
    "lif-critical-2": ("A: LIF, CriticalThreshold, falling", 2),
    "mst-critical-2": ("A: MST, CriticalThreshold, tuned", 2),
    "gnm-critical-amount-4": ("A′: GNM, CriticalThreshold amount, tuned", 4),
    "gnm-peak-error-2": ("B: GNM, PeakError, tuned", 2),
    "gnm-peak-error-3": ("B: GNM, PeakError, tuned", 3),
    "gnm-peak-error-4": ("B: GNM, PeakError, tuned", 4),
    "mst-peak-error-2": ("B: MST, PeakError, tuned", 2),
}
"""Settings and number of classes of each agent, by its name."""


def make(folder: Path = HERE) -> dict[str, Any]:
    """Train, choose, score and save every agent; returns what `scores.json` holds."""
    table = {name: _made(folder, name, *entry) for name, entry in ENTRIES.items()}
    with atomic_write(folder / SCORES) as file:
        file.write((json.dumps(table, indent=1, ensure_ascii=False) + "\n").encode())
    return table


def _made(folder: Path, name: str, learner: str, classes: int) -> dict[str, Any]:
    task = Task(n_classes=classes)
    best: tuple[float, Any, Any] | None = None
    for seed in PATTERN_SEEDS:
        patterns = Patterns.draw(task, seed)
        agent = make_agent({"pattern_seed": seed, **LEARNERS[learner]}, task)
        train_many([agent], task, patterns, TRIALS, training_seed(classes, seed), threads=1)
        mean = float(noisy_performance(agent, task, patterns, seed=CHOICE_SEED, threads=1).mean())
        if best is None or mean > best[0]:
            best = (mean, agent, seed)
    assert best is not None
    _, agent, seed = best
    patterns = Patterns.draw(task, seed)
    agent.save(folder / f"{name}.npz", task=task, patterns=patterns)
    survived = noisy_performance(agent, task, patterns, seed=SCORE_SEED, threads=1)
    low, high = bootstrap_interval(survived)
    return {
        "settings": LEARNERS[learner],
        "pattern_seed": seed,
        "trials": TRIALS,
        "score": {
            "mean": float(survived.mean()), "low": low, "high": high,
            "runs": RUNS, "cap": MAX_EPISODE_BINS, "seed": SCORE_SEED,
        },
    }  # fmt: skip
