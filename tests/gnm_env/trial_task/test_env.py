"""gnm/PatternTrial-v0: rewards, terminal info, and policies whose scores are known exactly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv

from gnm_env import Patterns, Task, Trial, draw_trial
from gnm_env.trial_task.params import FEEDBACK

ID = "gnm/PatternTrial-v0"
Policy = Callable[[Trial, int], float]

TASKS = {
    "one class": Task(),
    "four classes": Task(n_classes=4),
    "distractor": Task(n_classes=3, targets=(0, 2, 0)),
    "jitter and deletion": Task(n_classes=2, jitter_bins=3, deletion=0.5),
    "no occurrences": Task(mean_occurrences=0.0),
}
each_task = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS.keys())
each_feedback = pytest.mark.parametrize("feedback", FEEDBACK)


def oracle(trial: Trial, t: int) -> int:
    """Knows onsets and classes: as many spikes as are owed, at the start of each occurrence."""
    owner = trial.owner()[t]
    return int(owner >= 0 and t - trial.onsets[owner] < trial.targets[owner])


def silent(trial: Trial, t: int) -> int:
    return 0


def restless(trial: Trial, t: int) -> int:
    return 1


def random_policy() -> Policy:
    rng = np.random.default_rng(0)
    return lambda trial, t: int(rng.random() < 0.5)


def play(
    env: gym.Env[Any, Any], policy: Policy, **reset: Any
) -> tuple[list[float], dict[str, Any]]:
    """Rewards of one trial, and the terminal info."""
    env.reset(**reset)
    trial = env.unwrapped.trial  # type: ignore[attr-defined]
    rewards = []
    for t in range(trial.n_bins):
        _, reward, terminated, truncated, info = env.step(policy(trial, t))
        rewards.append(float(reward))
        assert terminated == (t == trial.n_bins - 1)
        assert not truncated
        assert bool(info) == terminated
    return rewards, info


@each_task
@each_feedback
def test_an_oracle_scores_exactly_the_maximum(task: Task, feedback: str) -> None:
    env = gym.make(ID, task=task, feedback=feedback)
    for seed in range(20):
        rewards, info = play(env, oracle, seed=seed)
        assert rewards == [0.0] * len(rewards)
        assert info["emitted"] == info["label"]


@each_task
@each_feedback
def test_silence_scores_what_the_arithmetic_says(task: Task, feedback: str) -> None:
    env = gym.make(ID, task=task, feedback=feedback)
    for seed in range(20):
        rewards, info = play(env, silent, seed=seed)
        assert info["emitted"] == 0
        expected = np.sign(info["label"]) if feedback == "sign" else -info["label"]
        assert sum(rewards) == expected


@each_feedback
def test_policies_rank_as_they_should(feedback: str) -> None:
    env = gym.make(ID, n_classes=2, feedback=feedback)
    env.reset(seed=0)
    mean = {
        name: np.mean([abs(sum(play(env, policy)[0])) for _ in range(100)])
        for name, policy in {
            "oracle": oracle, "silent": silent, "random": random_policy(), "restless": restless
        }.items()
    }  # fmt: skip
    if feedback == "sign":  # all wrong answers cost the same
        assert mean["oracle"] == 0 < mean["silent"] <= mean["random"] == mean["restless"] == 1
    else:
        assert mean["oracle"] == 0 < mean["silent"] < mean["random"] < mean["restless"]
        # 2 occurrences of each class on average, owing 1 and 2 spikes: 6.
        assert mean["silent"] == pytest.approx(6.0, abs=1.6)  # four standard errors


class TestFeedback:
    """A trial of 12 bins: pattern 1 (owes 2) in bins 2–4, pattern 0 (owes 1) in bins 5–7."""

    TASK = Task(n_inputs=3, pattern_bins=3, n_classes=2)
    TRIAL = Trial.from_dense(np.zeros((12, 3)), [2, 5], [1, 0], TASK)

    def rewards(self, feedback: str, spikes: set[int]) -> tuple[list[float], dict[str, Any]]:
        env = gym.make(ID, task=self.TASK, feedback=feedback)
        options = {"trial": self.TRIAL}
        return play(env, lambda trial, t: int(t in spikes), seed=0, options=options)

    @pytest.mark.parametrize(
        ("spikes", "cost", "sign"),
        [
            (set(), -3, 1),
            ({0}, -2, 1),
            ({0, 11}, -1, 1),
            ({3, 4, 7}, 0, 0),
            ({0, 1, 11}, 0, 0),  # wrong everywhere, right in sum
            ({0, 1, 2, 3}, -1, -1),
            (set(range(12)), -9, -1),
        ],
    )
    def test_cost_and_sign_compare_sums_at_the_end(
        self, spikes: set[int], cost: float, sign: float
    ) -> None:
        for feedback, expected in (("cost", cost), ("sign", sign)):
            rewards, info = self.rewards(feedback, spikes)
            assert rewards == [0.0] * 11 + [float(expected)]
            assert info["emitted"] == len(spikes)

    @pytest.mark.parametrize(
        ("spikes", "expected"),
        [
            (set(), {4: -2, 7: -1}),
            ({0}, {0: -1, 4: -2, 7: -1}),
            ({2, 4, 5}, {}),
            ({2, 3, 4, 5, 6}, {4: -1, 7: -1}),
            ({1, 3, 8, 11}, {1: -1, 4: -1, 7: -1, 8: -1, 11: -1}),
        ],
    )
    def test_dense_pays_at_once_in_noise_and_at_the_end_of_each_occurrence(
        self, spikes: set[int], expected: dict[int, float]
    ) -> None:
        rewards, _ = self.rewards("dense", spikes)
        assert rewards == [float(expected.get(t, 0)) for t in range(12)]

    @each_feedback
    def test_an_occurrence_may_end_in_the_last_bin(self, feedback: str) -> None:
        env = gym.make(ID, task=self.TASK, feedback=feedback)
        trial = Trial.from_dense(np.zeros((12, 3)), [9], [1], self.TASK)
        rewards, _ = play(env, silent, options={"trial": trial}, seed=0)
        assert rewards == [0.0] * 11 + [1.0 if feedback == "sign" else -2.0]

    @each_feedback
    def test_rewards_are_plain_floats_and_never_minus_zero(self, feedback: str) -> None:
        env = gym.make(ID, task=self.TASK, feedback=feedback)
        env.reset(options={"trial": self.TRIAL}, seed=0)
        for t in range(12):
            reward = env.step(oracle(self.TRIAL, t))[1]
            assert type(reward) is float and str(reward) == "0.0"


class TestGradedOutput:
    def test_an_oracle_may_answer_in_one_amount(self) -> None:
        for feedback in FEEDBACK:
            env = gym.make(ID, n_classes=3, feedback=feedback, output="graded")

            def amount(trial: Trial, t: int) -> Any:
                owner = trial.owner()[t]
                begins = owner >= 0 and t == trial.onsets[owner] + 7
                return np.array([trial.targets[owner] if begins else 0.0])

            for seed in range(10):
                rewards, info = play(env, amount, seed=seed)
                assert rewards == [0.0] * len(rewards)
                assert info["emitted"] == info["label"]
                assert type(info["emitted"]) is float

    @pytest.mark.parametrize(
        ("given", "tolerance", "cost", "sign"),
        [
            (2.75, 0.0, -0.25, 1.0),
            (2.75, 0.25, 0.0, 0.0),
            (2.5, 0.25, -0.5, 1.0),
            (3.25, 0.25, 0.0, 0.0),
            (3.5, 0.25, -0.5, -1.0),
        ],
    )
    def test_errors_within_the_tolerance_count_as_none(
        self, given: float, tolerance: float, cost: float, sign: float
    ) -> None:
        for feedback, expected in (("cost", cost), ("sign", sign)):
            env = gym.make(
                ID, task=TestFeedback.TASK, feedback=feedback, output="graded", tolerance=tolerance
            )
            rewards, _ = play(
                env,
                lambda trial, t: given if t == 3 else 0.0,
                seed=0,
                options={"trial": TestFeedback.TRIAL},
            )
            assert rewards[-1] == expected

    def test_dense_feedback_weighs_amounts(self) -> None:
        env = gym.make(
            ID, task=TestFeedback.TASK, feedback="dense", output="graded", tolerance=0.25
        )
        given = {0: 0.5, 2: 1.0, 3: 0.875, 6: 3.0}
        rewards, _ = play(
            env, lambda trial, t: given.get(t, 0.0), seed=0, options={"trial": TestFeedback.TRIAL}
        )
        assert rewards == [-0.5, 0, 0, 0, 0.0, 0, 0, -2.0, 0, 0, 0, 0]

    @pytest.mark.parametrize(
        "action",
        [-0.1, 4.1, np.nan, [1.0, 2.0], None, "x", "1", ["0.5"], 1j, [[]], [1, [2]], {}],
    )
    def test_an_amount_outside_the_space_is_refused(self, action: Any) -> None:
        env = gym.make(ID, output="graded", max_output=4.0)
        env.reset(seed=0)
        env.step(np.array([4.0]))
        with pytest.raises(ValueError, match=r"action must be one amount in 0 … 4 \(max_output\)"):
            env.step(action)

    def test_the_action_space_holds_the_amounts(self) -> None:
        env = gym.make(ID, output="graded", max_output=4.0)
        assert env.action_space == gym.spaces.Box(0.0, 4.0, (1,), np.float64)


class TestTrialsThatAreHeard:
    @pytest.mark.parametrize("task", TASKS.values(), ids=TASKS.keys())
    def test_a_seed_means_the_same_for_the_environment_and_for_draw_trial(self, task: Task) -> None:
        patterns = Patterns.draw(task, 0)
        env = gym.make(ID, task=task, patterns=patterns)
        rng = np.random.default_rng(11)
        for k in range(4):
            expected = draw_trial(task, patterns, rng)
            obs, _ = env.reset(seed=11 if k == 0 else None)
            heard = [obs]
            while not (step := env.step(0))[2]:
                heard.append(step[0])
            assert np.array_equal(heard, expected.dense())
            assert not step[0].any()  # zeros after the last answer
            info = step[4]
            assert info["onsets"] == expected.onsets.tolist()
            assert info["classes"] == expected.classes.tolist()
            assert info["targets"] == expected.targets.tolist()
            assert info["label"] == expected.label
            assert info["pattern_bins"] == task.pattern_bins

    def test_step_draws_nothing(self) -> None:
        env = gym.make(ID)
        env.reset(seed=0)
        state = env.unwrapped.np_random.bit_generator.state
        while not env.step(0)[2]:
            pass
        assert env.unwrapped.np_random.bit_generator.state == state

    def test_a_given_trial_is_played_and_draws_nothing(self) -> None:
        task = Task(n_inputs=6, pattern_bins=4, n_classes=2)
        raster = np.random.default_rng(0).random((30, 6)) < 0.5
        trial = Trial.from_dense(raster, [3, 20], [1, 0], task)
        env = gym.make(ID, task=task)
        env.reset(seed=0)
        state = env.unwrapped.np_random.bit_generator.state
        for _ in range(2):  # as often as one likes
            obs, _ = env.reset(options={"trial": trial})
            heard = [obs]
            while not (step := env.step(0))[2]:
                heard.append(step[0])
            assert np.array_equal(heard, raster)
            assert step[4]["onsets"] == [3, 20] and step[4]["label"] == 3
        assert env.unwrapped.np_random.bit_generator.state == state

    @pytest.mark.parametrize(
        ("trial", "why"),
        [
            (np.zeros((10, 100)), "must be a gnm_env.Trial, got ndarray"),
            (Trial.from_dense(np.zeros((60, 99)), [], [], Task(n_inputs=99)), "(100, 50)"),
            (Trial.from_dense(np.zeros((60, 100)), [], [], Task(pattern_bins=9)), "(100, 50)"),
        ],
    )
    def test_a_trial_that_does_not_fit_is_refused(self, trial: Any, why: str) -> None:
        env = gym.make(ID)
        with pytest.raises(ValueError) as refusal:
            env.reset(options={"trial": trial})
        assert why in str(refusal.value)

    def test_trials_of_any_number_of_occurrences_stand_side_by_side(self) -> None:
        envs = SyncVectorEnv([lambda: gym.make(ID)] * 6)
        envs.reset(seed=0)
        ended = 0
        for _ in range(1500):
            *_, infos = envs.step(np.zeros(6, int))
            for i in np.flatnonzero(infos.get("_label", [])):
                assert infos["label"][i] == sum(infos["targets"][i])
                ended += 1
        assert ended > 20


@pytest.mark.parametrize(
    ("kwargs", "why"),
    [
        ({"feedback": "reward"}, "feedback must be one of 'cost', 'sign', 'dense', got 'reward'"),
        ({"output": "rate"}, "output must be one of 'spikes', 'graded', got 'rate'"),
        ({"max_output": 0.0}, "max_output must be > 0, got 0.0"),
        ({"max_output": float("inf")}, "max_output must be finite"),
        ({"tolerance": -0.1}, "tolerance must be >= 0, got -0.1"),
    ],
)
def test_arguments_out_of_range(kwargs: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError) as refusal:
        gym.make(ID, **kwargs)
    assert why in str(refusal.value)
