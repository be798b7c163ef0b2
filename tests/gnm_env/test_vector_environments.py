"""The native vector environments: the single environments, many at once."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

from gnm_env import Patterns, Task
from gnm_env.stream_task.vector import PatternStreamVectorEnv
from gnm_env.trial_task.vector import PatternTrialVectorEnv

TRIAL, STREAM = "gnm/PatternTrial-v0", "gnm/PatternStream-v0"
NUM_ENVS = 5

VARIANTS: list[tuple[str, dict[str, Any]]] = [
    (TRIAL, {}),
    (TRIAL, {"feedback": "sign", "n_classes": 2}),
    (TRIAL, {"feedback": "dense", "n_classes": 3}),
    (TRIAL, {"output": "graded", "max_output": 2.0, "tolerance": 0.25}),
    (TRIAL, {"output": "graded", "feedback": "dense", "tolerance": 0.25}),
    (TRIAL, {"output": "graded", "feedback": "sign", "tolerance": 0.25}),
    (TRIAL, {"max_episode_steps": 130}),
    (TRIAL, {"max_episode_steps": 150, "mean_occurrences": 1.0, "feedback": "dense"}),
    (TRIAL, {"n_inputs": 3, "rate": 0.6, "pattern_bins": 2, "background_bins": 1}),
    (TRIAL, {"mean_occurrences": 9.0, "pattern_bins": 3, "background_bins": 40, "rate": 0.1}),
    (TRIAL, {"n_classes": 2, "jitter_bins": 3, "deletion": 0.2}),
    (TRIAL, {"rate": 0.0}),
    (STREAM, {}),
    (STREAM, {"n_classes": 3, "targets": (0, 2, 1)}),
    (STREAM, {"max_episode_steps": 37}),
    (STREAM, {"max_episode_steps": 1}),
    (STREAM, {"onset_probability": 1.0, "pattern_bins": 3, "targets": (0,)}),
    (STREAM, {"onset_probability": 0.3, "pattern_bins": 2, "rate": 0.5, "n_inputs": 9}),
    (STREAM, {"onset_probability": 0.0, "targets": (0,), "n_inputs": 2}),
    (STREAM, {"jitter_bins": 2, "deletion": 0.5, "n_inputs": 1, "rate": 1.0}),
]
each_variant = pytest.mark.parametrize(
    ("id", "kwargs"), VARIANTS, ids=[f"{id[4:]} {kwargs}" for id, kwargs in VARIANTS]
)
each_id = pytest.mark.parametrize("id", [TRIAL, STREAM])
each_mode = pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)


def native(id: str, num_envs: int = NUM_ENVS, **kwargs: Any) -> VectorEnv[Any, Any, Any]:
    return gym.make_vec(id, num_envs=num_envs, vectorization_mode="vector_entry_point", **kwargs)


def synchronous(id: str, mode: AutoresetMode, **kwargs: Any) -> SyncVectorEnv[Any, Any]:
    """Gymnasium's own vector environment over the single environments."""
    envs = gym.make_vec(
        id,
        num_envs=NUM_ENVS,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **kwargs,
    )
    assert isinstance(envs, SyncVectorEnv)
    return envs


def answers(envs: VectorEnv[Any, Any, Any], rng: np.random.Generator) -> Any:
    """Mostly silence, so that episodes last."""
    speaks = rng.random(envs.num_envs) < 0.02
    if isinstance(envs.single_action_space, gym.spaces.Box):
        return (speaks * rng.random(envs.num_envs))[:, None]
    return speaks.astype(np.int64)


def assert_same(one: Any, other: Any) -> None:
    """Equal in type, structure and every bit."""
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, np.ndarray) and one.dtype == object:
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype
        assert np.array_equal(one, other)
    elif isinstance(one, (list, tuple)):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    else:
        assert one == other


def reset_ended(envs: VectorEnv[Any, Any, Any], over: Any) -> Any:
    return envs.reset(options={"reset_mask": over.copy()})


class TestLikeTheSingleEnvironments:
    @each_variant
    @each_mode
    def test_a_rollout_is_that_of_gymnasiums_loop_over_single_environments(
        self, id: str, kwargs: dict[str, Any], mode: AutoresetMode
    ) -> None:
        ours = native(id, autoreset_mode=mode, **kwargs)
        theirs = synchronous(id, mode, **kwargs)
        assert_same(ours.reset(seed=3), theirs.reset(seed=3))
        rng, over, n_over = np.random.default_rng(0), np.zeros(NUM_ENVS, np.bool_), 0
        for t in range(700):
            if mode == AutoresetMode.DISABLED and over.any():
                assert_same(reset_ended(ours, over), reset_ended(theirs, over))
            actions = answers(ours, rng)
            step = ours.step(actions)
            assert_same(step, theirs.step(actions))
            over = step[2] | step[3]
            n_over += over.sum()
            if t == 350:  # a seed in the middle of everything
                assert_same(ours.reset(seed=30), theirs.reset(seed=30))
                over[:] = False
            if t == 450:  # no seed in the middle of everything
                assert_same(ours.reset(), theirs.reset())
                over[:] = False
        if "targets" not in kwargs and "deletion" not in kwargs:
            assert n_over >= 3

    @each_variant
    def test_generators_are_left_in_the_same_state(self, id: str, kwargs: dict[str, Any]) -> None:
        ours, theirs = native(id, **kwargs), synchronous(id, AutoresetMode.NEXT_STEP, **kwargs)
        ours.reset(seed=3)
        theirs.reset(seed=3)
        rng = np.random.default_rng(0)
        for _ in range(300):
            actions = answers(ours, rng)
            ours.step(actions)
            theirs.step(actions)
        for one, other in zip(ours.np_random, theirs.np_random, strict=True):  # type: ignore[call-overload]
            assert one.bit_generator.state == other.bit_generator.state
        assert ours.np_random_seed == theirs.np_random_seed == (3, 4, 5, 6, 7)

    @each_variant
    @each_mode
    def test_partial_resets(self, id: str, kwargs: dict[str, Any], mode: AutoresetMode) -> None:
        ours = native(id, autoreset_mode=mode, **kwargs)
        theirs = synchronous(id, mode, **kwargs)
        assert_same(ours.reset(seed=3), theirs.reset(seed=3))
        rng, over = np.random.default_rng(1), np.zeros(NUM_ENVS, np.bool_)
        for t in range(400):
            mask = rng.random(NUM_ENVS) < 0.02
            if mode == AutoresetMode.DISABLED:
                mask |= over
            if mask.any():
                seed: Any = [None, None, 100 + t, None, 200 + t] if t % 3 == 0 else None
                both = [
                    envs.reset(seed=seed, options={"reset_mask": mask.copy()})
                    for envs in (ours, theirs)
                ]
                assert_same(*both)
            actions = answers(ours, rng)
            step = ours.step(actions)
            assert_same(step, theirs.step(actions))
            over = step[2] | step[3]

    @each_id
    def test_environment_i_hears_the_single_environment_seeded_s_plus_i(self, id: str) -> None:
        envs = native(id, num_envs=3)
        observations, _ = envs.reset(seed=70)
        heard = [observations]
        for _ in range(40):
            heard.append(envs.step(np.zeros(3, int))[0])
        for i in range(3):
            env = gym.make(id)
            alone = [env.reset(seed=70 + i)[0]] + [env.step(0)[0] for _ in range(40)]
            assert np.array_equal([bits[i] for bits in heard], alone)

    @each_id
    def test_a_list_of_seeds_is_one_for_each(self, id: str) -> None:
        listed, counted = native(id), native(id)
        assert_same(listed.reset(seed=[9, 10, 11, 12, 13]), counted.reset(seed=9))  # type: ignore[arg-type]
        assert_same(listed.reset(seed=np.arange(9, 14)), counted.reset(seed=np.int64(9)))  # type: ignore[arg-type]

    @each_id
    def test_without_a_seed_environments_differ_from_run_to_run(self, id: str) -> None:
        first, second = (native(id, rate=0.5).reset()[0] for _ in range(2))
        assert not np.array_equal(first, second)

    @pytest.mark.slow
    @each_id
    def test_a_thousand_environments(self, id: str) -> None:
        n = 1000
        ours = native(id, num_envs=n, n_classes=2)
        singles = [gym.make(id, n_classes=2) for _ in range(n)]
        observations, _ = ours.reset(seed=0)
        for i, env in enumerate(singles):
            assert np.array_equal(observations[i], env.reset(seed=i)[0])
        over = np.zeros(n, np.bool_)
        rng = np.random.default_rng(0)
        for _ in range(400):
            actions = answers(ours, rng)
            observations, rewards, terminated, truncated, _ = ours.step(actions)
            for i, env in enumerate(singles):
                obs, reward, ended, cut = (
                    (env.reset()[0], 0.0, False, False) if over[i] else env.step(actions[i])[:4]
                )
                assert np.array_equal(observations[i], obs)
                assert (rewards[i], terminated[i], truncated[i]) == (reward, ended, cut)
            over = terminated | truncated

    @pytest.mark.slow
    def test_trials_that_may_be_too_long_for_small_numbers(self) -> None:
        kwargs: dict[str, Any] = {
            "pattern_bins": 200_000, "mean_occurrences": 0.1, "n_inputs": 200, "rate": 1e-3
        }  # fmt: skip
        ours, theirs = (
            native(TRIAL, **kwargs),
            synchronous(TRIAL, AutoresetMode.NEXT_STEP, **kwargs),
        )
        assert ours._event_type() is np.int64  # type: ignore[attr-defined]
        assert native(TRIAL)._event_type() is np.int32  # type: ignore[attr-defined]
        assert_same(ours.reset(seed=5), theirs.reset(seed=5))
        for _ in range(300):
            actions = np.zeros(NUM_ENVS, int)
            assert_same(ours.step(actions), theirs.step(actions))

    @each_id
    def test_episodes_of_one_dense_bin_have_room_for_their_last_and_their_first(
        self, id: str
    ) -> None:
        """Under SAME_STEP a row that ends is shown twice within one step."""
        task = {"rate": 0.95, "max_episode_steps": 1, "background_bins": 3}
        kwargs = {key: task[key] for key in task if id == TRIAL or key != "background_bins"}
        envs = native(id, 64, autoreset_mode=AutoresetMode.SAME_STEP, **kwargs)
        envs.reset(seed=0)
        for _ in range(50):
            observations, *_ = envs.step(np.ones(64, int))
            assert 0.9 < observations.mean() < 1.0

    @each_id
    def test_environments_that_have_ended_may_be_reset_one_after_the_other(self, id: str) -> None:
        envs = native(id, 3, autoreset_mode=AutoresetMode.DISABLED, max_episode_steps=2)
        envs.reset(seed=0)
        for _ in range(2):
            _, _, terminated, truncated, _ = envs.step(np.zeros(3, int))
        assert (terminated | truncated).all()
        envs.reset(options={"reset_mask": np.array([True, True, False])})
        with pytest.raises(ResetNeeded, match="environment 2 has ended"):
            envs.step(np.zeros(3, int))
        envs.reset(options={"reset_mask": np.array([False, False, True])})
        envs.step(np.zeros(3, int))


class TestArrays:
    @each_id
    def test_copies_are_never_altered(self, id: str) -> None:
        envs = native(id, rate=0.3)
        kept = [envs.reset(seed=0)[0]]
        copies = [kept[0].copy()]
        for _ in range(300):
            kept.append(envs.step(np.zeros(NUM_ENVS, int))[0])
            copies.append(kept[-1].copy())
        assert all(np.array_equal(a, b) for a, b in zip(kept, copies, strict=True))

    @each_id
    def test_without_copies_it_is_one_array_with_the_same_bits(self, id: str) -> None:
        fast, safe = native(id, copy=False), native(id)
        buffer, _ = fast.reset(seed=0)
        assert np.array_equal(buffer, safe.reset(seed=0)[0])
        for _ in range(300):
            observations, *rest = fast.step(np.zeros(NUM_ENVS, int))
            expected, *same = safe.step(np.zeros(NUM_ENVS, int))
            assert observations is buffer
            assert np.array_equal(observations, expected)
            assert_same(rest, same)

    @each_id
    @each_mode
    def test_everything_else_is_new_at_each_step(self, id: str, mode: AutoresetMode) -> None:
        envs = native(id, copy=False, autoreset_mode=mode)
        envs.reset(seed=0)
        kept, snapshots = [], []
        for _ in range(400):
            _, *rest = envs.step(np.zeros(NUM_ENVS, int))
            kept.append(rest)
            snapshots.append([np.copy(x) for x in rest[:3]] + [repr(rest[3])])
            over = rest[1] | rest[2]
            if mode == AutoresetMode.DISABLED and over.any():
                envs.reset(options={"reset_mask": over})
        for rest, snapshot in zip(kept, snapshots, strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(rest[:3], snapshot[:3], strict=True))
            assert repr(rest[3]) == snapshot[3]

    @each_id
    def test_spaces_hold_what_is_returned(self, id: str) -> None:
        envs = native(id, n_inputs=17)
        observations, _ = envs.reset(seed=0)
        assert observations in envs.observation_space
        assert envs.step(envs.action_space.sample())[0] in envs.observation_space
        assert envs.single_observation_space == gym.make(id, n_inputs=17).observation_space
        assert envs.single_action_space == gym.make(id).action_space

    @each_id
    @pytest.mark.parametrize("dtype", [np.int64, np.int32, np.int8, np.uint8, np.bool_])
    def test_answers_may_be_of_any_whole_type(self, id: str, dtype: Any) -> None:
        envs, reference = native(id), native(id)
        envs.reset(seed=0)
        reference.reset(seed=0)
        for t in range(50):
            actions = np.arange(NUM_ENVS) == t % 7
            assert_same(envs.step(actions.astype(dtype)), reference.step(actions.astype(np.int64)))
        strided = np.zeros((NUM_ENVS, 2), np.int64)[:, 0]
        assert_same(envs.step(strided), reference.step(strided.copy()))


class TestGymnasium:
    @each_id
    def test_make_vec_takes_the_native_version_unless_told_otherwise(self, id: str) -> None:
        envs = gym.make_vec(id, num_envs=2)
        kind = PatternTrialVectorEnv if id == TRIAL else PatternStreamVectorEnv
        assert isinstance(envs.unwrapped, kind)
        assert envs.spec is not None and envs.spec.id == id

    @each_id
    @each_mode
    def test_metadata_tell_the_autoreset_mode(self, id: str, mode: AutoresetMode) -> None:
        for given in (mode, mode.value):
            assert native(id, autoreset_mode=given).metadata["autoreset_mode"] is mode
        assert native(id).metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP

    def test_the_stream_is_truncated_as_registered(self) -> None:
        envs = native(STREAM, num_envs=2, targets=(0,))
        envs.reset(seed=0)
        for _ in range(9_999):
            assert not envs.step(np.zeros(2, int))[3].any()
        _, rewards, terminated, truncated, infos = envs.step(np.zeros(2, int))
        assert truncated.all() and not terminated.any()
        assert rewards.tolist() == [1.0, 1.0] and infos == {}

    @each_mode
    def test_wrappers_for_vector_environments_work(self, mode: AutoresetMode) -> None:
        if mode == AutoresetMode.DISABLED:
            pytest.skip("statistics need an environment that resets itself")
        envs = DictInfoToList(RecordEpisodeStatistics(native(STREAM, autoreset_mode=mode)))
        envs.reset(seed=0)
        returns = []
        for _ in range(600):
            *_, infos = envs.step(np.zeros(NUM_ENVS, int))
            assert isinstance(infos, list)
            returns += [info["episode"]["r"] for info in infos if "episode" in info]
        lengths = [env_length(seed) for seed in range(NUM_ENVS)]
        assert set(lengths) <= set(np.array(returns).tolist())

    @each_id
    def test_task_and_patterns_may_be_given_whole(self, id: str) -> None:
        task = Task(n_classes=3, rate=0.02)
        whole = native(id, task=task, patterns=Patterns.draw(task, 4))
        fields = native(id, n_classes=3, rate=0.02, pattern_seed=4)
        assert_same(whole.reset(seed=1), fields.reset(seed=1))
        for _ in range(200):
            actions = np.zeros(NUM_ENVS, int)
            assert_same(whole.step(actions), fields.step(actions))


def env_length(seed: int) -> int:
    """Bins that silence survives in the single environment."""
    env = gym.make(STREAM)
    env.reset(seed=seed)
    n = 0
    while not env.step(0)[2]:
        n += 1
    return n


class TestBadInput:
    @each_id
    @pytest.mark.parametrize(
        ("kwargs", "why"),
        [
            ({"num_envs": 0}, "num_envs must be >= 1, got 0"),
            ({"num_envs": -3}, "num_envs must be >= 1, got -3"),
            ({"num_envs": 2.5}, "num_envs must be a whole number, got 2.5"),
            ({"max_episode_steps": 0}, "max_episode_steps must be >= 1, got 0"),
            ({"max_episode_steps": 2**30}, "must be at most 1,073,741,823, got 1073741824"),
            ({"render_mode": "rgb_array"}, "render_mode must be None, got 'rgb_array'"),
            ({"autoreset_mode": "sometimes"}, "must be one of 'NextStep', 'SameStep'"),
            ({"n_classes": 0}, "n_classes must be >= 1, got 0"),
            ({"rat": 0.1}, "unknown keyword 'rat'"),
            ({"patterns": Patterns.draw(Task(n_classes=2), 0)}, "patterns must have shape"),
            ({"pattern_seed": -1}, "pattern_seed must be >= 0"),
        ],
    )
    def test_arguments_that_make_no_environment(
        self, id: str, kwargs: dict[str, Any], why: str
    ) -> None:
        with pytest.raises(ValueError) as refusal:
            native(id, **kwargs)
        assert why in str(refusal.value)

    @pytest.mark.parametrize(
        ("kwargs", "why"),
        [
            ({"feedback": "reward"}, "feedback must be one of"),
            ({"output": "rate"}, "output must be one of"),
            ({"max_output": -1.0}, "max_output must be > 0"),
            ({"tolerance": -1.0}, "tolerance must be >= 0"),
        ],
    )
    def test_arguments_of_trials(self, kwargs: dict[str, Any], why: str) -> None:
        with pytest.raises(ValueError, match=why):
            native(TRIAL, **kwargs)
        with pytest.raises(ValueError, match="unknown keyword"):
            native(STREAM, **kwargs)

    @each_id
    @pytest.mark.parametrize(
        ("actions", "why"),
        [
            (np.zeros(4, int), r"shape \(5,\), one per environment, got int64 of shape \(4,\)"),
            (np.zeros((5, 1), int), r"got int64 of shape \(5, 1\)"),
            (0, r"got int64 of shape \(\)"),
            (np.zeros(5), r"whole numbers .* got float64"),
            (None, r"whole numbers .* got object"),
            (np.array([0, 0, 2, 0, 0]), "got np.int64\\(2\\) for environment 2"),
            (np.array([0, -1, 0, 0, 7]), "got np.int64\\(-1\\) for environment 1"),
        ],
    )
    def test_actions_outside_the_space_are_refused_and_change_nothing(
        self, id: str, actions: Any, why: str
    ) -> None:
        envs, twin = native(id), native(id)
        envs.reset(seed=0)
        twin.reset(seed=0)
        with pytest.raises(ValueError, match=why):
            envs.step(actions)
        for _ in range(200):
            assert_same(envs.step(np.zeros(5, int)), twin.step(np.zeros(5, int)))

    @pytest.mark.parametrize(
        "actions",
        [np.zeros(5), np.full((5, 1), np.nan), np.full((5, 1), 4.1), np.full((5, 1), -1), "x"],
    )
    def test_amounts_outside_the_space_are_refused(self, actions: Any) -> None:
        envs = native(TRIAL, output="graded", max_output=4.0)
        envs.reset(seed=0)
        envs.step(np.full((5, 1), 4.0))
        with pytest.raises(ValueError, match=r"action must be one amount|actions must be numbers"):
            envs.step(actions)

    @each_id
    def test_the_action_that_is_ignored_may_be_anything_whole(self, id: str) -> None:
        envs = native(id, num_envs=1)
        envs.reset(seed=0)
        while not envs.step(np.zeros(1, int))[2].any():
            pass
        envs.step(np.array([99]))

    @each_id
    def test_step_before_reset(self, id: str) -> None:
        envs = native(id)
        with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
            envs.step(np.zeros(5, int))
        with pytest.raises(ResetNeeded, match="once for all"):
            envs.reset(options={"reset_mask": np.ones(5, np.bool_)})

    @each_id
    def test_step_after_an_end_without_autoreset(self, id: str) -> None:
        envs = native(id, autoreset_mode=AutoresetMode.DISABLED)
        envs.reset(seed=0)
        over = np.zeros(5, np.bool_)
        while not over.any():
            _, _, terminated, truncated, _ = envs.step(np.zeros(5, int))
            over = terminated | truncated
        with pytest.raises(ResetNeeded, match=rf"environment {over.argmax()} has ended"):
            envs.step(np.zeros(5, int))
        envs.reset(options={"reset_mask": over})
        envs.step(np.zeros(5, int))

    @each_id
    @pytest.mark.parametrize("seed", [[1, 2], [1, 2, 3, 4, 5, 6], []])
    def test_a_list_of_seeds_of_the_wrong_length(self, id: str, seed: Any) -> None:
        with pytest.raises(ValueError, match=rf"num_envs = 5, got {len(seed)} seeds"):
            native(id).reset(seed=seed)

    @each_id
    @pytest.mark.parametrize(
        "seed", [1.5, "ab", "abcde", [1, 2, 3, 4, 0.5], {1: 2}, {1, 2, 3, 4, 5}, np.zeros((5, 2))]
    )
    def test_seeds_that_are_no_whole_numbers(self, id: str, seed: Any) -> None:
        with pytest.raises(ValueError, match="seed must be a whole number or one per environment"):
            native(id).reset(seed=seed)

    @each_id
    def test_a_seed_that_is_refused_changes_none(self, id: str) -> None:
        envs = native(id)
        envs.reset(seed=1)
        with pytest.raises(ValueError, match=r"seed\[2\] must be >= 0, got -1"):
            envs.reset(seed=[7, 8, -1, 9, 10])
        assert envs.np_random_seed == (1, 2, 3, 4, 5)

    @each_id
    @pytest.mark.parametrize(
        "mask", [np.zeros(5, np.bool_), np.ones(4, np.bool_), np.ones(5, int), [True] * 5]
    )
    def test_a_reset_mask_that_is_none(self, id: str, mask: Any) -> None:
        envs = native(id)
        envs.reset(seed=0)
        with pytest.raises(ValueError, match=r"bool array of shape \(5,\) with at least one True"):
            envs.reset(options={"reset_mask": mask})

    @each_id
    def test_an_unknown_reset_option(self, id: str) -> None:
        with pytest.raises(ValueError, match="unknown reset option 'trial'"):
            native(id).reset(options={"trial": None})


class TestCopies:
    @each_variant
    @each_mode
    def test_copies_go_on_in_the_middle_of_an_episode(
        self, id: str, kwargs: dict[str, Any], mode: AutoresetMode
    ) -> None:
        if mode == AutoresetMode.DISABLED:
            kwargs = {**kwargs, "max_episode_steps": 1_000}
        envs = native(id, autoreset_mode=mode, **kwargs)
        envs.reset(seed=1)
        rng = np.random.default_rng(0)
        over = np.zeros(NUM_ENVS, np.bool_)
        for _ in range(60):
            if mode == AutoresetMode.DISABLED and over.any():
                reset_ended(envs, over)
            step = envs.step(answers(envs, rng))
            over = step[2] | step[3]
        twins = [pickle.loads(pickle.dumps(envs)), copy.deepcopy(envs)]
        for _ in range(200):
            if mode == AutoresetMode.DISABLED and over.any():
                for one in (envs, *twins):
                    reset_ended(one, over)
            actions = answers(envs, rng)
            step = envs.step(actions)
            over = step[2] | step[3]
            for twin in twins:
                assert_same(step, twin.step(actions))

    @each_id
    def test_a_copy_of_one_that_has_not_begun_begins_alike(self, id: str) -> None:
        envs = native(id)
        twin = copy.deepcopy(envs)
        assert_same(envs.reset(seed=3), twin.reset(seed=3))


class TestThreads:
    @each_id
    def test_a_second_thread_is_refused_in_a_sentence(self, id: str) -> None:
        envs: Any = native(id)
        envs.reset(seed=0)
        with envs.unwrapped._entry:  # as while another thread is inside
            for call in (
                lambda: envs.step(np.zeros(NUM_ENVS, int)),
                envs.reset,
                lambda: copy.copy(envs.unwrapped),
            ):
                with pytest.raises(ValueError, match="another thread is stepping"):
                    call()
        envs.step(np.zeros(NUM_ENVS, int))

    @each_id
    def test_after_a_refusal_everybody_may_come_in_again(self, id: str) -> None:
        envs = native(id)
        envs.reset(seed=0)
        for wrong in (None, np.full(NUM_ENVS, 2), [[0], 0]):
            with pytest.raises(ValueError):
                envs.step(wrong)
        envs.step(np.zeros(NUM_ENVS, int))
