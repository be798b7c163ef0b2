"""Trials made from a user's own data, and what every trial promises."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from gnm_env import Patterns, Task, Trial, draw_trial

TASK = Task(n_inputs=4, pattern_bins=3, n_classes=2, targets=(1, 5))
RASTER = np.random.default_rng(0).random((12, 4)) < 0.4


def test_a_drawn_trial_describes_its_own_raster() -> None:
    task = Task(n_classes=2, rate=0.05)
    patterns = Patterns.draw(task, 0)
    trial = draw_trial(task, patterns, np.random.default_rng(1))
    raster = trial.dense()
    assert raster.shape == (trial.n_bins, 100) and raster.dtype == np.bool_
    assert raster.sum() == len(trial.channels) == trial.offsets[-1]
    for onset, class_ in zip(trial.onsets, trial.classes, strict=True):
        assert np.array_equal(raster[onset : onset + 50], patterns.dense()[class_])


def test_the_next_trial_differs_and_an_equal_seed_does_not() -> None:
    patterns = Patterns.draw(TASK, 0)
    rng = np.random.default_rng(1)
    first, second = (draw_trial(TASK, patterns, rng) for _ in range(2))
    again = draw_trial(TASK, patterns, np.random.default_rng(1))
    assert first.dense().tolist() == again.dense().tolist()
    assert first.dense().tolist() != second.dense().tolist()


def test_arrays_of_a_trial_cannot_be_changed() -> None:
    trial = draw_trial(TASK, Patterns.draw(TASK, 0), np.random.default_rng(1))
    for array in (trial.channels, trial.offsets, trial.onsets, trial.classes, trial.targets):
        assert not array.flags.writeable


def test_a_trial_survives_pickling() -> None:
    trial = Trial.from_dense(RASTER, [2], [1], TASK)
    copy = pickle.loads(pickle.dumps(trial))
    assert np.array_equal(copy.dense(), RASTER)
    assert (copy.onsets.tolist(), copy.label) == ([2], 5)
    assert not copy.channels.flags.writeable


class TestFromDense:
    def test_keeps_raster_and_occurrences(self) -> None:
        trial = Trial.from_dense(RASTER, [2, 5], [1, 0], TASK)
        assert np.array_equal(trial.dense(), RASTER)
        assert trial.n_bins == 12
        assert trial.onsets.tolist() == [2, 5]
        assert trial.classes.tolist() == [1, 0]
        assert trial.targets.tolist() == [5, 1]
        assert trial.label == 6
        assert trial.owner().tolist() == [-1, -1, 0, 0, 0, 1, 1, 1, -1, -1, -1, -1]

    def test_sorts_occurrences_by_onset(self) -> None:
        trial = Trial.from_dense(RASTER, [8, 2], [0, 1], TASK)
        assert trial.onsets.tolist() == [2, 8]
        assert trial.classes.tolist() == [1, 0]

    def test_takes_a_trial_of_noise_alone(self) -> None:
        trial = Trial.from_dense(RASTER, [], [], TASK)
        assert trial.label == 0 and len(trial.onsets) == 0

    def test_leaves_the_given_arrays_alone(self) -> None:
        onsets = np.array([2])
        trial = Trial.from_dense(RASTER, onsets, [0], TASK)
        onsets[0] = 7
        assert trial.onsets.tolist() == [2]
        assert onsets.flags.writeable

    @pytest.mark.parametrize(
        ("raster", "onsets", "classes", "why"),
        [
            (RASTER[:, :3], [], [], "n_inputs = 4"),
            (RASTER[0], [], [], "n_inputs = 4"),
            (RASTER[:0], [], [], "bins >= 1"),
            (RASTER * 2, [], [], "binary"),
            (RASTER * 0.5, [], [], "binary"),
            (RASTER, [1, 5], [0], "one entry per occurrence each, got 2 and 1"),
            (RASTER, [-1], [0], "onsets in 0 … 9, got [-1]"),
            (RASTER, [10], [0], "onsets in 0 … 9, got [10]"),
            (RASTER, [1, 3], [0, 0], "must not overlap"),
            (RASTER, [4, 4], [0, 1], "must not overlap"),
            (RASTER, [1], [2], "classes must lie in 0 … 1"),
            (RASTER, [1], [-1], "classes must lie in 0 … 1"),
            (RASTER, [1.0], [0], "onsets must be whole numbers"),
            (RASTER, [1], ["a"], "classes must be whole numbers"),
            (RASTER[:2], [0], [0], "onsets in 0 … -1"),
        ],
    )
    def test_says_what_is_wrong(self, raster: Any, onsets: Any, classes: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trial.from_dense(raster, onsets, classes, TASK)
        assert why in str(refusal.value)


class TestFromTimes:
    def test_puts_spikes_into_their_bins(self) -> None:
        times = [[0.0, 3.7], [], [11.999, 11.2], np.array([5])]
        trial = Trial.from_times(times, 12, [2], [0], TASK)
        expected = np.zeros((12, 4), np.bool_)
        expected[[0, 3, 11, 5], [0, 0, 2, 3]] = True
        assert np.array_equal(trial.dense(), expected)
        assert trial.label == 1

    def test_channels_ascend_within_a_bin(self) -> None:
        trial = Trial.from_times([[1.5], [1.1], [1.9], [1.0]], 3, [], [], TASK)
        assert trial.channels.tolist() == [0, 1, 2, 3]

    @pytest.mark.parametrize(
        ("times", "n_bins", "why"),
        [
            ([[0.0]] * 3, 12, "one array per channel, n_inputs = 4, got 3"),
            ([[12.0], [], [], []], 12, "channel 0 has others"),
            ([[], [-0.1], [], []], 12, "channel 1 has others"),
            ([[], [np.nan], [], []], 12, "channel 1 has others"),
            ([[]] * 4, 0, "n_bins must be >= 1"),
        ],
    )
    def test_says_what_is_wrong(self, times: Any, n_bins: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trial.from_times(times, n_bins, [], [], TASK)
        assert why in str(refusal.value)
