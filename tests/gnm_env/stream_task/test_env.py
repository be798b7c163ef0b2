"""gnm/PatternStream-v0: mistakes, and policies whose scores are known exactly."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from gnm_env import Patterns, Task
from tests.gnm_env import reference

ID = "gnm/PatternStream-v0"

TASKS = {
    "one class": Task(),
    "four classes": Task(n_classes=4),
    "distractors": Task(n_classes=3, targets=(0, 2, 0)),
    "jitter and deletion": Task(n_classes=2, jitter_bins=3, deletion=0.5),
    "crowded": Task(n_classes=2, onset_probability=0.5, pattern_bins=4),
    "patterns alone": Task(onset_probability=1.0, pattern_bins=3),
    "rare patterns": Task(onset_probability=0.0004),
}
each_task = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS.keys())


def survive(env: gym.Env[Any, Any], answers: Any, **reset: Any) -> tuple[int, Any]:
    """Return and last step of one episode."""
    env.reset(**reset)
    score = 0.0
    for answer in answers:
        step = env.step(answer)
        score += float(step[1])
        if step[2] or step[3]:
            return int(score), step
    raise AssertionError("the answers came to an end before the episode did")


@each_task
def test_an_oracle_survives_to_the_cap(task: Task) -> None:
    patterns = Patterns.draw(task, 0)
    env = gym.make(ID, task=task, patterns=patterns)
    _, classes, places = reference.stream(task, patterns.dense(), np.random.default_rng(3), 10_000)
    answers = reference.perfect_answers(task, classes, places)
    score, step = survive(env, answers, seed=3)
    assert score == 10_000
    assert step[2] is False and step[3] is True and step[4] == {}


@each_task
def test_what_is_heard_is_the_stream_of_the_seed(task: Task) -> None:
    patterns = Patterns.draw(task, 0)
    env = gym.make(ID, task=task, patterns=patterns, max_episode_steps=3_000)
    raster, classes, places = reference.stream(
        task, patterns.dense(), np.random.default_rng(5), 3_001
    )
    heard = [env.reset(seed=5)[0]]
    for answer in reference.perfect_answers(task, classes, places)[:3_000]:
        heard.append(env.step(answer)[0])
    # the observation that comes with the truncation is the true next bin
    assert np.array_equal(heard, raster[:3_001])


@pytest.mark.parametrize("seed", range(12))
def test_silence_survives_the_first_pattern_but_for_its_last_bin(seed: int) -> None:
    task = Task(n_classes=2)
    patterns = Patterns.draw(task, 0)
    before, _, class_ = next(reference.pieces(task, patterns.dense(), np.random.default_rng(seed)))
    env = gym.make(ID, task=task, patterns=patterns)
    score, step = survive(env, itertools.repeat(0), seed=seed)
    assert score == len(before) + task.pattern_bins - 1
    assert step[1:] == (0.0, True, False, {"mistake": "too few", "class": class_})


def test_silence_scores_148_on_average() -> None:
    """Six standard errors: false alarm 2e-9."""
    env = gym.make(ID, n_inputs=1)
    scores = [survive(env, itertools.repeat(0), seed=0)[0]]
    scores += [survive(env, itertools.repeat(0))[0] for _ in range(1_999)]
    standard_error = np.sqrt(0.99) / 0.01 / np.sqrt(len(scores))
    assert abs(np.mean(scores) - Task().silent_score) < 6 * standard_error
    assert min(scores) >= 49  # the noise before the pattern may be missing


def test_silence_never_errs_where_nothing_is_owed() -> None:
    env = gym.make(ID, targets=(0,))
    score, step = survive(env, itertools.repeat(0), seed=0)
    assert (score, step[3]) == (10_000, True)


def test_a_random_policy_falls_far_below_silence() -> None:
    rng = np.random.default_rng(0)
    env = gym.make(ID)
    env.reset(seed=0)
    spikes = (int(rng.random() < 0.5) for _ in itertools.count())
    scores = [survive(env, spikes)[0] for _ in range(500)]
    assert np.mean(scores) < 3


class TestMistakes:
    TASK = Task(n_classes=2, onset_probability=1.0, pattern_bins=5)

    def play(self, spikes: list[int], seed: int = 0) -> tuple[int, dict[str, Any], int]:
        """Score, info and class of the first pattern, with the answers `spikes`, then silence."""
        patterns = Patterns.draw(self.TASK, 0)
        env = gym.make(ID, task=self.TASK, patterns=patterns)
        _, _, class_ = next(
            reference.pieces(self.TASK, patterns.dense(), np.random.default_rng(seed))
        )
        score, step = survive(env, itertools.chain(spikes, itertools.repeat(0)), seed=seed)
        return score, step[4], class_

    @pytest.mark.parametrize("seed", range(6))
    def test_too_many_ends_in_the_bin_of_the_surplus_spike(self, seed: int) -> None:
        score, info, class_ = self.play([0, 1, 1, 1, 1], seed)
        assert score == 2 + class_  # class c owes c + 1; the bin of the mistake is not counted
        assert info == {"mistake": "too many", "class": class_}

    @pytest.mark.parametrize("seed", range(6))
    def test_too_few_ends_in_the_last_bin(self, seed: int) -> None:
        score, info, class_ = self.play([0, 0, 0, 0, 0], seed)
        assert score == 4
        assert info == {"mistake": "too few", "class": class_}

    @pytest.mark.parametrize("seed", range(6))
    def test_the_last_bin_still_counts(self, seed: int) -> None:
        _, _, class_ = self.play([], seed)
        score, _, _ = self.play([0, 0, 0, class_, 1], seed)
        assert score >= 9  # survived the first pattern whole, and silence in most of the second

    def test_a_spike_in_noise(self) -> None:
        env = gym.make(ID, onset_probability=0.0)
        score, step = survive(env, [0] * 77 + [1], seed=0)
        assert score == 77
        assert step[1:] == (0.0, True, False, {"mistake": "noise", "class": -1})

    def test_the_observation_that_comes_with_a_mistake_is_the_true_next_bin(self) -> None:
        task = Task(rate=0.3)
        patterns = Patterns.draw(task, 0)
        raster, *_ = reference.stream(task, patterns.dense(), np.random.default_rng(1), 300)
        env = gym.make(ID, task=task, patterns=patterns)
        score, step = survive(env, itertools.repeat(0), seed=1)
        assert np.array_equal(step[0], raster[score + 1])


class TestGoingOn:
    """`reset()` without a seed goes on in the same stream."""

    @staticmethod
    def heard(env: gym.Env[Any, Any], answers: list[int]) -> list[list[int]]:
        observations = [env.reset()[0]]
        for answer in answers:
            observations.append(env.step(answer)[0])
        return [obs.tolist() for obs in observations]

    def test_after_a_mistake_in_noise_it_goes_on_after_the_bin_shown_last(self) -> None:
        task = Task(rate=0.3, onset_probability=0.0)
        patterns = Patterns.draw(task, 0)
        raster, *_ = reference.stream(
            replace(task, onset_probability=1e-9), patterns.dense(), np.random.default_rng(2), 100
        )
        env = gym.make(ID, task=task, patterns=patterns)
        env.reset(seed=2)
        for answer in (0, 0, 0, 1):
            env.step(answer)  # shows bins 1 … 4
        assert self.heard(env, [0] * 10) == raster[5:16].astype(int).tolist()

    def test_out_of_a_pattern_it_goes_on_after_the_pattern(self) -> None:
        task = Task(rate=0.3)
        patterns = Patterns.draw(task, 0)
        pieces = reference.pieces(task, patterns.dense(), np.random.default_rng(2))
        (before, _, _), (after, _, _) = next(pieces), next(pieces)
        assert len(before) > 2 and len(after) > 4
        env = gym.make(ID, task=task, patterns=patterns)
        env.reset(seed=2)
        for _ in range(len(before) + 3):
            env.step(0)
        assert self.heard(env, [0] * 3) == after[:4].astype(int).tolist()

    def test_the_count_of_spikes_starts_again(self) -> None:
        task = Task(onset_probability=1.0, pattern_bins=5, targets=(1,))
        env = gym.make(ID, task=task)
        env.reset(seed=0)
        env.step(1)
        assert survive(env, [1, 0, 0, 0, 0, 1, 1])[0] == 6

    def test_episodes_differ(self) -> None:
        env = gym.make(ID, rate=0.3)
        first = env.reset(seed=0)[0].tolist()
        assert any(env.reset()[0].tolist() != first for _ in range(5))

    def test_later_episodes_are_as_long_as_first_ones(self) -> None:
        """Silence after random resets still scores 148; six standard errors."""
        env = gym.make(ID, n_inputs=1)
        env.reset(seed=1)
        scores = []
        for k in range(1_500):
            for _ in range(k % 7):
                env.reset()
            scores.append(survive(env, itertools.repeat(0))[0])
        assert abs(np.mean(scores) - 148) < 6 * 99.5 / np.sqrt(len(scores))


@pytest.mark.parametrize("kwarg", [{"feedback": "cost"}, {"output": "graded"}])
def test_arguments_of_the_other_environment_are_refused(kwarg: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="unknown keyword"):
        gym.make(ID, **kwarg)
