"""Trials made from a user's own data, and what every trial promises."""

from __future__ import annotations

import pickle
from typing import Any, ClassVar

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
        with pytest.raises(ValueError, match="cannot set WRITEABLE"):
            array.setflags(write=True)


def test_attributes_of_a_trial_cannot_be_replaced() -> None:
    trial = Trial.from_dense(RASTER, [2], [1], TASK)
    for name in ("channels", "onsets", "label", "n_inputs", "anything"):
        with pytest.raises(AttributeError):
            setattr(trial, name, 1)


def test_a_drawn_trial_is_what_its_constructor_would_accept() -> None:
    task = Task(n_inputs=7, pattern_bins=3, rate=0.2, n_classes=3, background_bins=5)
    patterns, rng = Patterns.draw(task, 0), np.random.default_rng(1)
    for _ in range(50):
        trial = draw_trial(task, patterns, rng)
        copy = pickle.loads(pickle.dumps(trial))  # goes through the constructor
        for one, same in zip(trial.arrays, copy.arrays, strict=True):
            assert one.dtype == same.dtype and np.array_equal(one, same)
        assert copy.classes.tolist() == trial.classes.tolist()
        assert (copy.pattern_bins, copy.n_inputs) == (3, 7)


def test_segments_say_what_presentations_say() -> None:
    trial = Trial.from_dense(RASTER, [1, 6], [1, 0], TASK)
    assert trial.edges.tolist() == [0, 1, 4, 6, 9, 12]
    assert trial.target.tolist() == [0, 5, 0, 1, 0]
    assert trial.ends.tolist() == [4, 9]
    assert not trial.label_only


def test_the_repr_is_one_line() -> None:
    for trial in (
        Trial.from_dense(RASTER, [1, 6], [1, 0], TASK),
        Trial.from_dense(RASTER, label=3),
        Trial.from_dense(
            np.zeros((200, 4)),
            range(100),
            np.arange(100) % 2,
            None,
            lengths=1,
            targets=np.ones(100, int),
        ),
    ):
        assert "\n" not in repr(trial) and len(repr(trial)) < 200
        assert f"label {trial.label}" in repr(trial)


class TestConstructor:
    """Every array that compiled code relies on is checked, and copied."""

    GOOD: ClassVar[dict[str, Any]] = dict(
        channels=[0, 2, 1, 0, 3],
        offsets=[0, 2, 3, 3, 5],
        onsets=[0, 3],
        classes=[0, 1],
        targets=[1, 2],
        n_inputs=4,
        ends=[2, 4],
    )

    def test_takes_what_fits(self) -> None:
        trial = Trial(**self.GOOD)
        assert trial.dense().astype(int).tolist() == [
            [1, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 0], [1, 0, 0, 1],
        ]  # fmt: skip
        assert (trial.label, trial.pattern_bins) == (3, None)
        assert trial.owner().tolist() == [0, 0, -1, 1]

    def test_converts_foreign_types_and_layouts(self) -> None:
        strided = np.array([[0, 9], [2, 9], [1, 9], [0, 9], [3, 9]], np.uint8)[:, 0]
        trial = Trial(**{**self.GOOD, "channels": strided})
        assert trial.channels.dtype == np.int32 and trial.channels.flags.c_contiguous
        swapped = Trial(**{**self.GOOD, "offsets": np.array([0, 2, 3, 3, 5], ">i2")})
        assert swapped.offsets.dtype == np.dtype(np.int64)

    def test_does_not_hold_on_to_what_it_is_given(self) -> None:
        channels = np.array([0, 2, 1, 0, 3], np.int32)
        trial = Trial(**{**self.GOOD, "channels": channels})
        channels[:] = 10**9
        assert trial.channels.tolist() == [0, 2, 1, 0, 3]

    @pytest.mark.parametrize(
        ("field", "value", "why"),
        [
            ("channels", [0, 2, 1, 0, 4], "channels must lie in 0 … 3, got 4 at place 4"),
            ("channels", [0, 2, -1, 0, 3], "got -1 at place 2"),
            ("channels", [2, 0, 1, 0, 3], "ascend within a bin, got [2, 0] in bin 0"),
            ("channels", [0, 2, 1, 3, 3], "ascend within a bin, got [3, 3] in bin 3"),
            ("channels", [0, 2, 1, 0], "offsets must lie in 0 … 4, got 5"),
            ("channels", [0.0, 2, 1, 0, 3], "whole numbers, got float64"),
            ("channels", [[0, 2, 1, 0, 3]], "got shape (1, 5)"),
            ("channels", [[0], [1, 2]], "row of whole numbers"),
            ("channels", None, "got shape ()"),
            ("offsets", [0, 2, 3, 3, 4], "from 0 to the number of channels, 5"),
            ("offsets", [1, 2, 3, 3, 5], "from 0 to the number of channels, 5"),
            ("offsets", [0, 3, 2, 3, 5], "offsets must never fall, got 3, 2"),
            ("offsets", [0], "one entry more than there are bins"),
            ("offsets", [], "one entry more than there are bins"),
            ("offsets", [0, 2, 3, 3, 2**62], "offsets must lie in 0 … 5"),
            ("onsets", [3, 0], "number 0 has onset 3 and end 2"),
            ("onsets", [0, 1], "must not overlap"),
            ("onsets", [0], "one entry per presentation each, got 1 and 2"),
            ("onsets", [0, 4], "onsets must lie in 0 … 3"),
            ("ends", [0, 4], "ends must lie in 1 …"),
            ("ends", [2, 5], "number 1 has onset 3 and end 5"),
            ("ends", [2], "onsets and ends must have one entry"),
            ("ends", None, "give ends or lengths"),
            ("classes", [0], "onsets and classes must have one entry"),
            ("classes", [0, -1], "classes must lie in"),
            ("targets", [1], "onsets and targets must have one entry"),
            ("targets", [1, -1], "targets must lie in"),
            ("targets", [1, 2**62], "targets must lie in"),
            ("targets", [1, 2**70], "whole numbers, got object"),
            ("n_inputs", 0, "n_inputs must be >= 1, got 0"),
            ("n_inputs", 2**40, "n_inputs must be at most 100,000,000, got"),
            ("n_inputs", 4.0, "n_inputs must be a whole number"),
            ("pattern_bins", 3, "got 3 and lengths [2, 1]"),
            ("label", 4, "label must be the sum of the targets, 3, got 4"),
            ("label", -1, "label must be >= 0, got -1"),
            ("label", 2**62, "label must be at most 1,000,000,000,000,000"),
            ("label", 1.5, "label must be a whole number"),
        ],
    )  # fmt: skip
    def test_refuses_what_does_not_fit(self, field: str, value: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trial(**{**self.GOOD, field: value})
        assert why in str(refusal.value) and "\n" not in str(refusal.value)

    def test_refuses_a_label_that_does_not_fit_the_trial_it_is_unpickled_with(self) -> None:
        rebuild, arguments = Trial(**self.GOOD).__reduce__()
        with pytest.raises(ValueError, match="channels must lie in"):
            rebuild(np.array([0, 2, 1, 0, 99]), *arguments[1:])


class TestOnlyTheLabel:
    def test_may_be_known(self) -> None:
        trial = Trial.from_times([[0.0011, 0.0042], [0.003]], n_bins=5, bin_width=0.001, label=3)
        assert trial.label_only and trial.label == 3
        assert trial.n_inputs == 2 and trial.n_bins == 5
        assert len(trial.onsets) == len(trial.targets) == 0
        assert trial.edges.tolist() == [0, 5] and trial.target.tolist() == [3]
        assert trial.owner().tolist() == [-1] * 5

    def test_survives_pickling(self) -> None:
        copy = pickle.loads(pickle.dumps(Trial.from_dense(RASTER, label=7)))
        assert copy.label_only and copy.label == 7

    def test_is_not_the_same_as_a_trial_of_noise(self) -> None:
        assert not Trial.from_dense(RASTER, [], [], TASK).label_only
        assert Trial.from_dense(RASTER, label=0).label_only

    @pytest.mark.parametrize(
        ("keywords", "why"),
        [
            ({}, "say what the trial owes"),
            ({"classes": [1]}, "say what the trial owes"),
            ({"label": 1, "classes": [1]}, "say what the trial owes"),
            ({"label": "3"}, "label must be a whole number"),
            ({"label": 10**18}, "label must be at most"),
            ({"onsets": [1]}, "got neither"),
            ({"onsets": [1], "targets": [1], "task": TASK, "classes": [0]}, "got both"),
            ({"onsets": [1], "task": TASK}, "give classes"),
            ({"onsets": [1], "targets": [1]}, "say how long the presentations are"),
            ({"onsets": [1], "targets": [1], "ends": [2], "lengths": 1}, "got both"),
            ({"onsets": [1], "targets": [1], "lengths": 0}, "lengths must be >= 1, got 0"),
            ({"onsets": [1], "targets": [1], "lengths": [1, 2]}, "onsets and lengths must have"),
            ({"onsets": [1], "targets": [1], "lengths": [[1], [1, 2]]}, "lengths must be a row"),
            ({"onsets": [1], "targets": [1], "lengths": 2.5}, "lengths must be a whole number"),
            ({"onsets": [1], "classes": [0], "task": 3}, "task must be a gnm_env.Task, got 3"),
        ],
    )
    def test_or_else_all_must_be_said(self, keywords: Any, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            Trial.from_dense(RASTER, **keywords)


class TestPresentationsOfUnequalLength:
    def test_by_their_ends(self) -> None:
        trial = Trial.from_dense(RASTER, [7, 1], targets=[2, 1], ends=[9, 6])
        assert trial.edges.tolist() == [0, 1, 6, 7, 9, 12]
        assert trial.targets.tolist() == [1, 2] and trial.classes.tolist() == [0, 0]
        assert trial.pattern_bins is None and trial.label == 3

    def test_by_their_lengths(self) -> None:
        trial = Trial.from_dense(RASTER, [7, 1], [0, 1], TASK, lengths=[2, 5])
        assert trial.ends.tolist() == [6, 9] and trial.targets.tolist() == [5, 1]

    def test_of_one_length_are_of_that_length(self) -> None:
        assert Trial.from_dense(RASTER, [7, 1], targets=[2, 1], lengths=2).pattern_bins == 2
        assert Trial.from_dense(RASTER, [7, 1], targets=[2, 1], ends=[9, 3]).pattern_bins == 2
        assert Trial.from_dense(RASTER, [], targets=[], lengths=2).pattern_bins == 2


def test_a_raster_that_would_fill_the_memory_is_refused() -> None:
    trial = Trial([], np.zeros(10**6, int), [], [], [], n_inputs=10**8)
    with pytest.raises(ValueError, match=r"a raster of 999,999 bins .* needs .* GiB"):
        trial.dense()


@pytest.mark.parametrize("rng", [None, 0, np.random.RandomState(0)])
def test_a_trial_is_drawn_from_a_generator(rng: Any) -> None:
    with pytest.raises(ValueError, match=r"rng must be a numpy.random.Generator"):
        draw_trial(TASK, Patterns.draw(TASK, 0), rng)


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
            (RASTER * 1j, [], [], "binary"),
            (RASTER, [1, 5], [0], "one entry per presentation each, got 2 and 1"),
            (RASTER, [-1], [0], "onsets must lie in 0 …"),
            (RASTER, [10], [0], "within the trial's 12 bins, number 0 has onset 10 and end 13"),
            (RASTER, [1, 3], [0, 0], "must not overlap"),
            (RASTER, [4, 4], [0, 1], "must not overlap"),
            (RASTER, [1], [2], "classes must lie in 0 … 1, got 2"),
            (RASTER, [1], [-1], "classes must lie in 0 … 1"),
            (RASTER, [1.0], [0], "onsets must be whole numbers"),
            (RASTER, [1], ["a"], "classes must be whole numbers"),
            (RASTER[:2], [0], [0], "within the trial's 2 bins, number 0 has onset 0 and end 3"),
        ],
    )
    def test_says_what_is_wrong(self, raster: Any, onsets: Any, classes: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trial.from_dense(raster, onsets, classes, TASK)
        assert why in str(refusal.value)


class TestFromTimes:
    def test_puts_spikes_into_their_bins(self) -> None:
        times = [[3.7, 0.0], [], [11.999], np.array([5])]
        trial = Trial.from_times(times, 12, [2], [0], TASK)
        expected = np.zeros((12, 4), np.bool_)
        expected[[0, 3, 11, 5], [0, 0, 2, 3]] = True
        assert np.array_equal(trial.dense(), expected)
        assert trial.label == 1

    @pytest.mark.parametrize("width", [0.001, 0.1, 1 / 3, 7.0])
    def test_a_spike_at_the_beginning_of_a_bin_is_in_that_bin(self, width: float) -> None:
        """0.3 / 0.1 is less than 3 in floating point."""
        times = [[k * width for k in range(200)]]
        assert Trial.from_times(times, 200, bin_width=width, label=0).dense().all()

    def test_the_last_moment_is_in_the_last_bin(self) -> None:
        for width in (1.0, 0.1):
            last = np.nextafter(3 * width, 0)
            trial = Trial.from_times([[last]], 3, bin_width=width, label=0)
            assert trial.dense().ravel().tolist() == [False, False, True]

    def test_says_once_how_many_spikes_were_merged(self) -> None:
        with pytest.warns(UserWarning, match="^3 spikes fall into a bin") as said:
            trial = Trial.from_times([[0.1, 0.2, 0.3], [4.0, 4.5]], 5, label=0)
        assert len(said) == 1 and said[0].filename == __file__
        assert len(trial.channels) == 2

    def test_seconds_taken_for_bins_are_warned_of(self) -> None:
        with pytest.warns(UserWarning, match="bin_width") as said:
            Trial.from_times([[0.1], [0.9]], 5, label=0)
        assert len(said) == 1 and said[0].filename == __file__

    def test_single_spikes_or_a_bin_width_are_not_warned_of(self) -> None:
        Trial.from_times([[0.1], []], 5, label=0)
        Trial.from_times([[0.1], [0.9]], 5, bin_width=0.5, label=0)
        Trial.from_times([[0.1], [1.1]], 5, label=0)

    def test_channels_ascend_within_a_bin(self) -> None:
        trial = Trial.from_times([[1.5], [1.1], [1.9], [1.0]], 3, [], [], TASK)
        assert trial.channels.tolist() == [0, 1, 2, 3]

    @pytest.mark.parametrize(
        ("times", "n_bins", "why"),
        [
            ([[0.0]] * 3, 12, "one array per channel, n_inputs = 4, got 3"),
            ([[12.0], [], [], []], 12, "channel 0 has 12"),
            ([[], [-0.1], [], []], 12, "channel 1 has -0.1"),
            ([[], [np.nan], [], []], 12, "channel 1 has nan"),
            ([[]] * 4, 0, "n_bins must be >= 1, got 0"),
            ([[]] * 4, 2**62, "n_bins must be at most 1,000,000,000"),
            ([], 12, "n_inputs = 4, got 0"),
            (3, 12, "times must hold one array per channel, got 3"),
            ([1.0, 2.0, 3.0, 4.0], 12, "channel 0 has the single number 1.0"),
            ([[], [], ["a"], []], 12, "channel 2 has ['a']"),
            ([[], [], [[1.0]], []], 12, "channel 2 has shape (1, 1)"),
            ([[np.inf], [], [], []], 12, "channel 0 has inf"),
        ],
    )
    def test_says_what_is_wrong(self, times: Any, n_bins: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trial.from_times(times, n_bins, [], [], TASK)
        assert why in str(refusal.value)

    @pytest.mark.parametrize("width", [0, -1.0, np.nan, np.inf, "1", None])
    def test_a_bin_has_a_width(self, width: Any) -> None:
        with pytest.raises(ValueError, match="bin_width must be"):
            Trial.from_times([[1.0]], 3, bin_width=width, label=0)
