"""What both environments promise alike; every test runs over both ids and all their variants."""

from __future__ import annotations

import copy
import pickle
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

import gnm_env  # noqa: F401  registers the environments
from gnm_env import Patterns, Task

TRIAL, STREAM = "gnm/PatternTrial-v0", "gnm/PatternStream-v0"
FEEDBACK = ("cost", "sign", "dense")

VARIANTS = [
    *[(TRIAL, {"n_classes": c, "feedback": f}) for c in (1, 2, 3, 4) for f in FEEDBACK],
    *[(STREAM, {"n_classes": c}) for c in (1, 2, 3, 4)],
    (TRIAL, {"n_classes": 2, "jitter_bins": 2, "deletion": 0.1}),
    (STREAM, {"n_classes": 2, "jitter_bins": 2, "deletion": 0.1, "targets": (0, 2)}),
]
each_variant = pytest.mark.parametrize(
    ("id", "kwargs"), VARIANTS, ids=[f"{id[4:]} {kwargs}" for id, kwargs in VARIANTS]
)
each_id = pytest.mark.parametrize("id", [TRIAL, STREAM])


def rollout(env: gym.Env[Any, Any], n_steps: int, seed: int | None = None) -> list[Any]:
    """Everything that is returned in `n_steps` steps with random answers, resets included."""
    actions = np.random.default_rng(0)
    obs, info = env.reset(seed=seed)
    heard: list[Any] = [(obs.tolist(), info)]
    for _ in range(n_steps):
        obs, reward, terminated, truncated, info = env.step(int(actions.random() < 0.02))
        heard.append((obs.tolist(), reward, terminated, truncated, info))
        if terminated or truncated:
            heard.append(env.reset()[0].tolist())
    return heard


@each_variant
def test_gymnasium_finds_nothing_to_complain_of(id: str, kwargs: dict[str, Any]) -> None:
    check_env(gym.make(id, **kwargs).unwrapped)


@each_variant
def test_stable_baselines_finds_nothing_to_complain_of(id: str, kwargs: dict[str, Any]) -> None:
    check_env_for_sb3(gym.make(id, **kwargs))


@pytest.mark.parametrize("feedback", FEEDBACK)
def test_both_checkers_accept_graded_output_but_for_its_scale(feedback: str) -> None:
    env = gym.make(TRIAL, output="graded", feedback=feedback, n_classes=2)
    with warnings.catch_warnings():
        # An amount of output is in spikes, and may be zero but not negative: no scale fits that.
        warnings.filterwarnings("ignore", message=".*recommend.*normalized")
        warnings.filterwarnings("ignore", message=".*recommend using np.float32")
        check_env(env.unwrapped)
        check_env_for_sb3(env)


@each_variant
def test_the_spec_survives_json(id: str, kwargs: dict[str, Any]) -> None:
    env = gym.make(id, pattern_seed=3, **kwargs)
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.task == env.unwrapped.task  # type: ignore[attr-defined]
    assert rollout(again, 300, seed=1) == rollout(env, 300, seed=1)


@each_variant
def test_equal_seeds_give_equal_rollouts(id: str, kwargs: dict[str, Any]) -> None:
    first, second = (rollout(gym.make(id, **kwargs), 600, seed=1) for _ in range(2))
    assert first == second
    assert rollout(gym.make(id, **kwargs), 600, seed=2) != first


@each_id
def test_a_seed_begins_anew_in_the_middle_of_an_episode(id: str) -> None:
    env = gym.make(id)
    fresh = rollout(env, 250, seed=1)
    env.reset()
    env.step(0)
    assert rollout(env, 250, seed=1) == fresh


@each_id
def test_reset_without_a_seed_goes_on_with_the_same_generator(id: str) -> None:
    env = gym.make(id)
    one_go = [rollout(env, 250, seed=1), rollout(env, 250)]
    assert one_go[0][0] != one_go[1][0] or one_go[0] != one_go[1]
    assert [rollout(env, 250, seed=1), rollout(env, 250)] == one_go
    rng = env.unwrapped.np_random
    env.reset()
    assert env.unwrapped.np_random is rng


@each_id
def test_a_generator_of_the_users_own_is_the_one_that_is_heard(id: str) -> None:
    seeded, given = gym.make(id), gym.make(id)
    expected = rollout(seeded, 250, seed=9)
    given.reset(seed=1)
    given.step(0)
    given.unwrapped.np_random = np.random.default_rng(9)
    assert rollout(given, 250) == expected


@each_variant
def test_environments_pickle_and_copy_in_the_middle_of_an_episode(
    id: str, kwargs: dict[str, Any]
) -> None:
    env = gym.make(id, **kwargs)
    env.reset(seed=1)
    for _ in range(20):
        if env.step(0)[2]:
            env.reset()
    twins = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
    heard = [
        [env.step(0)[0].tolist(), rollout(env, 400), env.unwrapped.np_random.bit_generator.state]
        for env in (env, *twins)
    ]
    assert heard[0] == heard[1] == heard[2]


@each_variant
def test_an_observation_once_handed_out_is_never_altered(id: str, kwargs: dict[str, Any]) -> None:
    env = gym.make(id, **kwargs)
    observations = [env.reset(seed=1)[0]]
    copies = [observations[0].copy()]
    for _ in range(700):
        obs, _, terminated, truncated, _ = env.step(0)
        observations.append(obs)
        if terminated or truncated:
            observations.append(env.reset()[0])
        copies += [one.copy() for one in observations[len(copies) :]]
    for observation, original in zip(observations, copies, strict=True):
        assert np.array_equal(observation, original)


@each_id
def test_writing_into_an_observation_changes_nothing_that_follows(id: str) -> None:
    clean, dirty = gym.make(id), gym.make(id)
    expected = clean.reset(seed=1)[0]
    obs = dirty.reset(seed=1)[0]
    for _ in range(400):
        assert np.array_equal(obs, expected)
        obs[:] = 1
        (
            obs,
            *_,
        ) = dirty.step(0)
        expected, _, ended, _, _ = clean.step(0)
        if ended:
            assert np.array_equal(obs, expected)
            obs, expected = dirty.reset()[0], clean.reset()[0]


@each_id
def test_spaces_are_those_of_the_manual(id: str) -> None:
    env = gym.make(id, n_inputs=17, n_classes=2)
    assert env.observation_space == gym.spaces.Box(0, 1, (17,), np.int8)
    assert env.action_space == gym.spaces.Discrete(2)
    assert env.reset(seed=0)[0].dtype == np.int8


@each_id
def test_task_and_patterns_may_be_given_whole(id: str) -> None:
    task = Task(n_classes=3, rate=0.02)
    by_task = gym.make(id, task=task, patterns=Patterns.draw(task, 4))
    by_keywords = gym.make(id, n_classes=3, rate=0.02, pattern_seed=4)
    assert rollout(by_task, 300, seed=1) == rollout(by_keywords, 300, seed=1)


@each_id
def test_python_and_numpy_integers_are_the_same_answers(id: str) -> None:
    heard = []
    for kind in (int, bool, np.int64, np.int8, np.uint8, lambda spike: np.array(spike)):
        env = gym.make(id)
        env.reset(seed=1)
        heard.append([[env.step(kind(0))[1] for _ in range(40)], env.step(kind(1))[1:]])
    assert all(one == heard[0] for one in heard)


class TestBadInput:
    @each_id
    @pytest.mark.parametrize(
        "action", [2, -1, 0.5, 1.0, None, "1", [1], np.array([0, 1]), np.float64(1), np.int64(7)]
    )
    def test_an_action_outside_the_space_is_refused_and_changes_nothing(
        self, id: str, action: Any
    ) -> None:
        env, twin = gym.make(id), gym.make(id)
        env.reset(seed=1)
        twin.reset(seed=1)
        for _ in range(3):  # beyond the first step, which the passive checker looks at
            env.step(0)
            twin.step(0)
        with pytest.raises(ValueError, match=r"action must be 0 \(silent\) or 1 \(spike\), got"):
            env.step(action)
        assert np.array_equal(env.step(0)[0], twin.step(0)[0])

    @each_id
    def test_step_before_reset_and_after_the_end(self, id: str) -> None:
        env = gym.make(id)
        with pytest.raises(ResetNeeded):
            env.step(0)
        with pytest.raises(ResetNeeded, match=r"call reset\(\)"):
            env.unwrapped.step(0)
        env.reset(seed=1)
        while not env.step(0)[2]:
            pass
        for _ in range(2):
            with pytest.raises(ResetNeeded, match=r"call reset\(\)"):
                env.step(0)
        env.reset()
        env.step(0)

    @each_id
    @pytest.mark.parametrize(
        ("kwargs", "why"),
        [
            ({"n_classes": 0}, "n_classes must be >= 1, got 0"),
            ({"rat": 0.1}, "unknown keyword 'rat'"),
            ({"task": Task(), "rate": 0.1}, "give either task or its fields"),
            ({"task": "task"}, "task must be a gnm_env.Task, got 'task'"),
            ({"patterns": np.zeros((1, 50, 100))}, "use Patterns.from_dense"),
            ({"patterns": Patterns.draw(Task(n_classes=2), 0)}, "patterns must have shape"),
            ({"pattern_seed": -1}, "pattern_seed must be >= 0"),
            ({"pattern_seed": 0.5}, "pattern_seed must be a whole number"),
        ],
    )
    def test_arguments_that_make_no_environment(
        self, id: str, kwargs: dict[str, Any], why: str
    ) -> None:
        with pytest.raises(ValueError) as refusal:
            gym.make(id, **kwargs)
        assert why in str(refusal.value)

    @each_id
    def test_a_render_mode_that_does_not_exist(self, id: str) -> None:
        entry = gym.spec(id).entry_point
        assert isinstance(entry, str)
        with pytest.raises(
            ValueError, match="render_mode must be None, 'human' or 'rgb_array', got 'x'"
        ):
            gym.envs.registration.load_env_creator(entry)(render_mode="x")

    @each_id
    def test_an_unknown_reset_option(self, id: str) -> None:
        env = gym.make(id)
        with pytest.raises(ValueError, match="unknown reset option 'trail'"):
            env.reset(options={"trail": 1})
