"""Task and Patterns: what they accept, what they refuse, what they promise."""

from __future__ import annotations

import copy
import itertools
import pickle
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from gnm_env import Patterns, Task
from gnm_env.task import MAX_MEAN_BINS, task_arrays


class TestTask:
    def test_defaults_are_the_protocol(self) -> None:
        task = Task()
        assert (task.n_inputs, task.pattern_bins, task.rate, task.n_classes) == (100, 50, 0.005, 1)
        assert (task.background_bins, task.mean_occurrences) == (100, 2.0)
        assert task.onset_probability == 0.01
        assert (task.jitter_bins, task.deletion) == (0, 0.0)

    @pytest.mark.parametrize("n_classes", [1, 2, 4])
    def test_targets_count_up_unless_given(self, n_classes: int) -> None:
        assert Task(n_classes=n_classes).targets == tuple(range(1, n_classes + 1))

    def test_targets_may_come_in_any_sequence_of_whole_numbers(self) -> None:
        for targets in ([0, 3], (0, 3), np.array([0, 3])):
            task = Task(n_classes=2, targets=targets)  # type: ignore[arg-type]
            assert task.targets == (0, 3)
            assert all(type(target) is int for target in task.owed)

    def test_numpy_numbers_become_plain_ones(self) -> None:
        task = Task(n_inputs=np.int32(7), rate=np.float32(0.25))  # type: ignore[arg-type]
        assert type(task.n_inputs) is int and type(task.rate) is float

    def test_equal_tasks_are_equal_and_hash_alike(self) -> None:
        assert Task(n_classes=2) == Task(n_classes=2, targets=(1, 2))
        assert hash(Task(n_classes=2)) == hash(Task(n_classes=2, targets=(1, 2)))

    def test_a_task_cannot_be_changed(self) -> None:
        with pytest.raises(FrozenInstanceError):
            Task().rate = 0.5  # type: ignore[misc]

    def test_survives_pickling_and_is_checked_on_the_way(self) -> None:
        task = Task(n_classes=2, targets=(0, 3), jitter_bins=2)
        assert pickle.loads(pickle.dumps(task)) == task == copy.deepcopy(task)
        rebuild, fields = task.__reduce__()
        with pytest.raises(ValueError, match="n_inputs must be >= 1"):
            rebuild(0, *fields[1:])

    def test_silence_scores_what_the_arithmetic_says(self) -> None:
        assert Task().silent_score == pytest.approx(148.0)
        assert Task(onset_probability=1.0, pattern_bins=7).silent_score == 6.0
        assert Task(onset_probability=0.0).silent_score == float("inf")

    @pytest.mark.parametrize(
        ("field", "value", "why"),
        [
            ("n_inputs", 0, ">= 1, got 0"),
            ("n_inputs", 10.0, "whole number, got 10.0"),
            ("n_inputs", True, "whole number, got True"),
            ("n_inputs", "100", "whole number, got '100'"),
            ("pattern_bins", 0, ">= 1, got 0"),
            ("pattern_bins", -5, ">= 1, got -5"),
            ("n_classes", 0, ">= 1, got 0"),
            ("background_bins", 0, ">= 1, got 0"),
            ("rate", -0.1, "0 … 1, got -0.1"),
            ("rate", 1.1, "0 … 1, got 1.1"),
            ("rate", float("nan"), "finite, got nan"),
            ("rate", None, "a number, got None"),
            ("mean_occurrences", -1.0, ">= 0, got -1.0"),
            ("mean_occurrences", float("inf"), "finite, got inf"),
            ("onset_probability", -1e-9, "0 … 1"),
            ("onset_probability", 2, "0 … 1, got 2.0"),
            ("deletion", 1.5, "0 … 1, got 1.5"),
            ("jitter_bins", -1, ">= 0, got -1"),
            ("jitter_bins", 0.5, "whole number, got 0.5"),
            ("targets", (1, 2), "one entry per class"),
            ("targets", (), "one entry per class"),
            ("targets", (-1,), ">= 0, got -1"),
            ("targets", (1.5,), "whole number, got 1.5"),
            ("targets", 1, "sequence of whole numbers, got 1"),
            ("targets", "1", "sequence of whole numbers, got '1'"),
            ("targets", (2**62,), "at most 1,000,000,000, got 4611686018427387904"),
            ("targets", itertools.count(), "one entry per class"),
            ("n_inputs", 2**40, "at most 100,000,000"),
            pytest.param("n_inputs", 10**5000, "at most 100,000,000, got a value", id="digits"),
            ("n_classes", 10**9, "at most 1,000,000"),
            ("pattern_bins", 2**62, "at most 100,000,000"),
            ("background_bins", 2**62, "at most 100,000,000"),
            ("jitter_bins", 2**62, "at most 100,000,000"),
            pytest.param("mean_occurrences", 10**400, "finite", id="beyond a float"),
        ],
    )
    def test_a_field_out_of_range_is_named(self, field: str, value: Any, why: str) -> None:
        with pytest.raises(ValueError, match=field) as refusal:
            Task(**{field: value})
        assert why in str(refusal.value)

    def test_a_trial_that_would_fill_the_memory_is_refused(self) -> None:
        Task(background_bins=MAX_MEAN_BINS // 2)
        for fields in ({"background_bins": MAX_MEAN_BINS}, {"mean_occurrences": 1e12}):
            with pytest.raises(ValueError, match="at most 100,000,000 bins on average"):
                Task(**fields)  # type: ignore[arg-type]


class TestPatterns:
    def test_are_drawn_as_the_protocol_pins_them(self) -> None:
        task = Task(n_classes=3)
        expected = np.random.default_rng((5, 1)).random((3, 50, 100)) < 0.005
        assert np.array_equal(Patterns.draw(task, seed=5).dense(), expected)

    def test_survive_the_way_through_sparse_form(self) -> None:
        bits = np.random.default_rng(0).random((2, 7, 11)) < 0.3
        for array in (bits, bits.astype(int), bits.astype(float), bits.tolist()):
            assert np.array_equal(Patterns.from_dense(array).dense(), bits)
        assert Patterns.from_dense(bits).dense().dtype == np.bool_

    def test_equal_patterns_are_equal_and_hash_alike(self) -> None:
        task = Task()
        one, same, other = (Patterns.draw(task, seed) for seed in (1, 1, 2))
        assert one == same and hash(one) == hash(same)
        assert one != other
        assert one != "patterns"

    def test_cannot_be_changed(self) -> None:
        patterns = Patterns.draw(Task(), 0)
        with pytest.raises(ValueError, match="read-only"):
            patterns.channels[0] = 3
        before = patterns.dense()
        patterns.dense()[:] = True  # a copy
        assert np.array_equal(patterns.dense(), before)

    def test_survive_pickling(self) -> None:
        patterns = Patterns.draw(Task(n_classes=2), 0)
        again = pickle.loads(pickle.dumps(patterns))
        assert again == patterns
        assert not again.channels.flags.writeable

    def test_do_not_hold_on_to_what_they_are_given(self) -> None:
        channels = np.array([0, 2], np.int64)
        patterns = Patterns(channels, [0, 1, 2], (1, 2, 3))  # type: ignore[arg-type]
        channels[:] = 10**9
        assert patterns.channels.tolist() == [0, 2] and patterns.channels.dtype == np.int32
        assert channels.flags.writeable

    @pytest.mark.parametrize(
        ("channels", "offsets", "shape", "why"),
        [
            ([0, 3], [0, 1, 2], (1, 2, 3), "channels must lie in 0 … 2, got 3"),
            ([0, -1], [0, 1, 2], (1, 2, 3), "channels must lie in 0 … 2, got -1"),
            ([2, 0], [0, 2, 2], (1, 2, 3), "ascend within a bin, got [2, 0] in bin 0"),
            ([0, 1.5], [0, 1, 2], (1, 2, 3), "channels must be whole numbers"),
            ([0, 1], [0, 1, 3], (1, 2, 3), "offsets must lie in 0 … 2"),
            ([0, 1], [0, 1, 1], (1, 2, 3), "offsets must have one entry more"),
            ([0, 1], [0, 2], (1, 2, 3), "classes · bins = 2 bins and one more, got 2"),
            ([0, 1], [0, 2, 1, 2], (1, 3, 3), "offsets must never fall"),
            ([0, 1], [0, 1, 2], (1, 2), "shape must be (classes, bins, channels)"),
            ([0, 1], [0, 1, 2], None, "shape must be (classes, bins, channels)"),
            ([0, 1], [0, 1, 2], (1, 2, 2**40), "channels must be at most"),
            ([0, 1], [0, 1, 2], (2**40, 2, 2), "classes must be at most"),
            ([0, 1], [0, 1, 2], (1.0, 2, 2), "classes must be a whole number"),
            ("ab", [0, 1, 2], (1, 2, 3), "row of whole numbers"),
        ],
    )
    def test_whose_arrays_do_not_fit_are_refused(
        self, channels: Any, offsets: Any, shape: Any, why: str
    ) -> None:
        with pytest.raises(ValueError) as refusal:
            Patterns(channels, offsets, shape)
        assert why in str(refusal.value) and "\n" not in str(refusal.value)

    def test_too_large_for_the_memory_are_refused_before_they_are_drawn(self) -> None:
        with pytest.raises(ValueError, match=r"drawing patterns of shape .* needs .* GiB"):
            Patterns.draw(Task(n_inputs=10**8, pattern_bins=10**6), 0)

    def test_too_large_for_the_memory_are_refused_before_they_are_looked_at(self) -> None:
        with pytest.raises(ValueError, match=r"patterns of shape .* GiB"):
            Patterns.from_dense(np.broadcast_to(np.int8(0), (10**6, 10**6, 100)))

    def test_cannot_be_changed_after_they_were_checked(self) -> None:
        patterns = Patterns.draw(Task(rate=0.5), 0)
        for array in (patterns.channels, patterns.offsets):
            with pytest.raises(ValueError, match="cannot set WRITEABLE"):
                array.setflags(write=True)

    def test_must_be_drawn_for_a_task(self) -> None:
        with pytest.raises(ValueError, match=r"task must be a gnm_env\.Task, got None"):
            Patterns.draw(None, 0)  # type: ignore[arg-type]

    def test_show_themselves_in_a_line(self) -> None:
        shown = repr(Patterns.draw(Task(n_classes=2), 0))
        assert "\n" not in shown and "2 of 50 bins, 100 channels" in shown

    @pytest.mark.parametrize("shape", [(50, 100), (1, 0, 100), (0, 50, 100), (1, 50, 0), ()])
    def test_of_another_number_of_axes_are_refused(self, shape: tuple[int, ...]) -> None:
        with pytest.raises(ValueError, match="patterns must have shape") as refusal:
            Patterns.from_dense(np.zeros(shape))
        assert str(shape) in str(refusal.value)

    @pytest.mark.parametrize("value", [2, -1, 0.5, np.nan, "x"])
    def test_that_are_not_binary_are_refused(self, value: Any) -> None:
        with pytest.raises(ValueError, match="patterns must be binary"):
            Patterns.from_dense(np.array([[[value, value]]]))

    @pytest.mark.parametrize("seed", [-1, 1.5, None, "0"])
    def test_need_a_whole_seed(self, seed: Any) -> None:
        with pytest.raises(ValueError, match="pattern seed"):
            Patterns.draw(Task(), seed)


class TestWorld:
    @pytest.mark.parametrize("field", ["n_classes", "pattern_bins", "n_inputs"])
    def test_patterns_must_fit_the_task(self, field: str) -> None:
        with pytest.raises(ValueError, match="patterns must have shape") as refusal:
            task_arrays(Task(**{field: 7}), Patterns.draw(Task(), 0))
        assert "(1, 50, 100)" in str(refusal.value)

    def test_a_trial_must_fit_into_the_memory(self) -> None:
        task = Task(n_inputs=10**8, pattern_bins=1, background_bins=10**7, rate=0.5)
        patterns = Patterns([], [0, 0], (1, 1, 10**8))  # type: ignore[arg-type]
        with pytest.raises(ValueError, match=r"a trial of .* bins .* needs .* GiB"):
            task_arrays(task, patterns)

    def test_patterns_must_be_patterns(self) -> None:
        with pytest.raises(ValueError, match=r"use Patterns\.from_dense"):
            task_arrays(Task(), "patterns")  # type: ignore[arg-type]
