"""The example of an agent of one's own: it runs, begins near silence, and learns one class."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch

from agents.rl import SB3Agent
from gnm_env import Patterns, Task

FILE = Path(__file__).parents[2] / "examples" / "ppo_from_scratch.py"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("ppo_from_scratch", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_it_trains_and_scores_a_policy_from_the_command_line(
    example: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    score = example.main(["--steps", "40000", "--runs", "5"])
    assert 0 < score <= 10_000
    assert "noisy performance" in capsys.readouterr().out


def test_a_fresh_policy_is_near_silence_and_one_rollout_changes_it(example: ModuleType) -> None:
    task = Task(n_classes=1)
    observed = torch.rand(500, task.n_inputs + 2)
    torch.manual_seed(0)
    fresh = example.Policy(observed.shape[1])
    p = fresh(observed)[0].probs[:, 1].mean().item()
    assert p == pytest.approx(example.SPIKES_AT_FIRST, rel=0.1)
    taught = example.train(task, Patterns.draw(task, 0), steps=1, seed=0)
    first = [layer.weight.detach().numpy() for layer in (fresh.answer[0], taught.answer[0])]
    assert first[0].shape == first[1].shape and not np.array_equal(*first)


def test_it_is_scored_on_the_observations_that_it_was_trained_on(example: ModuleType) -> None:
    agent = SB3Agent(example.Policy(102), Task())
    assert agent.observation == example.TRACES


@pytest.mark.slow
def test_it_learns_one_class_at_the_first_try(example: ModuleType) -> None:
    assert example.main(["--pattern-seed", "300"]) >= 8_000
