"""PatternVecEnv hears what SB3's own DummyVecEnv of single environments hears."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import gnm_env  # noqa: F401
from agents.rl.vec_env import PatternVecEnv

IDS = ("gnm/PatternTrial-v0", "gnm/PatternStream-v0")


def adapted(id_: str, num_envs: int, **settings: Any) -> PatternVecEnv:
    envs = gym.make_vec(
        id_,
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        autoreset_mode=gym.vector.AutoresetMode.SAME_STEP,
        **settings,
    )
    return PatternVecEnv(envs)


VARIANTS: list[tuple[str, dict[str, Any]]] = [
    (IDS[0], {"n_classes": 2}),
    (IDS[0], {"feedback": "sign"}),
    (IDS[0], {"feedback": "dense", "n_classes": 2}),
    (IDS[0], {"max_episode_steps": 120}),
    (IDS[1], {"n_classes": 2}),
    (IDS[1], {"max_episode_steps": 40}),
]


@pytest.mark.parametrize(("id_", "settings"), VARIANTS)
def test_rollouts_equal_those_of_single_environments(id_: str, settings: dict[str, Any]) -> None:
    ours = adapted(id_, 3, **settings)
    theirs = DummyVecEnv([lambda: gym.make(id_, **settings)] * 3)
    for env in (ours, theirs):
        env.seed(11)
    assert np.array_equal(ours.reset(), theirs.reset())
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(1500):
        actions = (rng.random(3) < 0.02).astype(np.int64)
        mine, other = ours.step(actions), theirs.step(actions)
        for a, b in zip(mine[:3], other[:3], strict=True):
            assert np.array_equal(a, b)
        for i in np.flatnonzero(mine[2]):
            ended += 1
            info, expected = mine[3][i], other[3][i]
            assert set(info) == set(expected)
            for key in expected:
                assert np.array_equal(info[key], expected[key])
                assert type(info[key]) is type(expected[key])
        assert all(not mine[3][i] for i in np.flatnonzero(~mine[2]))
    assert ended > 5


def test_truncation_is_told_apart_from_a_mistake() -> None:
    env = adapted("gnm/PatternStream-v0", 2, onset_probability=0.0, max_episode_steps=5)
    env.reset()
    for _ in range(4):
        assert not env.step(np.zeros(2, np.int64))[2].any()
    _, rewards, over, infos = env.step(np.array([0, 1]))
    assert over.all() and rewards.tolist() == [1.0, 0.0]
    assert [info["TimeLimit.truncated"] for info in infos] == [True, False]


def test_observations_are_the_callers_own() -> None:
    env = adapted("gnm/PatternTrial-v0", 2, copy=False)
    first = env.reset()
    kept = first.copy()
    for _ in range(20):
        env.step(np.zeros(2, np.int64))
    assert np.array_equal(first, kept)


def test_ppo_learns_on_it_without_complaint() -> None:
    env = VecMonitor(adapted("gnm/PatternTrial-v0", 4))
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(512)
    assert model.num_timesteps == 512
    assert len(model.ep_info_buffer) >= 1


def test_a_seed_is_used_once_as_everywhere_in_sb3() -> None:
    env = adapted(IDS[0], 2, rate=0.5)
    assert env.seed(4) == [4, 5]
    first = env.reset()
    assert not np.array_equal(env.reset(), first)
    env.seed(4)
    assert np.array_equal(env.reset(), first)
    env.seed(None)  # drawn at random, different for each environment
    assert not np.array_equal(env.reset(), first)


def test_sb3_scores_a_policy_on_it() -> None:
    env = VecMonitor(adapted("gnm/PatternStream-v0", 4), info_keywords=("mistake",))
    env.seed(0)
    rewards, lengths = evaluate_policy(
        Silent(), env, n_eval_episodes=40, return_episode_rewards=True
    )
    assert [length - 1 for length in lengths] == rewards  # the bin of the mistake pays nothing
    assert 80 < np.mean(rewards) < 240


class Silent:
    """A policy that never spikes."""

    def predict(
        self, obs: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]:
        return np.zeros(len(obs), np.int64), state


def test_what_is_written_into_an_info_stays_there() -> None:
    env = adapted(IDS[0], 3)
    env.reset()
    for t in range(5):
        infos = env.step(np.zeros(3, np.int64))[3]
        assert infos == [{}, {}, {}]
        infos[t % 3]["note"] = t


def test_monitors_know_the_environment() -> None:
    spec = adapted(IDS[1], 2).spec
    assert spec is not None and spec.id == IDS[1]


def test_reset_options_are_refused_and_not_forgotten() -> None:
    env = adapted(IDS[0], 2)
    env.set_options({"trial": 1})
    with pytest.raises(ValueError, match="no reset options"):
        env.reset()


def test_bad_actions_are_refused() -> None:
    env = adapted(IDS[0], 2)
    env.reset()
    with pytest.raises(ValueError, match="action must be 0"):
        env.step(np.array([0, 2]))


def test_another_way_to_reset_is_refused() -> None:
    envs = gym.make_vec(IDS[0], num_envs=2, vectorization_mode="vector_entry_point")
    with pytest.raises(ValueError, match="SAME_STEP"):
        PatternVecEnv(envs)


def test_only_vector_environments_are_adapted() -> None:
    with pytest.raises(ValueError, match="must be a Gymnasium vector environment, got None"):
        PatternVecEnv(None)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", [-1, "x", 2.5])
def test_a_seed_is_a_whole_number(seed: Any) -> None:
    with pytest.raises(ValueError, match="seed must be"):
        adapted(IDS[0], 2).seed(seed)


def test_there_are_no_attributes_of_an_environment_that_is_not_there() -> None:
    with pytest.raises(IndexError, match=r"there are 3 environments, got indices \[7\]"):
        adapted(IDS[0], 3).get_attr("task", 7)


def test_attributes_are_those_of_the_vector_environment() -> None:
    env = adapted(IDS[0], 3)
    assert [task.n_inputs for task in env.get_attr("task")] == [100] * 3
    assert env.get_attr("render_mode", [0, 1]) == [None, None]
    assert env.env_is_wrapped(gym.Wrapper, 0) == [False]
    with pytest.raises(NotImplementedError, match="vector environment"):
        env.env_method("reset")
    with pytest.raises(ValueError, match="shared by all"):
        env.set_attr("feedback", "sign", indices=[0])
