"""Training throughput of reinforcement learning, end to end."""

from __future__ import annotations

import functools
from typing import Any

from benchmarks.rows import Findings, Target, rate_rows
from benchmarks.timing import Settings, Skip, Subject, race
from gnm_env import Patterns, Task

KINDS = {"ppo": ("PPO, MLP 64 × 64", 60_000), "ppo-linear": ("PPO, linear", 120_000)}


def reinforcement(settings: Settings) -> Findings:
    """SB3's `learn` with our recipes: rollouts and updates, terminal cost, one class."""
    try:
        import torch

        from agents.rl import make_rl_agent, training_env
    except ImportError as error:
        raise Skip(str(error)) from None
    torch.set_num_threads(1)
    task = Task()
    subjects, targets = [], {}
    for kind, (name, bound) in KINDS.items():
        env = training_env(task, Patterns.draw(task, 0), kind)
        model: Any = make_rl_agent(kind, env, settings.seed)
        steps = (1 if settings.quick else 3) * model.n_steps * env.num_envs
        subjects.append(Subject(name, functools.partial(_learn, model, steps), steps))
        targets[name] = (Target(bound),)
    section, timings = "Reinforcement learning, training end to end", race(subjects, settings)
    return Findings(rows=rate_rows(section, timings, "steps/s", 1.0, targets=targets))


def _learn(model: Any, steps: int, _: object) -> None:
    model.learn(steps, reset_num_timesteps=False)
