"""Training the agents that come with the package: with the best settings that are known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from agents.evaluation import bootstrap_interval, noisy_performance
from agents.experiments.design import Setting
from agents.experiments.rules import LEARNERS
from agents.experiments.training import make_agent, training_seed
from agents.experiments.tuning import chosen_settings, entries, for_trials
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

BY_HAND: dict[str, tuple[str, int]] = {
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
"""Learner of `agents.experiments.rules` and number of classes of some agents, by their names."""

CLASSES = 2
"""Number of classes for which every entry of the league has an agent."""

ABOVE_SILENCE = 2.0
"""An agent is kept if it survives so many times as long as one that never spikes."""


def candidates() -> dict[str, tuple[list[Setting], int]]:
    """The settings that are tried for each agent, and its number of classes, by its name.

    Every entry of the league on two classes, with the settings that the league's search found, and
    those of BY_HAND; where both have the name, both settings are tried.
    """
    found: dict[str, tuple[list[Setting], int]] = {
        name: ([LEARNERS[learner]], classes) for name, (learner, classes) in BY_HAND.items()
    }
    for entry, setting in chosen_settings().items():
        name = f"{agent_name(entry)}-{CLASSES}"
        found.setdefault(name, ([], CLASSES))[0].append(for_trials(setting, TRIALS))
    return found


def agent_name(entry: str) -> str:
    """The name of an entry's agents, less the number of classes: "gnm-critical-amount"."""
    _, _, *variant = entry.split(", ")
    kinds = entries()[entry]
    return "-".join([kinds["neuron"], kinds["rule"], *variant])


def make(folder: Path = HERE) -> dict[str, Any]:
    """Train, choose, score and save every agent; returns what `scores.json` holds.

    Entries that do not learn, by ABOVE_SILENCE, have no agent.
    """
    table = {name: _made(folder, name, *one) for name, one in sorted(candidates().items())}
    kept = {name: one for name, one in table.items() if one is not None}
    with atomic_write(folder / SCORES) as file:
        file.write((json.dumps(kept, indent=1, ensure_ascii=False) + "\n").encode())
    return kept


def _made(folder: Path, name: str, tried: list[Setting], classes: int) -> dict[str, Any] | None:
    task = Task(n_classes=classes)
    best: tuple[float, Any, int, Setting] | None = None
    for setting in tried:
        for seed in PATTERN_SEEDS:
            patterns = Patterns.draw(task, seed)
            agent = make_agent({"pattern_seed": seed, **setting}, task)
            train_many([agent], task, patterns, TRIALS, training_seed(classes, seed), threads=1)
            choice = noisy_performance(agent, task, patterns, seed=CHOICE_SEED, threads=1).mean()
            if best is None or choice > best[0]:
                best = (float(choice), agent, seed, setting)
    assert best is not None
    _, agent, seed, setting = best
    patterns = Patterns.draw(task, seed)
    survived = noisy_performance(agent, task, patterns, seed=SCORE_SEED, threads=1)
    if survived.mean() < ABOVE_SILENCE * task.silent_score:
        return None
    agent.save(folder / f"{name}.npz", task=task, patterns=patterns)
    low, high = bootstrap_interval(survived)
    return {
        "settings": setting,
        "pattern_seed": seed,
        "trials": TRIALS,
        "score": {
            "mean": float(survived.mean()), "low": low, "high": high,
            "runs": RUNS, "cap": MAX_EPISODE_BINS, "seed": SCORE_SEED,
        },
    }  # fmt: skip
