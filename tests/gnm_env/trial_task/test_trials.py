"""A data set in place of a task: every trial once an epoch, alone and many at once alike."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from gnm_env import Patterns, Task, Trial, Trials, draw_trial
from gnm_env.wrappers import SynapticTrace
from tests.gnm_env.test_vector_environments import assert_same

ID = "gnm/PatternTrial-v0"
TASK = Task(n_classes=2, n_inputs=20, rate=0.05, background_bins=15, pattern_bins=8)


def recorded() -> Trials:
    """Drawn trials, one with presentations of unequal length, one with the label alone."""
    rng = np.random.default_rng(0)
    patterns = Patterns.draw(TASK, 0)
    trials = [draw_trial(TASK, patterns, rng) for _ in range(5)]
    bits = rng.random((40, 20)) < 0.1
    trials.append(Trial.from_dense(bits[:30], [3, 20], [0, 1], ends=[5, 29], targets=[1, 4]))
    trials.append(Trial.from_dense(bits, label=5))
    trials.append(Trial.from_dense(bits[:9], [0], [0], ends=[9], targets=[1]))
    return Trials(trials)


TRIALS = recorded()
KNOWN = TRIALS[[0, 1, 2, 3, 4, 5, 7]]
"""Those of which more than the label is known."""


def play(env: gym.Env[Any, Any], spikes: set[int] = frozenset()) -> tuple[Any, dict[str, Any]]:  # type: ignore[assignment]
    """The rest of a trial after `reset`: rewards, and the terminal info."""
    rewards = []
    for t in range(env.unwrapped.trial.n_bins):  # type: ignore[attr-defined]
        _, reward, terminated, _, info = env.step(int(t in spikes))
        rewards.append(reward)
    assert terminated
    return rewards, info


def heard(env: gym.Env[Any, Any], n: int) -> list[bytes]:
    """What the next trials sound like."""
    rasters = []
    for _ in range(n):
        env.reset()
        rasters.append(env.unwrapped.trial.dense().tobytes())  # type: ignore[attr-defined]
    return rasters


def in_order(*seeds_or_rng: Any) -> list[bytes]:
    """What epochs sound like, whose orders come from `rng`."""
    (rng,) = seeds_or_rng
    return [TRIALS[int(k)].dense().tobytes() for k in rng.permutation(len(TRIALS))]


def test_an_epoch_is_a_permutation_from_the_environments_generator() -> None:
    env, rng = gym.make(ID, trials=TRIALS), np.random.default_rng(3)
    env.reset(seed=3)
    first = [env.unwrapped.trial.dense().tobytes()]  # type: ignore[attr-defined]
    assert first + heard(env, len(TRIALS) - 1) == in_order(rng)
    assert heard(env, len(TRIALS)) == in_order(rng)
    assert env.unwrapped.np_random.bit_generator.state == rng.bit_generator.state


def test_an_epoch_begins_anew_with_the_generator_even_the_same_object() -> None:
    env = gym.make(ID, trials=TRIALS).unwrapped
    rng = np.random.default_rng(9)
    twin = copy.deepcopy(rng)
    env.np_random = rng
    assert heard(env, 3) == in_order(twin)[:3]
    env.np_random = rng
    assert heard(env, 3) == in_order(twin)[:3]
    env.reset(seed=4)
    env.reset(seed=4)
    assert heard(env, 2) == in_order(np.random.default_rng(4))[1:3]


def test_a_given_trial_takes_no_turn() -> None:
    env = gym.make(ID, trials=TRIALS)
    env.reset(seed=3)
    env.reset(options={"trial": TRIALS[0]})
    assert heard(env, 2) == in_order(np.random.default_rng(3))[1:3]


def test_what_the_bits_are_and_what_is_told_at_the_end() -> None:
    env = gym.make(ID, trials=TRIALS)
    for k, trial in enumerate(TRIALS):
        obs, _ = env.reset(seed=0, options={"trial": trial})
        assert np.array_equal(obs, trial.dense()[0])
        _, info = play(env)
        assert info["label"] == trial.label and info["classes"] == trial.classes.tolist()
        assert info["onsets"] == trial.onsets.tolist()
        assert info["targets"] == trial.targets.tolist()
        assert info["pattern_bins"] == (trial.pattern_bins or 0)
        assert info.get("ends") == ([5, 29] if k == 5 else None)
        assert info.get("label_only") is (True if k == 6 else None)


def test_dense_feedback_follows_presentations_of_any_length() -> None:
    env = gym.make(ID, trials=KNOWN, feedback="dense")
    env.reset(seed=0, options={"trial": TRIALS[5]})
    rewards, _ = play(env, {0, 3, 20, 21, 29})
    expected = {0: -1.0, 28: -2.0, 29: -1.0}
    assert rewards == [expected.get(t, 0.0) for t in range(30)]


def test_dense_feedback_refuses_labels_alone() -> None:
    for make in (gym.make, gym.make_vec):
        with pytest.raises(ValueError, match="needs to know where the label was earned"):
            make(ID, trials=TRIALS, feedback="dense")
    env = gym.make(ID, task=TASK, feedback="dense")
    with pytest.raises(ValueError, match="needs to know where the label was earned"):
        env.reset(options={"trial": TRIALS[6]})
    gym.make(ID, task=TASK).reset(options={"trial": TRIALS[6]})


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)
@pytest.mark.parametrize(
    "kwargs",
    [
        {"trials": TRIALS},
        {"trials": TRIALS, "feedback": "sign", "output": "graded", "tolerance": 0.25},
        {"trials": KNOWN, "feedback": "dense"},
        {"trials": TRIALS[:4], "max_episode_steps": 40},
        {"trials": TRIALS[6:7]},
    ],
    ids=["all", "graded", "dense", "equal and truncated", "one"],
)
def test_many_at_once_are_the_single_environments(
    kwargs: dict[str, Any], mode: AutoresetMode
) -> None:
    ours: Any = gym.make_vec(ID, num_envs=4, autoreset_mode=mode, **kwargs)
    theirs: Any = gym.make_vec(
        ID, num_envs=4, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **kwargs
    )
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    rng, done = np.random.default_rng(1), np.zeros(4, np.bool_)
    for t in range(400):
        if done.any() and mode == AutoresetMode.DISABLED:
            both = [e.reset(options={"reset_mask": done.copy()}) for e in (ours, theirs)]
            assert_same(*both)
        actions = (rng.random(4) < 0.05).astype(int)
        if "output" in kwargs:
            actions = (actions * rng.random(4))[:, None]
        step = ours.step(actions)
        assert_same(step, theirs.step(actions))
        done = step[2] | step[3]
        if t in (150, 250):
            seed = 30 if t == 150 else None
            assert_same(ours.reset(seed=seed), theirs.reset(seed=seed))
            done[:] = False
    for one, other in zip(ours.np_random, theirs.np_random, strict=True):
        assert one.bit_generator.state == other.bit_generator.state


def test_the_data_set_is_shared_by_all_environments_and_stays_one_in_a_copy() -> None:
    envs: Any = gym.make_vec(ID, num_envs=50, trials=TRIALS)
    envs.reset(seed=0)
    assert envs._source.trials is TRIALS.arrays
    twin: Any = pickle.loads(pickle.dumps(envs))
    assert twin._source.trials.channels is twin.trials.arrays.channels
    for _ in range(60):
        assert_same(envs.step(np.zeros(50, int)), twin.step(np.zeros(50, int)))


def test_single_environments_pickle_in_the_middle_of_an_epoch() -> None:
    env = gym.make(ID, trials=TRIALS).unwrapped
    env.reset(seed=2)
    heard(env, 3)
    twin = pickle.loads(pickle.dumps(env))
    assert heard(env, 12) == heard(twin, 12)


def test_attributes_say_that_there_is_no_task() -> None:
    for env in (gym.make(ID, trials=TRIALS).unwrapped, gym.make_vec(ID, trials=TRIALS).unwrapped):
        assert env.task is None and env.patterns is None  # type: ignore[union-attr]
        assert env.trials is TRIALS  # type: ignore[union-attr]
    drawn = gym.make(ID).unwrapped
    assert drawn.trials is None and drawn.task == Task()  # type: ignore[attr-defined]


def test_gymnasium_finds_nothing_to_complain_of() -> None:
    check_env(gym.make(ID, trials=TRIALS).unwrapped)


def test_traces_go_by_the_rate_of_the_data_set() -> None:
    rate = float(TRIALS.rates.mean())
    ours = SynapticTrace(gym.make(ID, trials=TRIALS))
    told = SynapticTrace(gym.make(ID, trials=TRIALS), rate=rate)
    assert ours.observation_space == told.observation_space


def test_pictures_show_data_sets_too() -> None:
    env = gym.make(ID, trials=TRIALS, render_mode="rgb_array")
    shapes = set()
    for trial in TRIALS:
        env.reset(options={"trial": trial})
        play(env, {1})
        shapes.add(env.render().shape)  # type: ignore[union-attr]
    assert shapes == {(500, 696, 3)}


@pytest.mark.parametrize(
    ("kwargs", "why"),
    [
        ({"trials": [TRIALS[0]]}, "trials must be gnm_env.Trials, got list; use Trials"),
        ({"trials": TRIALS, "task": TASK}, "give either trials or a task.*got trials and task"),
        ({"trials": TRIALS, "n_classes": 2}, "got trials and n_classes"),
        ({"trials": TRIALS, "pattern_seed": 2}, "got trials and pattern_seed"),
    ],
)
def test_what_does_not_go_together_is_refused(kwargs: dict[str, Any], why: str) -> None:
    for make in (gym.make, gym.make_vec):
        with pytest.raises(ValueError, match=why):
            make(ID, **kwargs)


def test_a_trial_with_other_channels_is_refused() -> None:
    env = gym.make(ID, trials=TRIALS)
    with pytest.raises(ValueError, match="the trial must have n_inputs = 20, got"):
        env.reset(options={"trial": Trial.from_dense(np.zeros((5, 3)), label=1)})
