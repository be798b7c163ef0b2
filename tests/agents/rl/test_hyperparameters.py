"""The hyperparameters: a start near silence, SB3's own objects, refusals that say what to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO

from agents.rl import (
    HYPERPARAMETERS,
    TRACES,
    ObservationConfig,
    make_rl_agent,
    read_hyperparameters,
    training_env,
)
from agents.rl.hyperparameters import FILE, n_parameters
from gnm_env import Patterns, Task

TASK = Task()
PATTERNS = Patterns.draw(TASK, 0)
CLASSES = {
    "ppo": PPO,
    "ppo-linear": PPO,
    "a2c": A2C,
    "recurrent-ppo": RecurrentPPO,
    "leaky-ppo": RecurrentPPO,
    "gnm-ppo": RecurrentPPO,
    "spiking-ppo": RecurrentPPO,
    "dqn": DQN,
}


@pytest.mark.parametrize("kind", HYPERPARAMETERS)
def test_an_agent_is_a_plain_model_of_stable_baselines(kind):
    model = make_rl_agent(kind, training_env(TASK, PATTERNS, kind, n_envs=2))
    assert type(model) is CLASSES[kind]
    assert model.n_envs == 2


@pytest.mark.parametrize("kind", ["ppo", "ppo-linear"])
@pytest.mark.parametrize("probability", [0.01, 0.2])
def test_a_fresh_policy_spikes_as_rarely_as_asked(kind, probability):
    env = training_env(TASK, PATTERNS, kind, n_envs=50)
    model = make_rl_agent(kind, env, spike_probability=probability)
    observation = torch.as_tensor(env.reset())
    spikes = model.policy.get_distribution(observation).distribution.probs[:, 1]
    assert spikes.mean().item() == pytest.approx(probability, rel=0.3)


def test_a_fresh_dqn_is_silent():
    env = training_env(TASK, PATTERNS, "dqn", n_envs=50)
    model = make_rl_agent("dqn", env)
    assert not model.predict(env.reset(), deterministic=True)[0].any()


def test_equal_seeds_begin_equal_and_settings_override_those_of_the_kind():
    first, second, other = (
        make_rl_agent("ppo", training_env(TASK, PATTERNS, n_envs=2), seed, gamma=0.9)
        for seed in (1, 1, 2)
    )
    assert first.gamma == 0.9
    weights = [model.policy.action_net.weight.detach().numpy() for model in (first, second, other)]
    np.testing.assert_array_equal(weights[0], weights[1])
    assert np.any(weights[0] != weights[2])


def test_a_single_environment_is_seen_through_traces():
    model = make_rl_agent("ppo", gym.make("gnm/PatternTrial-v0"))
    assert model.observation_space == TRACES.wrap(gym.make("gnm/PatternTrial-v0")).observation_space
    assert model.n_steps == 16_384


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: make_rl_agent("sarsa", gym.make("gnm/PatternTrial-v0")), "kind must be one of"),
        (lambda: training_env(TASK, PATTERNS, n_envs=0), "n_envs must be >= 1"),
        (lambda: training_env(TASK, PATTERNS, feedback="loud"), "feedback must be one of"),
        (lambda: training_env(TASK, PATTERNS, feedback="sign"), "feedback must be one of"),
        (lambda: training_env(TASK, None), "patterns must be gnm_env.Patterns, got None"),
        (
            lambda: make_rl_agent("ppo", training_env(TASK, PATTERNS, n_envs=2), bogus=1),
            "PPO has no setting 'bogus'",
        ),
        (lambda: make_rl_agent("ppo", 3), "env must be a Gymnasium Env or an SB3 VecEnv"),
        (
            lambda: make_rl_agent(
                "recurrent-ppo", training_env(TASK, PATTERNS, "ppo", n_envs=2)
            ),
            r"recurrent-ppo needs ObservationConfig\(decays=\(1.0,\).*got Obs.*decays=\(0.3,\)",
        ),
        (
            lambda: make_rl_agent("ppo", gym.make("gnm/PatternTrial-v0"), spike_probability=0.0),
            "spike_probability must be > 0",
        ),
        (
            lambda: make_rl_agent("ppo", gym.make("gnm/PatternTrial-v0"), spike_probability=1.0),
            "spike_probability must be < 1",
        ),
        (
            lambda: make_rl_agent("ppo", gym.make("gnm/PatternTrial-v0", output="graded")),
            "the actions must be Discrete",
        ),
        (
            lambda: make_rl_agent("ppo", TRACES.wrap(gym.make("gnm/PatternTrial-v0"))),
            "give it unwrapped",
        ),
        (
            lambda: make_rl_agent("ppo", gym.make_vec(
                "gnm/PatternTrial-v0", 2, vectorization_mode="vector_entry_point")),
            "training_env makes one",
        ),
    ],
)  # fmt: skip
def test_bad_input_is_refused_with_a_remedy(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_target_network_of_a_dqn_does_not_count():
    model = make_rl_agent("dqn", training_env(TASK, PATTERNS, "dqn", n_envs=2))
    assert n_parameters(model) == 102 * 64 + 64 + 64 * 64 + 64 + 64 * 2 + 2


def test_a_kind_can_be_shown_something_else():
    shown = ObservationConfig(decays=(1.0,), previous_action=True)
    env = training_env(TASK, PATTERNS, "a2c", n_envs=2, observation=shown)
    model = make_rl_agent("a2c", env, observation=shown)
    assert model.observation_config == asdict(shown)
    assert model.observation_space.shape == (TASK.n_inputs + 1,)
    with pytest.raises(ValueError, match="a2c needs ObservationConfig"):
        make_rl_agent("a2c", env)


def test_every_kind_gives_its_reasons():
    for kind in HYPERPARAMETERS:
        assert f'- "{kind}": ' in (make_rl_agent.__doc__ or "")


def test_the_kinds_are_those_of_the_file():
    assert list(read_hyperparameters()) == list(HYPERPARAMETERS)
    assert all(f"[{kind}]" in FILE.read_text(encoding="utf-8") for kind in HYPERPARAMETERS)


@pytest.mark.parametrize("kind", HYPERPARAMETERS)
def test_what_the_file_says_is_what_the_model_has(kind):
    env = training_env(TASK, PATTERNS, kind, n_envs=4)
    model = make_rl_agent(kind, env)
    chosen = HYPERPARAMETERS[kind]
    settings = chosen.settings(4)
    for name in ("gamma", "batch_size", "ent_coef", "n_epochs", "gradient_steps"):
        assert getattr(model, name, None) == settings.get(name), name
    assert model.lr_schedule(1.0) == settings["learning_rate"](1.0)
    assert model.lr_schedule(0.0) == 0.0
    assert chosen.settings(4)["policy_kwargs"] == model.policy_kwargs | {}
    if "n_steps" in settings:
        assert settings["n_steps"] * 4 == (4_096 if kind == "a2c" else 16_384)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace('algorithm = "PPO"', 'algorithm = "SAC"'), "algorithm must be one of"),
        (lambda t: t.replace("gamma", "gama"), r"\[ppo\]: PPO takes no 'gama'"),
        (lambda t: t.replace("n_envs = 64\n", "", 1), r"\[ppo\]: n_envs is missing"),
        (lambda t: t.replace("lin_0.003", "cos_0.003"), "learning_rate must be a number or"),
        (lambda t: t.replace("decays = [0.3]", "decays = [7]"), "decays must be in 0 … 1"),
        (lambda t: t + "[", "is no TOML file"),
    ],
)
def test_a_file_that_says_what_nothing_takes_is_refused(
    tmp_path: Path, change: Callable[[str], str], message: str
):
    path = tmp_path / "mine.toml"
    path.write_text(change(FILE.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_hyperparameters(path)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="cannot read the hyperparameters"):
        read_hyperparameters(tmp_path / "none.toml")
