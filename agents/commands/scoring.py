"""The score of an agent as the command line prints it and gives it to other programs."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents import answers, bootstrap_interval, mistake_rate, noisy_performance
from agents.commands.terminal import EVALUATION_SEED
from gnm_env import Patterns, Task
from gnm_env.rules import MAX_EPISODE_BINS, RUNS


def score(
    agent: Any,
    task: Task,
    patterns: Patterns,
    *,
    runs: int = RUNS,
    cap: int = MAX_EPISODE_BINS,
    seed: int = EVALUATION_SEED,
    trials: int = 2_000,
) -> dict[str, Any]:
    """Noisy performance, mistake rate and answers per class of `agent`, ready for JSON."""
    survived = noisy_performance(agent, task, patterns, runs=runs, cap=cap, seed=seed)
    rate = mistake_rate(survived, cap)
    given = answers(agent, task, patterns, trials=trials, seed=seed + runs)
    return {
        "noisy_performance": {
            "mean": float(survived.mean()),
            "median": float(np.median(survived)),
            "ci95": list(bootstrap_interval(survived)),
            "runs": runs,
            "cap": cap,
        },
        "mistakes_per_10000_bins": rate.rate,
        "mistakes_per_10000_bins_ci95": [rate.low, rate.high],
        "silent_score": task.silent_score,
        "error_rate": float(given.wrong[0]) / given.trials,
        "answers": {
            "owed": list(task.owed),
            "spikes_given": given.table[0].tolist(),
            "false_positives_per_1000_noise_bins": 1000.0
            * float(given.false_positives[0])
            / given.noise_bins,
        },
    }


def report(result: dict[str, Any]) -> str:
    """The score as a person reads it."""
    performance = result["noisy_performance"]
    low, high = performance["ci95"]
    rate_low, rate_high = result["mistakes_per_10000_bins_ci95"]
    lines = [
        f"noisy performance  {performance['mean']:,.0f} bins "
        f"(95 % interval {low:,.0f} … {high:,.0f}, median {performance['median']:,.0f}; "
        f"{performance['runs']} runs, cap {performance['cap']:,})",
        f"silence would get  {result['silent_score']:,.0f} bins",
        f"mistakes           {result['mistakes_per_10000_bins']:.2f} per 10,000 bins "
        f"({rate_low:.2f} … {rate_high:.2f})",
        f"wrong trials       {100 * result['error_rate']:.1f} %",
        *_table(result["answers"]),
    ]
    return "\n".join(lines)


def _table(given: dict[str, Any]) -> list[str]:
    """Responses to each class: how often each number of spikes was given."""
    table = np.array(given["spikes_given"])
    most = max(int(np.flatnonzero(table.sum(axis=0)).max(initial=0)), *given["owed"], 1)
    last = table.shape[1] - 1
    heads = [f"{k}+" if k == last else str(k) for k in range(most + 1)]
    lines = ["", "responses: of the presentations of each class, % given so many spikes"]
    lines.append(f"  {'class':>5} {'owed':>4}  " + "".join(f"{head:>8}" for head in heads))
    for class_, (owed, row) in enumerate(zip(given["owed"], table, strict=True)):
        shares = 100.0 * row[: most + 1] / max(row.sum(), 1)
        cells = "".join(
            f"[{share:5.1f}]".rjust(8) if spikes == owed else f"{share:7.1f} "
            for spikes, share in enumerate(shares)
        )
        lines.append(f"  {class_:>5} {owed:>4}  {cells}")
    rate = given["false_positives_per_1000_noise_bins"]
    lines.append(f"  false positives: {rate:.2f} per 1,000 bins of noise")
    return lines
