"""Draws: the same bits as a plain implementation, and the statistics that they promise.

Every statistical test rejects a correct implementation with the probability FALSE_ALARM, and its
seed is fixed, so that it gives the same verdict each time.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy import stats

from gnm_env import Patterns, Task, draw_trial
from gnm_env.compiled import compiled
from gnm_env.sampling import append_piece, append_trial, new_buffers
from gnm_env.task import dense, task_arrays
from tests.gnm_env import reference

FALSE_ALARM = 1e-6

TASKS = {
    "one class": Task(),
    "four classes": Task(n_classes=4),
    "distractor": Task(n_classes=2, targets=(0, 3)),
    "dense": Task(n_inputs=7, rate=0.4, pattern_bins=5, background_bins=13),
    "single channel": Task(n_inputs=1, rate=0.2, pattern_bins=3, background_bins=1),
    "crowded": Task(n_classes=3, mean_occurrences=25.0, pattern_bins=4, background_bins=30),
    "silent": Task(rate=0.0),
    "saturated": Task(rate=1.0, n_inputs=5, pattern_bins=4, background_bins=6),
    "no occurrences": Task(mean_occurrences=0.0),
    "rates": Task(n_inputs=5, rates=(0.3, 0.0, 0.05, 0.6, 0.01), pattern_bins=4, n_classes=2),
    "jitter": Task(n_classes=2, jitter_bins=3, rate=0.02),
    "deletion": Task(n_classes=2, deletion=0.3, rate=0.02),
    "jitter and deletion": Task(n_inputs=20, rate=0.2, pattern_bins=6, jitter_bins=9, deletion=0.5),
}
each_task = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS.keys())


def assert_distribution(observed: ArrayLike, expected: ArrayLike) -> None:
    """Pearson's χ² over counts; neighbours are pooled until each expects at least ten."""
    pooled: list[list[float]] = [[0.0, 0.0]]
    for o, e in zip(np.asarray(observed, float), np.asarray(expected, float), strict=True):
        if pooled[-1][1] >= 10:
            pooled.append([0.0, 0.0])
        pooled[-1][0] += o
        pooled[-1][1] += e
    if pooled[-1][1] < 10 and len(pooled) > 1:
        last = pooled.pop()
        pooled[-1] = [pooled[-1][0] + last[0], pooled[-1][1] + last[1]]
    o, e = np.array(pooled).T
    assert stats.chisquare(o, e * o.sum() / e.sum()).pvalue > FALSE_ALARM


class TestSameBitsAsNumPy:
    """The methods of a Generator that compiled code relies on."""

    @pytest.mark.parametrize("method", ["random", "standard_exponential"])
    def test_plain_methods(self, method: str) -> None:
        draw = {"random": _randoms, "standard_exponential": _exponentials}[method]
        expected = [
            getattr(rng, method)() for rng in [np.random.default_rng(3)] for _ in range(5000)
        ]
        assert draw(np.random.default_rng(3), 5000).tolist() == expected

    @pytest.mark.parametrize("mean", [0.0, 0.3, 2.0, 9.99, 10.0, 50.0, 1e6])
    def test_poisson(self, mean: float) -> None:
        rng = np.random.default_rng(4)
        expected = [rng.poisson(mean) for _ in range(3000)]
        assert _poissons(np.random.default_rng(4), mean, 3000).tolist() == expected

    @each_task
    def test_trials(self, task: Task) -> None:
        patterns = Patterns.draw(task, seed=1)
        ours, plain = np.random.default_rng(7), np.random.default_rng(7)
        for _ in range(12):
            trial = draw_trial(task, patterns, ours)
            raster, onsets, classes, label = reference.trial(task, patterns.dense(), plain)
            assert np.array_equal(trial.dense(), raster)
            assert trial.onsets.tolist() == onsets
            assert trial.classes.tolist() == classes
            assert trial.label == label
        assert ours.bit_generator.state == plain.bit_generator.state

    @each_task
    @pytest.mark.parametrize("q", [0.0, 0.0003, 0.01, 0.5, 1.0])
    def test_stream(self, task: Task, q: float) -> None:
        task = replace(task, onset_probability=q)
        patterns = Patterns.draw(task, seed=1)
        ours, plain = np.random.default_rng(7), np.random.default_rng(7)
        noise_left = -1.0
        expected = reference.pieces(task, patterns.dense(), plain)
        for _ in range(6):
            channels, offsets, n_noise, class_, noise_left = append_piece(
                ours, task_arrays(task, patterns), noise_left, *new_buffers()[:2], 0
            )
            before, pattern, expected_class = next(expected)
            n_bins = n_noise + (task.pattern_bins if class_ >= 0 else 0)
            raster = dense(channels, offsets[: n_bins + 1], task.n_inputs)
            assert np.array_equal(raster, np.concatenate([before, pattern]))
            assert (n_noise, class_) == (len(before), expected_class)

    def test_trials_laid_end_to_end_are_those_drawn_one_by_one(self) -> None:
        task = Task(n_classes=2)
        patterns = Patterns.draw(task, seed=1)
        numbers = task_arrays(task, patterns)
        buffers: tuple[Any, ...] = new_buffers()
        ours, single = np.random.default_rng(2), np.random.default_rng(2)
        bin_ = occurrence = 0
        for _ in range(20):
            first_bin, first = bin_, occurrence
            *buffers, bin_, occurrence, label = append_trial(ours, numbers, *buffers, bin_, first)
            channels, offsets, onsets, classes = buffers
            trial = draw_trial(task, patterns, single)
            events = slice(offsets[first_bin], offsets[bin_])
            assert channels[events].tolist() == trial.channels.tolist()
            relative = offsets[first_bin : bin_ + 1] - offsets[first_bin]
            assert relative.tolist() == trial.offsets.tolist()
            assert onsets[first:occurrence].tolist() == trial.onsets.tolist()
            assert classes[first:occurrence].tolist() == trial.classes.tolist()
            assert label == trial.label


@compiled
def _randoms(rng: Generator, n: int) -> Any:
    values = np.empty(n)
    for k in range(n):
        values[k] = rng.random()
    return values


@compiled
def _exponentials(rng: Generator, n: int) -> Any:
    values = np.empty(n)
    for k in range(n):
        values[k] = rng.standard_exponential()
    return values


@compiled
def _poissons(rng: Generator, mean: float, n: int) -> Any:
    values = np.empty(n, np.int64)
    for k in range(n):
        values[k] = rng.poisson(mean)
    return values


@functools.cache
def some_noise(rate: float) -> tuple[Task, Any, Any]:
    task = Task(n_inputs=20, rate=rate, background_bins=TestNoise.N_BINS, mean_occurrences=0.0)
    trial = draw_trial(task, Patterns.draw(task, 0), np.random.default_rng(5))
    return task, trial.channels, trial.offsets


@pytest.mark.parametrize("rate", [0.005, 0.3])
class TestNoise:
    N_BINS = 400_000

    def test_every_channel_has_the_rate(self, rate: float) -> None:
        task, channels, _ = some_noise(rate)
        counts = np.bincount(channels, minlength=task.n_inputs)
        spread = self.N_BINS * task.rate * (1 - task.rate)
        chi2 = ((counts - self.N_BINS * task.rate) ** 2 / spread).sum()
        assert stats.chi2.sf(chi2, task.n_inputs) > FALSE_ALARM
        assert stats.chi2.cdf(chi2, task.n_inputs) > FALSE_ALARM

    def test_gaps_within_a_channel_are_geometric(self, rate: float) -> None:
        task, channels, offsets = some_noise(rate)
        bins = np.repeat(np.arange(self.N_BINS), np.diff(offsets))
        gaps = np.concatenate([np.diff(bins[channels == c]) for c in range(task.n_inputs)])
        longest = gaps.max()
        expected = len(gaps) * stats.geom.pmf(np.arange(1, longest + 1), task.rate)
        assert_distribution(np.bincount(gaps, minlength=longest + 1)[1:], expected)

    def test_spikes_per_bin_are_binomial(self, rate: float) -> None:
        task, _, offsets = some_noise(rate)
        counts = np.bincount(np.diff(offsets), minlength=task.n_inputs + 1)
        expected = stats.binom.pmf(np.arange(task.n_inputs + 1), task.n_inputs, task.rate)
        assert_distribution(counts, self.N_BINS * expected)

    def test_channels_ascend_within_a_bin(self, rate: float) -> None:
        _, channels, offsets = some_noise(rate)
        first_of_bin = np.zeros(len(channels), np.bool_)
        first_of_bin[offsets[:-1][np.diff(offsets) > 0]] = True
        assert np.all((np.diff(channels) > 0) | first_of_bin[1:])


@functools.cache
def many_trials() -> list[Any]:
    task = TestTrials.TASK
    patterns, rng = Patterns.draw(task, 0), np.random.default_rng(6)
    return [draw_trial(task, patterns, rng) for _ in range(TestTrials.N_TRIALS)]


class TestTrials:
    N_TRIALS = 8_000
    TASK = Task(n_classes=3, n_inputs=10, background_bins=40, pattern_bins=10, mean_occurrences=1.5)

    def test_the_number_of_occurrences_is_poisson_for_each_class(self) -> None:
        for class_ in range(self.TASK.n_classes):
            counts = np.bincount([np.sum(trial.classes == class_) for trial in many_trials()])
            expected = stats.poisson.pmf(np.arange(len(counts)), self.TASK.mean_occurrences)
            expected[-1] = stats.poisson.sf(len(counts) - 2, self.TASK.mean_occurrences)
            assert_distribution(counts, self.N_TRIALS * expected)

    def test_occurrences_are_inserted_uniformly(self) -> None:
        # The background bin before which an occurrence stands: its onset less earlier occurrences.
        before = np.concatenate(
            [t.onsets - self.TASK.pattern_bins * np.arange(len(t.onsets)) for t in many_trials()]
        )
        counts = np.bincount(before, minlength=self.TASK.background_bins)
        assert len(counts) == self.TASK.background_bins
        assert_distribution(counts, np.full(len(counts), len(before) / len(counts)))

    def test_length_label_and_order_follow_from_the_occurrences(self) -> None:
        task = self.TASK
        for trial in many_trials()[:500]:
            assert trial.n_bins == task.background_bins + task.pattern_bins * len(trial.onsets)
            assert trial.label == sum(task.owed[c] for c in trial.classes)
            assert trial.targets.tolist() == [task.owed[c] for c in trial.classes]
            assert np.all(np.diff(trial.onsets) >= task.pattern_bins)
            assert trial.owner()[-1] == -1  # always ends in noise

    def test_occurrences_at_one_place_lie_in_class_order(self) -> None:
        together = 0
        for trial in many_trials():
            for k in np.flatnonzero(np.diff(trial.onsets) == self.TASK.pattern_bins):
                assert trial.classes[k] <= trial.classes[k + 1]
                together += 1
        assert together > 100


@functools.cache
def many_pieces() -> tuple[Any, Any]:
    """Noise bins and class of each piece of a stream."""
    task = Task(n_classes=3, n_inputs=2, pattern_bins=4, onset_probability=0.02)
    rng, numbers = np.random.default_rng(8), task_arrays(task, Patterns.draw(task, 0))
    noise, classes, left = [], [], -1.0
    for _ in range(6_000):
        *_, n_noise, class_, left = append_piece(rng, numbers, left, *new_buffers()[:2], 0)
        noise.append(n_noise)
        classes.append(class_)
    return np.array(noise), np.array(classes)


class TestStream:
    def test_noise_between_patterns_is_geometric(self) -> None:
        runs, _ = many_pieces()
        counts = np.bincount(runs)
        expected = len(runs) * stats.geom.pmf(np.arange(len(counts)) + 1, 0.02)
        assert_distribution(counts, expected)

    def test_classes_are_uniform_and_independent(self) -> None:
        _, classes = many_pieces()
        assert_distribution(np.bincount(classes), np.full(3, len(classes) / 3))
        pairs = np.bincount(3 * classes[:-1] + classes[1:])
        assert_distribution(pairs, np.full(9, (len(classes) - 1) / 9))


class TestPatternNoise:
    """One spike per occurrence, in the middle or at an end of a pattern."""

    @staticmethod
    def _bins_of_the_spike(at: int, **noise: Any) -> tuple[Any, int]:
        bits = np.zeros((1, 21, 3), np.bool_)
        bits[0, at, 1] = True
        task = Task(
            n_inputs=3, pattern_bins=21, rate=0.0, background_bins=1, mean_occurrences=4.0, **noise
        )
        patterns, rng = Patterns.from_dense(bits), np.random.default_rng(9)
        places, n_occurrences = [], 0
        for _ in range(5_000):
            trial = draw_trial(task, patterns, rng)
            bins, channels = np.nonzero(trial.dense())
            assert np.all(channels == 1)
            places += [t - trial.onsets[trial.owner()[t]] for t in bins]
            n_occurrences += len(trial.onsets)
        return np.array(places), n_occurrences

    def test_jitter_is_uniform(self) -> None:
        places, n_occurrences = self._bins_of_the_spike(10, jitter_bins=4)
        assert len(places) == n_occurrences
        assert places.min() == 6 and places.max() == 14
        assert_distribution(np.bincount(places)[6:], np.full(9, len(places) / 9))

    def test_jitter_stays_inside_the_pattern(self) -> None:
        places, _ = self._bins_of_the_spike(1, jitter_bins=4)
        expected = np.array([4, 1, 1, 1, 1, 1]) / 9  # −4 … −1 all end up in the first bin
        assert_distribution(np.bincount(places), len(places) * expected)

    def test_deletion_drops_its_share_and_moves_nothing(self) -> None:
        places, n_occurrences = self._bins_of_the_spike(10, deletion=0.25)
        assert np.all(places == 10)
        assert stats.binomtest(len(places), n_occurrences, 0.75).pvalue > FALSE_ALARM

    def test_deletion_of_everything_leaves_silence(self) -> None:
        places, n_occurrences = self._bins_of_the_spike(10, deletion=1.0)
        assert n_occurrences > 0 and len(places) == 0


@pytest.mark.parametrize("short", [(0,), (1,), (2,), (3,), (0, 1, 2, 3)])
@pytest.mark.parametrize("noise", [{}, {"jitter_bins": 3, "deletion": 0.2}], ids=["plain", "noisy"])
def test_buffers_that_are_too_short_change_nothing(
    noise: dict[str, Any], short: tuple[int, ...]
) -> None:
    """Nor does what stands before the trial: one here, as long as the buffers may be."""
    task = Task(n_classes=2, mean_occurrences=8.0, **noise)
    patterns = Patterns.draw(task, 0)
    for seed in range(10):
        rng, single = np.random.default_rng(seed), np.random.default_rng(seed)
        before, trial = (draw_trial(task, patterns, single) for _ in range(2))
        buffers = [
            before.channels.copy(), before.offsets.copy(), before.onsets.copy(),
            before.classes.copy(),
        ]  # fmt: skip
        for k in {0, 1, 2, 3} - set(short):
            buffers[k] = np.concatenate([buffers[k], np.zeros(10_000, buffers[k].dtype)])
        draw_trial(task, patterns, rng)
        first_bin, first = before.n_bins, len(before.onsets)
        *buffers, end_bin, end, label = append_trial(
            rng, task_arrays(task, patterns), *buffers, first_bin, first
        )
        channels, offsets, onsets, classes = buffers
        relative = offsets[first_bin : end_bin + 1] - offsets[first_bin]
        assert relative.tolist() == trial.offsets.tolist()
        n_before, n_events = offsets[first_bin], offsets[end_bin]
        assert channels[:n_before].tolist() == before.channels.tolist()
        assert channels[n_before:n_events].tolist() == trial.channels.tolist()
        assert onsets[first:end].tolist() == trial.onsets.tolist()
        assert classes[first:end].tolist() == trial.classes.tolist()
        assert label == trial.label
        assert rng.bit_generator.state == single.bit_generator.state
