"""A PPO run that learns: fails where the reward does not reach the spike that earned it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from agents import noisy_performance
from agents.rl import RECIPES, SB3Agent, make_rl_agent, training_env
from gnm_env import Patterns, Task


@pytest.mark.slow
def test_ppo_learns_one_class_from_the_terminal_cost_alone():
    torch.set_num_threads(1)
    task = Task()
    patterns = Patterns.draw(task, 1)
    model = make_rl_agent("ppo", training_env(task, patterns), seed=0)
    model.learn(600_000)
    agent = SB3Agent(model, task, RECIPES["ppo"].senses)
    survived = noisy_performance(agent, task, patterns, runs=50, seed=500)
    # Silence scores 148. A discount, or rewards credited to the wrong episode, stay below 1,000.
    assert np.mean(survived) > 4_000
