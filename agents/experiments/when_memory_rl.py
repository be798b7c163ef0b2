"""WHEN-RL: at what difficulty an agent of reinforcement learning has to remember.

The situations of `when_memory`, met by policies of Stable-Baselines3 instead of neurons: one that
sees the bits of the present bin, the same one with the traces of the last bins, and one on raw bits
with a memory of its own. All are told how each presentation went (feedback "dense").

Budget and kinds were chosen on pattern seeds 0 and 1; what is reported is heard with seeds 100 to
107.
"""

from __future__ import annotations

import threading
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import noisy_performance
from agents.experiments.design import Axis, Block, Experiment
from agents.experiments.figures import Picture
from agents.experiments.statistics import Interval, by_seed, mean, ratio_of_means, score
from agents.experiments.training import SURVIVED, evaluation_seed, pattern_seeds
from agents.experiments.verdict import Finding, Hypothesis, Results
from agents.experiments.when_memory import (
    NEAR_SILENCE,
    PLAIN,
    SITUATIONS,
    patterns_of,
    silent_score,
    task_of,
)
from agents.plotting import BINS, BLUE, GREY, INK, RED, error_bars, legend_above, panels
from gnm_env.rules import MAX_EPISODE_BINS, RUNS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

# --- the grid ------------------------------------------------------------------------------------

STEPS = (PLAIN, "jitter 1", "jitter 4", "backwards")
AGENTS: dict[str, dict[str, Any]] = {
    "PPO, bits": {"kind": "ppo", "sees": "bits"},
    "PPO, traces": {"kind": "ppo", "sees": "traces"},
    "RecurrentPPO, bits": {"kind": "recurrent-ppo", "sees": "bits"},
}
"""The first has no memory of what it heard."""

BUDGET = {"quick": 400_000, "paper": 1_600_000}
"""Bins heard in training."""
SIZES = {"quick": range(100, 102), "paper": range(100, 108)}
RUN: dict[str, Any] = {"runs": RUNS, "cap": MAX_EPISODE_BINS, "feedback": "dense"}

_ONE_AT_A_TIME = threading.Lock()
"""Stable-Baselines3 and torch draw from generators that all threads of a process share."""


def when_rl(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Every policy in every situation; one training is one block."""
    from agents.rl import HYPERPARAMETERS

    axes = (
        pattern_seeds(seeds or SIZES[size]),
        Axis.named(
            "situation",
            {step: SITUATIONS[step] for step in STEPS},
            long_name="what makes the task harder",
        ),
        Axis.named("agent", AGENTS, long_name="who learns"),
    )
    kinds = {setting["kind"]: HYPERPARAMETERS[setting["kind"]] for setting in AGENTS.values()}
    described = {
        "owed": "1 by the wanted pattern, 0 by the second",
        "seeds": "1000 * pattern_seed for SB3, default_rng(evaluation_seed + run) for the score",
    } | {
        kind: {"observation": asdict(chosen.observation), "n_envs": chosen.n_envs}
        | {name: str(value) for name, value in chosen.settings(chosen.n_envs).items()}
        for kind, chosen in kinds.items()
    }
    return Experiment(
        "WHEN-RL", "When a policy has to remember", axes, {**RUN, "bins": BUDGET[size]}, _compute,
        (SURVIVED,), {"run": RUN["runs"]}, described,
    )  # fmt: skip


def _compute(block: Block) -> dict[str, NDArray[Any]]:
    import torch

    from agents.rl import HYPERPARAMETERS, SB3Agent, make_rl_agent, training_env

    (setting,) = block.settings
    seed, kind, task = setting["pattern_seed"], setting["kind"], task_of(setting)
    patterns = patterns_of(setting, seed)
    # What RecurrentPPO sees: the bits of the present bin, and the last action.
    seen = HYPERPARAMETERS["recurrent-ppo" if setting["sees"] == "bits" else kind].observation
    with _ONE_AT_A_TIME:
        torch.set_num_threads(1)
        env = training_env(task, patterns, kind, feedback=setting["feedback"], observation=seen)
        model = make_rl_agent(kind, env, 1_000 * seed, observation=seen)
        model.learn(setting["bins"])
    survived = noisy_performance(
        SB3Agent(model, task, seen), task, patterns, setting["runs"], setting["cap"],
        evaluation_seed(task.n_classes, seed), threads=1,
    )  # fmt: skip
    return block.shaped(survived=survived[None])


# --- the hypotheses ------------------------------------------------------------------------------


def scores_of(data: xr.Dataset, situation: str, agent: str) -> NDArray[np.float64]:
    """Scores by pattern seed."""
    return by_seed(score(data).sel(situation=situation, agent=agent))


def share(data: xr.Dataset, situation: str, agent: str, other: str) -> Interval:
    """Mean score of an agent over that of another in a situation, bootstrap over seeds."""
    return ratio_of_means(*(scores_of(data, situation, one) for one in (agent, other)))


def _judge_jitter(results: Results) -> Finding:
    data = results["WHEN-RL"]
    without = share(data, "jitter 1", "PPO, bits", "PPO, traces")
    own = share(data, "jitter 1", "RecurrentPPO, bits", "PPO, bits")
    held = {
        "the memory is that of traces": without.below(0.2),
        "the memory is the policy's own": own.above(5),
    }
    found = (f"{agent} {mean(scores_of(data, 'jitter 1', agent)):,.0f}" for agent in AGENTS)
    words = f"at a jitter of one bin: {', '.join(found)} bins"
    ratios = f"bits over traces {without:.0%}, RecurrentPPO over PPO on bits {own:.1f} times"
    return Finding.of(held, (words, ratios))


def _judge_backwards(results: Results) -> Finding:
    data, silent = results["WHEN-RL"], silent_score(SITUATIONS["backwards"])
    held, words = {}, [f"a silent policy {silent:,.0f} bins"]
    for agent, how in AGENTS.items():
        found = mean(scores_of(data, "backwards", agent))
        fails = how == AGENTS["PPO, bits"]
        good = found.below(NEAR_SILENCE * silent) if fails else found.above(5 * silent)
        held[agent] = good
        words.append(f"{agent} {found:,.0f}")
    return Finding.of(held, words, "it is {}")


_PROTOCOL = (
    "one wanted pattern owed 1 spike; PPO on the bits of the present bin and on traces (decay "
    "0.3), RecurrentPPO on those bits, hyperparameters as they come with the package; feedback "
    "dense, 1.6 million bins; pattern seeds 100 to 107"
)

HYPOTHESES = (
    Hypothesis(
        "N6",
        "A policy that sees the present bin alone is lost as soon as spikes move by one bin; the "
        "traces of the last bins, or a memory of its own, make up for it",
        "pattern seeds 0 and 1, jitter 1: PPO on bits 1,413 and 692 bins, on traces 9,023 and "
        "9,826, RecurrentPPO 10,000 twice; without jitter PPO on bits 435 and 9,193",
        _PROTOCOL,
        "holds if, at a jitter of one bin, the mean score of PPO on bits over that of PPO on "
        "traces has an interval below 20 %, and that of RecurrentPPO over that of PPO on bits one "
        "above 5 (bootstrap over seeds)",
        ("WHEN-RL",),
        _judge_jitter,
    ),
    Hypothesis(
        "N7",
        "No policy without a memory tells a pattern from the same played backwards; policies with "
        "one do",
        "pattern seeds 0 and 1: PPO on bits 336 and 333 bins, on traces 8,547 on seed 0; a silent "
        "policy 297",
        _PROTOCOL,
        "holds if the mean score of PPO on bits has an interval below "
        f"{NEAR_SILENCE:g} times that of a silent policy, and those of PPO on traces and of "
        "RecurrentPPO have intervals above 5 times",
        ("WHEN-RL",),
        _judge_backwards,
    ),
)

# --- the figure ----------------------------------------------------------------------------------

_STYLES = {
    "PPO, bits": (RED, "o"),
    "PPO, traces": (BLUE, "^"),
    "RecurrentPPO, bits": (INK, "s"),
}


def _draw(results: Results) -> Figure:
    """Scores by situation: one point per pattern seed, means with intervals."""
    data = results["WHEN-RL"]
    figure, grid = panels(1, 1, width=5.2, height=3.0)
    axes = grid[0, 0]
    for shift, (agent, (colour, mark)) in enumerate(_STYLES.items()):
        for place, step in enumerate(STEPS):
            seeds = scores_of(data, step, agent)
            x = place + 0.22 * (shift - 1)
            axes.plot(np.full(len(seeds), x), seeds, ".", color=colour, ms=3, alpha=0.45)
            label = agent if place == 0 else None
            look = {"color": colour, "ms": 4.5, "elinewidth": 1.4, "label": label}
            error_bars(axes, x, mean(seeds), fmt=mark, **look)
    for place, step in enumerate(STEPS):
        silent = silent_score(SITUATIONS[step])
        axes.hlines(silent, place - 0.4, place + 0.4, color=GREY, ls=":", lw=0.9)
    axes.set_yscale("log")
    axes.set_ylim(100, 13_000)
    axes.set_yticks((100, 300, 1_000, 3_000, 10_000), ("100", "300", "1,000", "3,000", "10,000"))
    axes.minorticks_off()
    axes.set_xticks(range(len(STEPS)), STEPS)
    axes.set_ylabel(BINS)
    legend_above(figure, axes, 3)
    return figure


EXPERIMENTS = {"WHEN-RL": when_rl}
PICTURES = {
    "WHEN-RL": Picture(
        _draw,
        ("WHEN-RL",),
        "One wanted pattern in noise, its spikes moved by up to one or four bins at each "
        "presentation, or beside the same pattern played backwards, which is owed nothing: "
        "policies that see the bits of the present bin, traces of the last ones, or bits with a "
        "memory of their own (RecurrentPPO). One point per pattern seed, means with 95 % bootstrap "
        "intervals, logarithmic; dotted, a policy that never spikes.",
    )
}
