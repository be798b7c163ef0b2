"""A saved agent: complete, loadable by SB3 itself, refused where it is damaged."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO

from agents import noisy_performance
from agents.rl import (
    RAW,
    TRACES,
    ObservationConfig,
    SB3Agent,
    load,
    make_rl_agent,
    save,
    training_env,
)
from agents.rl.checkpoint import described
from gnm_env import Patterns, Task

TASK = Task(n_classes=2, onset_probability=0.05)
PATTERNS = Patterns.draw(TASK, 4)


@pytest.fixture(scope="module")
def model():
    env = training_env(TASK, PATTERNS, n_envs=2)
    return make_rl_agent("ppo", env, seed=1, spike_probability=0.5)


@pytest.fixture
def folder(tmp_path, model):
    save(tmp_path / "agent", model, "ppo", TASK, PATTERNS)
    return tmp_path / "agent"


def test_a_saved_agent_comes_back_with_task_and_patterns_and_scores_the_same(folder, model):
    agent, task, patterns = load(folder)
    assert task == TASK and patterns == PATTERNS
    before = SB3Agent(model, TASK, TRACES)
    scores = [noisy_performance(a, TASK, PATTERNS, runs=5, seed=9) for a in (agent, before)]
    np.testing.assert_array_equal(*scores)
    shown = np.random.default_rng(0).random((20, TASK.n_inputs + 2)).astype(np.float32)
    actions = [m.predict(shown, deterministic=True)[0] for m in (agent.policy, model)]
    np.testing.assert_array_equal(*actions)


def test_the_model_is_a_zip_that_stable_baselines_opens(folder):
    assert isinstance(PPO.load(folder / "model.zip"), PPO)


def test_the_best_model_is_preferred_to_the_last(folder, model):
    best = make_rl_agent("ppo", training_env(TASK, PATTERNS, n_envs=2), seed=7)
    best.save(folder / "best_model.zip")
    weights = load(folder)[0].policy.policy.action_net.weight.detach().numpy()
    np.testing.assert_array_equal(weights, best.policy.action_net.weight.detach().numpy())


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("task.json", "{", "task.json is not readable"),
        ("task.json", json.dumps({"format": 99}), "format 99"),
        ("task.json", json.dumps({"format": 1}), "KeyError"),
        ("model.zip", "no zip", "not a readable PPO model"),
    ],
)
def test_damaged_files_are_refused_by_name(folder, name, text, message):
    (folder / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        load(folder)


def test_a_zip_of_something_else_is_refused(folder, tmp_path):
    with zipfile.ZipFile(folder / "model.zip", "w") as file:
        file.writestr("letter.txt", "hello")
    with pytest.raises(ValueError, match="not a readable PPO model"):
        load(folder)


def test_a_model_of_another_algorithm_is_refused(folder, tmp_path, model):
    dqn = make_rl_agent("dqn", training_env(TASK, PATTERNS, "dqn", n_envs=2))
    with pytest.raises(ValueError, match="ppo is a PPO, and the model is a DQN"):
        save(tmp_path / "other", dqn, "ppo", TASK, PATTERNS)
    with pytest.raises(ValueError, match="kind must be one of"):
        save(tmp_path / "other", model, "sac", TASK, PATTERNS)
    dqn.save(folder / "model.zip")
    with pytest.raises(ValueError, match="not a readable PPO model"):
        load(folder)


@pytest.mark.parametrize("place", [None, 3, object()])
def test_what_is_no_path_is_refused(place):
    with pytest.raises(ValueError, match="a path must be text"):
        load(place)


def test_missing_files_are_refused_by_name(folder, tmp_path):
    with pytest.raises(ValueError, match="holds no RL agent"):
        load(tmp_path)
    (folder / "model.zip").unlink()
    with pytest.raises(ValueError, match="there is no model"):
        load(folder)


def test_an_interrupted_save_leaves_the_old_model(folder, model, monkeypatch):
    before = (folder / "model.zip").read_bytes()

    def fail(file):
        file.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(model, "save", fail)
    with pytest.raises(KeyboardInterrupt):
        save(folder, model, "ppo", TASK, PATTERNS)
    assert (folder / "model.zip").read_bytes() == before


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, model):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="cannot make the folder"):
        save(tmp_path / "file" / "agent", model, "ppo", TASK, PATTERNS)


def test_what_the_policy_hears_is_kept_in_the_zip_and_beside_it(folder, model):
    about = json.loads((folder / "task.json").read_text())
    assert ObservationConfig.of(about["observation"]) == TRACES
    assert ObservationConfig.of(PPO.load(folder / "model.zip").observation_config) == TRACES


def test_a_policy_is_not_scored_on_other_observations_than_its_own(folder, tmp_path, model):
    about = json.loads((folder / "task.json").read_text())
    about["observation"]["scale"] = 1.0
    (folder / "task.json").write_text(json.dumps(about))
    with pytest.raises(ValueError, match="the policy was trained on ObservationConfig"):
        load(folder)
    with pytest.raises(ValueError, match="the policy was trained on ObservationConfig"):
        save(tmp_path / "b", model, "ppo", TASK, PATTERNS, observation=replace(TRACES, scale=1.0))
    assert not (tmp_path / "b").exists()


def test_a_folder_of_the_first_format_is_read(folder):
    about = json.loads((folder / "task.json").read_text())
    about["format"], about["senses"] = 1, about.pop("observation")
    (folder / "task.json").write_text(json.dumps(about))
    assert load(folder)[0].observation == TRACES
    about |= {"kind": "recurrent-ppo", "senses": asdict(RAW) | {"scale": 1.0}}
    (folder / "task.json").write_text(json.dumps(about))
    assert described(folder).observation == RAW  # raw bits have no scale
