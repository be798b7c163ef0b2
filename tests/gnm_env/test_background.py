"""A background like a recording's: its rates, and in the other mode its own spikes."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from gnm_env import Patterns, Task, Trial, Trials, draw_trial
from gnm_env.background import hide, task_like

N = 6
RATES = np.array([0.0, 0.02, 0.1, 0.3, 0.004, 0.5])
RNG = np.random.default_rng(0)
RECORDING = Trials([Trial.from_dense(RNG.random((400, N)) < RATES, label=0) for _ in range(20)])
PATTERNS = Patterns.from_dense(RNG.random((2, 5, N)) < 0.5)


def noise_of(trials: Trials) -> Any:
    return np.concatenate([trial.dense()[trial.owner() < 0] for trial in trials])


def within_chance(found: Any, expected: Any, n: int) -> bool:
    """Whether shares of `n` bits lie within 5 standard deviations of what is expected."""
    return bool(np.all(np.abs(found - expected) <= 5 * np.sqrt(expected * (1 - expected) / n)))


class TestRatesOfTheirOwn:
    TASK = Task(n_inputs=N, pattern_bins=5, n_classes=2, rates=tuple(RATES), background_bins=50)

    def test_are_those_of_drawn_noise(self) -> None:
        trials = Trials.draw(self.TASK, PATTERNS, 2_000, 0)
        noise = noise_of(trials)
        assert len(noise) == 100_000
        assert within_chance(noise.mean(axis=0), RATES, len(noise))

    def test_bits_of_one_channel_and_of_two_are_independent(self) -> None:
        noise = noise_of(Trials.draw(self.TASK, PATTERNS, 2_000, 1))
        assert within_chance((noise[1:, 3] & noise[:-1, 5]).mean(), 0.15, len(noise))
        assert within_chance((noise[1:, 5] & noise[:-1, 5]).mean(), 0.25, len(noise))

    def test_are_those_of_the_endless_stream(self) -> None:
        env = gym.make("gnm/PatternStream-v0", task=self.TASK, patterns=PATTERNS)
        stream = [env.reset(seed=0)[0]]
        for _ in range(100):
            done = False
            while not done:
                bits, _, terminated, truncated, _ = env.step(0)
                stream.append(bits)
                done = terminated or truncated
            stream.append(env.reset()[0])
        # Two classes of five bins in a hundred noise bins each: noise outweighs by far.
        share = np.mean(stream, axis=0)
        assert share[0] < 0.05 and share[4] < 0.05 and abs(share[5] - 0.5) < 0.06

    def test_are_those_of_drawn_patterns(self) -> None:
        task = Task(n_inputs=N, pattern_bins=20_000, rates=tuple(RATES))
        drawn = Patterns.draw(task, 0).dense()[0]
        assert within_chance(drawn.mean(axis=0), RATES, 20_000)

    def test_change_nothing_where_they_are_not_given(self) -> None:
        """The numbers that were drawn before channels could have rates."""
        trial = draw_trial(Task(), Patterns.draw(Task(), 0), np.random.default_rng(1))
        assert len(trial.channels) == 110
        assert trial.channels[:8].tolist() == [23, 83, 83, 94, 0, 53, 61, 8]

    def test_say_their_mean_and_survive_the_way_through_keywords(self) -> None:
        assert self.TASK.rate == pytest.approx(RATES.mean())
        fields = {name: getattr(self.TASK, name) for name in self.TASK.__dataclass_fields__}
        fields["rates"] = list(fields["rates"])  # as JSON has it
        assert Task(**fields) == self.TASK and hash(Task(**fields)) == hash(self.TASK)

    def test_may_all_be_zero(self) -> None:
        task = Task(n_inputs=N, pattern_bins=5, n_classes=2, rates=(0.0,) * N)
        assert not noise_of(Trials.draw(task, PATTERNS, 10, 0)).any()

    @pytest.mark.parametrize(
        ("rates", "why"),
        [
            ((0.1,), "one entry per channel, n_inputs = 6, got 1"),
            ((0.1,) * 5 + (1.1,), r"rates\[5\] must be in 0 … 1"),
            ((0.1,) * 5 + (float("nan"),), r"rates\[5\] must be finite"),
            ("a", "sequence of probabilities, got 'a'"),
            (0.1, "sequence of probabilities, got 0.1"),
        ],
    )
    def test_are_checked(self, rates: Any, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            Task(n_inputs=N, rates=rates)


class TestATaskLikeARecording:
    def test_has_its_channels_and_rates(self) -> None:
        task = task_like(RECORDING, PATTERNS, background_bins=30)
        assert (task.n_inputs, task.n_classes, task.pattern_bins) == (N, 2, 5)
        assert task.rates == tuple(RECORDING.rates) and task.background_bins == 30
        assert task_like(RECORDING, pattern_bins=9).pattern_bins == 9

    @pytest.mark.parametrize(
        ("arguments", "fields", "why"),
        [
            ((None,), {}, "trials must be gnm_env.Trials, got None"),
            ((RECORDING, None), {"rates": (0.1,) * N}, "rates follows from the trials"),
            ((RECORDING, PATTERNS), {"n_classes": 3}, "n_classes follows from"),
            ((RECORDING, PATTERNS), {"colour": 3}, "unknown keyword 'colour'"),
            ((RECORDING, 3), {}, "must be gnm_env.Patterns of 6 channels"),
            ((RECORDING, Patterns.from_dense(np.ones((1, 1, 2)))), {}, "Patterns of 6 channels"),
        ],
    )
    def test_says_what_does_not_fit(self, arguments: Any, fields: Any, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            task_like(*arguments, **fields)


class TestHiding:
    @pytest.mark.parametrize("shuffled", [False, True])
    def test_keeps_the_patterns_and_the_rates(self, shuffled: bool) -> None:
        trials = hide(
            PATTERNS, RECORDING, 1_000, 3, shuffled=shuffled, background_bins=60, targets=(1, 4)
        )
        assert len(trials) == 1_000 and trials.n_classes == 2
        for trial in trials[:50]:
            assert trial.n_bins == 60 + 5 * len(trial.onsets)
            for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
                assert (trial.dense()[onset : onset + 5] == PATTERNS.dense()[class_]).all()
        expected = (trials[:50].labels, [sum((1, 4)[c] for c in t.classes) for t in trials[:50]])
        assert expected[0].tolist() == expected[1]
        assert np.allclose(noise_of(trials).mean(axis=0), RECORDING.rates, atol=0.02)

    def test_a_shuffled_recording_keeps_the_intervals_of_each_channel(self) -> None:
        """A channel that spikes every seventh bin does so wherever it is read."""
        raster = np.zeros((70, 2), np.bool_)
        raster[::7, 0] = raster[3::14, 1] = True
        clock = Trials(
            [Trial.from_dense(raster[:35], label=0), Trial.from_dense(raster[35:], label=0)]
        )
        patterns = Patterns.from_dense(np.zeros((1, 3, 2)))
        phases = set()
        for trial in hide(patterns, clock, 200, 0, shuffled=True, background_bins=200):
            noise = trial.dense()[trial.owner() < 0]
            times = [np.nonzero(noise[:, i])[0] for i in (0, 1)]
            assert set(np.diff(times[0])) == {7} and set(np.diff(times[1])) == {14}
            phases.add((times[1][0] - times[0][0]) % 7)
        assert phases == set(range(7))

    def test_the_shuffled_trials_are_as_compiled_code_needs_them(self) -> None:
        trials = hide(PATTERNS, RECORDING, 50, np.random.default_rng(0), shuffled=True)
        rebuild, state = trials.__reduce__()
        assert rebuild(*state).labels.tolist() == trials.labels.tolist()

    def test_equal_seeds_hide_alike(self) -> None:
        for shuffled in (False, True):
            one, same, other = (
                hide(PATTERNS, RECORDING, 20, seed, shuffled=shuffled) for seed in (1, 1, 2)
            )
            assert one.arrays.bins.tolist() == same.arrays.bins.tolist()
            assert one.arrays.bins.tolist() != other.arrays.bins.tolist()

    @pytest.mark.parametrize(
        ("change", "why"),
        [
            ({"n": 0}, "n must be >= 1"),
            ({"seed": "a"}, "seed must be a whole number"),
            ({"shuffled": 1}, "shuffled must be True or False"),
            ({"targets": (1,)}, "targets must have one entry per class"),
        ],
    )
    def test_says_what_does_not_fit(self, change: Any, why: str) -> None:
        good: dict[str, Any] = dict(patterns=PATTERNS, like=RECORDING, n=5, seed=0, shuffled=True)
        with pytest.raises(ValueError, match=why):
            hide(**{**good, **change})
