"""Arguments of environments: one door, where each wrong one is refused in a sentence."""

from __future__ import annotations

import inspect
from dataclasses import FrozenInstanceError
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from gnm_env import PatternStreamEnv, PatternTrialEnv, Task
from gnm_env.base.params import MAX_ENVS, MAX_STEPS, EnvParams, VectorParams
from gnm_env.stream_task.vector import PatternStreamVectorEnv
from gnm_env.trial_task.params import TrialEnvParams
from gnm_env.trial_task.vector import PatternTrialVectorEnv

ENVIRONMENTS = (
    PatternTrialEnv, PatternStreamEnv, PatternTrialVectorEnv, PatternStreamVectorEnv,
)  # fmt: skip
each_environment = pytest.mark.parametrize("environment", ENVIRONMENTS, ids=lambda e: e.__name__)


@each_environment
def test_an_unknown_keyword_is_told_with_all_that_are_known_and_the_nearest(
    environment: Any,
) -> None:
    with pytest.raises(ValueError) as refusal:
        environment(patern_seed=3)
    said = str(refusal.value)
    assert "unknown keyword 'patern_seed', did you mean 'pattern_seed'?" in said
    names = [name for name in inspect.signature(environment).parameters if name != "task_fields"]
    assert len(names) >= 4
    for name in (*names, "onset_probability", "jitter_bins"):
        assert f" {name}" in said


@each_environment
def test_a_keyword_like_no_other_is_not_guessed_at(environment: Any) -> None:
    with pytest.raises(ValueError, match=r"unknown keyword 'xyzzy'\. The environment takes task"):
        environment(xyzzy=3)


def test_a_misspelt_feedback_is_told_by_gymnasium_make() -> None:
    with pytest.raises(ValueError, match=r"unknown keyword 'feedbck', did you mean 'feedback'\?"):
        gym.make("gnm/PatternTrial-v0", feedbck="cost")


def test_signatures_show_every_argument_with_its_default() -> None:
    shown = inspect.signature(PatternTrialVectorEnv).parameters
    assert list(shown)[:4] == ["num_envs", "task", "patterns", "feedback"]
    assert shown["max_output"].default == 100.0 and shown["copy"].default is True
    assert shown["trials"].default is None and "render_mode" not in shown
    assert "render_mode" in inspect.signature(PatternStreamEnv).parameters


@pytest.mark.parametrize(
    "wrong",
    [
        {"num_envs": 0}, {"num_envs": MAX_ENVS + 1}, {"num_envs": 2.0}, {"num_envs": "3"},
        {"num_envs": True}, {"max_episode_steps": 0}, {"max_episode_steps": MAX_STEPS + 1},
        {"max_episode_steps": 1.5}, {"max_episode_steps": "x"}, {"autoreset_mode": "nextstep"},
        {"autoreset_mode": None}, {"autoreset_mode": 1}, {"autoreset_mode": []},
        {"copy": "no"}, {"copy": 0}, {"copy": None},
    ],
    ids=str,
)  # fmt: skip
def test_what_makes_no_vector_environment_is_refused_by_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        VectorParams(**wrong)


@pytest.mark.parametrize("given", [AutoresetMode.SAME_STEP, "SameStep"])
def test_an_autoreset_mode_may_be_given_by_its_value(given: Any) -> None:
    assert VectorParams(autoreset_mode=given).autoreset_mode is AutoresetMode.SAME_STEP
    assert VectorParams(copy=np.False_).copy is False


@pytest.mark.parametrize(
    "wrong",
    [
        {"pattern_seed": "x"}, {"pattern_seed": -1}, {"pattern_seed": 2**200},
        {"pattern_seed": None}, {"render_mode": "ascii"}, {"render_mode": ["human"]},
        {"feedback": "costs"}, {"feedback": ["cost"]}, {"output": None}, {"max_output": "x"},
        {"max_output": float("inf")}, {"tolerance": float("nan")}, {"tolerance": 0.5},
        {"trials": []},
    ],
    ids=str,
)  # fmt: skip
def test_what_makes_no_environment_is_refused_by_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        TrialEnvParams(**wrong)


def test_a_pattern_seed_is_looked_at_beside_patterns_too() -> None:
    known = EnvParams()
    with pytest.raises(ValueError, match="pattern_seed must be a whole number, got 'x'"):
        EnvParams(task=known.task, patterns=known.patterns, pattern_seed="x")  # type: ignore[arg-type]


def test_the_record_is_frozen_and_holds_the_task() -> None:
    params = EnvParams(task_fields={"n_classes": 2})
    assert params.task == Task(n_classes=2) and params.patterns is not None
    with pytest.raises(FrozenInstanceError):
        params.pattern_seed = 3  # type: ignore[misc]


@pytest.mark.parametrize("id", ["gnm/PatternTrial-v0", "gnm/PatternStream-v0"])
def test_more_environments_than_the_memory_holds_are_refused_before_they_are_made(id: str) -> None:
    with pytest.raises(ValueError, match=r"GiB.*lower num_envs"):
        gym.make_vec(id, num_envs=1_000_000, n_inputs=1_000_000, rate=1e-6, pattern_bins=2)
