"""A PPO run that learns, and the same where rewards go astray."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from agents import noisy_performance
from agents.rl import HYPERPARAMETERS, SB3Agent, make_rl_agent, training_env
from gnm_env import Patterns, Task

TASK = Task()
PATTERNS = Patterns.draw(TASK, 1)
BOUND = 4_000
"""Bins; silence scores 148."""


class Astray(VecEnvWrapper):
    """Gives each environment's reward to the next one."""

    def reset(self) -> Any:
        return self.venv.reset()

    def step_wait(self) -> Any:
        observations, rewards, over, infos = self.venv.step_wait()
        return observations, np.roll(rewards, 1), over, infos


def score(env: VecEnv) -> float:
    """Noisy performance after 1.2 million bins of PPO."""
    torch.set_num_threads(1)
    model = make_rl_agent("ppo", env, seed=0)
    model.learn(1_200_000)
    agent = SB3Agent(model, TASK, HYPERPARAMETERS["ppo"].observation)
    return float(noisy_performance(agent, TASK, PATTERNS, runs=50, seed=500).mean())


def test_ppo_learns_one_class_from_the_terminal_cost_alone():
    assert score(training_env(TASK, PATTERNS)) > BOUND


@pytest.mark.slow
def test_nothing_is_learned_from_the_rewards_of_others():
    assert score(Astray(training_env(TASK, PATTERNS))) < BOUND / 10
