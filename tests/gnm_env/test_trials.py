"""Data sets of trials: nothing is lost on the way in, in parts, through a file or laid out."""

from __future__ import annotations

import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from gnm_env import Patterns, Task, Trial, Trials, draw_trial
from gnm_env.segments import TrialArrays
from gnm_env.trials_kernels import BATCH_BINS, lay_out

N = 5


def random_trial(rng: Generator, most_bins: int = 12) -> Trial:
    """A trial with presentations of any lengths, classes and targets, or with its label alone."""
    n_bins = int(rng.integers(1, most_bins + 1))
    raster = rng.random((n_bins, N)) < rng.random()
    if rng.random() < 0.3:
        return Trial.from_dense(raster, label=int(rng.integers(0, 5)))
    cuts = np.sort(rng.choice(n_bins + 1, min(n_bins + 1, 2 * int(rng.integers(0, 4))), False))
    cuts = cuts[: len(cuts) // 2 * 2]
    k = len(cuts) // 2
    return Trial.from_dense(
        raster,
        cuts[::2],
        rng.integers(0, 3, k),
        targets=rng.integers(0, 4, k),
        ends=cuts[1::2],
    )


def random_trials(seed: int = 0, n: int = 20) -> list[Trial]:
    rng = np.random.default_rng(seed)
    return [random_trial(rng) for _ in range(n)]


def assert_same_trial(one: Trial, other: Trial) -> None:
    for a, b in zip((*one.arrays, one.classes), (*other.arrays, other.classes), strict=True):
        assert a.dtype == b.dtype and a.tolist() == b.tolist()
    assert one.label_only == other.label_only and one.n_inputs == other.n_inputs
    assert one.pattern_bins == other.pattern_bins or len(one.onsets) == 0


def assert_same(one: Any, other: Any) -> None:
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        assert_same_trial(a, b)


KNOWN: dict[str, Any] = dict(
    columns={"voice": list("abcdeabcdeabcdeabcde"), "words": [[i, "x"] for i in range(20)]},
    metadata={"made": {"by": "a test", "rates": [0.5, 1e300]}},
)


class TestADataSet:
    def test_holds_the_trials_that_it_was_made_of(self) -> None:
        held = random_trials()
        trials = Trials(held)
        assert_same(trials, held)
        assert len(trials) == 20 and trials.n_inputs == N
        assert trials.labels.tolist() == [trial.label for trial in held]
        assert trials.n_bins.tolist() == [trial.n_bins for trial in held]
        assert trials.n_spikes.tolist() == [len(trial.channels) for trial in held]
        assert trials.label_only.tolist() == [trial.label_only for trial in held]
        assert trials.n_classes == 1 + max(max(t.classes, default=-1) for t in held)

    def test_knows_the_rate_of_each_channel(self) -> None:
        held = random_trials()
        raster = np.concatenate([trial.dense() for trial in held])
        assert np.allclose(Trials(held).rates, raster.mean(axis=0))

    def test_draws_what_draw_trial_draws(self) -> None:
        task = Task(n_inputs=7, pattern_bins=3, rate=0.1, n_classes=2, background_bins=9)
        patterns = Patterns.draw(task, 0)
        rng = np.random.default_rng(3)
        trials = Trials.draw(task, patterns, 300, seed=3)
        assert_same(trials, [draw_trial(task, patterns, rng) for _ in range(300)])
        assert all(trial.pattern_bins == 3 for trial in trials)
        assert trials.n_classes == 2

    def test_draws_on_from_a_generator(self) -> None:
        task = Task(n_classes=2)
        patterns, rng = Patterns.draw(task, 0), np.random.default_rng(1)
        parts = [Trials.draw(task, patterns, n, rng) for n in (5, 6)]
        assert_same(Trials.concatenate(parts), Trials.draw(task, patterns, 11, 1))

    def test_takes_flat_arrays(self) -> None:
        trials = Trials.from_arrays(
            3,
            n_bins=[4, 2],
            spikes=[3, 1],
            channels=[0, 2, 1, 1],
            bins=[0, 0, 3, 1],
            presentations=[2, 0],
            onsets=[0, 3],
            ends=[2, 4],
            targets=[1, 2],
            classes=[0, 1],
        )
        assert trials[0].dense().astype(int).tolist() == [
            [1, 0, 1],
            [0, 0, 0],
            [0, 0, 0],
            [0, 1, 0],
        ]
        assert trials[0].edges.tolist() == [0, 0, 2, 3, 4, 4]
        assert trials[1].dense().astype(int).tolist() == [[0, 0, 0], [0, 1, 0]]
        assert trials.labels.tolist() == [3, 0] and not trials.label_only.any()

    def test_takes_flat_arrays_with_labels_alone(self) -> None:
        trials = Trials.from_arrays(2, [4, 2], [0, 1], [1], [1], labels=[3, 0])
        assert trials.labels.tolist() == [3, 0] and trials.label_only.all()
        assert trials.n_classes == 0

    def test_needs_little_more_memory_than_its_spikes(self) -> None:
        """At most 3 times the channels of the spikes, places and segments included."""
        trials = Trials.draw(Task(), Patterns.draw(Task(), 0), 5_000, 0)
        assert trials.nbytes <= 3 * 4 * trials.n_spikes.sum()

    def test_shows_itself_in_a_line(self) -> None:
        for trials in (
            Trials(random_trials()),
            Trials(random_trials(n=1)),
            Trials(random_trials())[:3],
        ):
            assert "\n" not in repr(trials) and len(repr(trials)) < 180
        assert repr(Trials([Trial.from_dense([[1, 0], [0, 0]], label=3)])) == (
            "Trials(1 of 2 bins, 2 channels, 0.25 spikes per bin and channel, 0 classes, "
            "labels 3, all label only)"
        )

    def test_cannot_be_changed(self) -> None:
        trials = Trials(random_trials(), **KNOWN)
        for name in ("labels", "n_inputs", "columns", "anything"):
            with pytest.raises(AttributeError):
                setattr(trials, name, 1)
        trials.metadata["made"]["by"] = "somebody"
        assert trials.metadata["made"]["by"] == "a test"
        with pytest.raises(TypeError):
            trials.columns["voice"] = ()  # type: ignore[index]
        trials.labels[:] = 7
        trials[0].arrays.edges[:] = 0
        assert_same(trials, random_trials())

    def test_survives_pickling(self) -> None:
        trials = pickle.loads(pickle.dumps(Trials(random_trials(), **KNOWN)))
        assert_same(trials, random_trials())
        assert trials.columns["voice"][3] == "d" and trials.metadata == KNOWN["metadata"]

    def test_is_checked_when_unpickled(self) -> None:
        rebuild, (arrays, *others) = Trials(random_trials()).__reduce__()
        with pytest.raises(ValueError, match="outside its bins"):
            rebuild(arrays._replace(bins=arrays.bins + 100), *others)

    @pytest.mark.parametrize(
        ("trials", "keywords", "why"),
        [
            ([], {}, "at least one gnm_env.Trial, got none"),
            (None, {}, "a list of gnm_env.Trial, got None"),
            ([1], {}, "got 1 among them"),
            ([Trial.from_dense([[1]], label=0), None], {}, "got None among them"),
            ([Trial.from_dense([[1]], label=0), Trial.from_dense([[1, 0]], label=0)], {},
             "all must have the same n_inputs, got 1 and, at place 1, 2"),
            (random_trials(), {"n_classes": 1}, "n_classes must be more than the largest class"),
            (random_trials(), {"n_classes": 2**40}, "n_classes must be at most"),
            (random_trials(), {"columns": {"a": [1]}}, "one entry per trial, 20, got 1"),
            (random_trials(), {"columns": {"a": 3}}, "one entry per trial, got 3"),
            (random_trials(), {"columns": {"a": [object()] * 20}}, "column 'a' must be JSON"),
            (random_trials(), {"columns": [1]}, "columns must be a dictionary"),
            (random_trials(), {"metadata": {"a": {1, 2}}}, "metadata must be JSON"),
            (random_trials(), {"metadata": 3}, "metadata must be a dictionary, got 3"),
        ],
    )  # fmt: skip
    def test_refuses_what_does_not_fit(self, trials: Any, keywords: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trials(trials, **keywords)
        assert why in str(refusal.value) and "\n" not in str(refusal.value)

    GOOD = dict(
        n_inputs=3, n_bins=[4, 2], spikes=[3, 1], channels=[0, 2, 1, 1], bins=[0, 0, 3, 1],
        presentations=[2, 0], onsets=[0, 3], ends=[2, 4], targets=[1, 2], classes=[0, 1],
    )  # fmt: skip

    @pytest.mark.parametrize(
        ("field", "value", "why"),
        [
            ("n_inputs", 2, "channels must lie in 0 … 1, got 2"),
            ("n_bins", [], "there must be 1 …"),
            ("n_bins", [4, 0], "n_bins must lie in 1 …"),
            ("n_bins", [4, 2**62], "n_bins must lie in 1 …"),
            ("n_bins", [4, 2, 1], "presentations must have one entry per trial, 3"),
            ("n_bins", [3, 2], "trial 0 has a spike outside its bins"),
            ("spikes", [3, 2], "channels must have one entry for each of the 5, got 4"),
            ("spikes", [3], "spikes must have one entry per trial, 2"),
            ("spikes", [5, -1], "spikes must lie in 0 …"),
            ("spikes", [2, 2], "trial 1 has a spike outside its bins"),
            ("spikes", [3, 2**62], "spikes must lie in 0 …"),
            ("channels", [2, 0, 1, 1], "trial 0 has spikes that are not sorted"),
            ("channels", [0, 0, 1, 1], "not sorted by bin and channel, or one twice"),
            ("bins", [0, 3, 0, 1], "trial 0 has spikes that are not sorted"),
            ("bins", [0, 0, 3], "bins must have one entry for each of the 4, got 3"),
            ("bins", [0, 0, 3, -1], "bins must lie in 0 …"),
            ("presentations", [2, 1], "onsets must have one entry for each of the 3"),
            ("presentations", [1, 1], "trial 1 has presentations that overlap"),
            ("presentations", None, "give either labels or presentations"),
            ("labels", [1, 2], "give either labels or presentations"),
            ("onsets", [0, 1], "trial 0 has presentations that overlap"),
            ("ends", [2, 5], "trial 0 has presentations that overlap, are empty"),
            ("ends", [0, 4], "trial 0 has presentations that overlap, are empty"),
            ("ends", [2], "ends must have one entry for each of the 2"),
            ("targets", [1, -2], "targets must lie in 0"),
            ("targets", [1.5, 2], "targets must be whole numbers"),
            ("classes", [-1, 0], "classes must lie in 0"),
        ],
    )  # fmt: skip
    def test_refuses_flat_arrays_that_do_not_fit(self, field: str, value: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            Trials.from_arrays(**{**self.GOOD, field: value})  # type: ignore[arg-type]
        assert why in str(refusal.value) and "\n" not in str(refusal.value)

    @pytest.mark.parametrize(
        ("n", "seed", "why"),
        [
            (0, 0, "n must be >= 1"),
            (2**62, 0, "n must be at most"),
            (99_000_000, 0, "needs .* GiB"),
            (5, "x", "seed must be a whole number"),
            (5, -1, "seed must be >= 0"),
        ],
    )
    def test_says_what_cannot_be_drawn(self, n: Any, seed: Any, why: str) -> None:
        task = Task(n_inputs=100_000, pattern_bins=1, mean_occurrences=0.1)
        patterns = Patterns.from_dense(np.zeros((1, 1, 100_000)))
        with pytest.raises(ValueError, match=why):
            Trials.draw(task, patterns, n, seed)


class TestPartsOfIt:
    HELD = random_trials()
    TRIALS = Trials(HELD, **KNOWN)

    @pytest.mark.parametrize("i", [0, 7, 19, -1, -20, np.int32(4)])
    def test_a_number_gives_a_trial(self, i: Any) -> None:
        assert_same_trial(self.TRIALS[i], self.HELD[i])

    @pytest.mark.parametrize("i", [20, -21, 2**70])
    def test_there_is_none_beyond_the_last(self, i: int) -> None:
        with pytest.raises(IndexError, match="there are 20 trials, got number"):
            self.TRIALS[i]

    @pytest.mark.parametrize(
        "key", [slice(3, 9), slice(None, None, -2), slice(5, 6), slice(-3, None)]
    )
    def test_a_slice_gives_a_data_set(self, key: slice) -> None:
        part = self.TRIALS[key]
        assert_same(part, self.HELD[key])
        assert part.columns["voice"] == tuple(KNOWN["columns"]["voice"][key])
        assert part.metadata == KNOWN["metadata"]

    def test_a_mask_or_numbers_give_a_data_set(self) -> None:
        mask = np.array(self.TRIALS.columns["voice"]) == "b"
        assert_same(self.TRIALS[mask], [self.HELD[i] for i in (1, 6, 11, 16)])
        assert_same(self.TRIALS[[3, 3, -1]], [self.HELD[i] for i in (3, 3, 19)])
        assert self.TRIALS[[3, 3, -1]].columns["words"] == ([3, "x"], [3, "x"], [19, "x"])

    @pytest.mark.parametrize("key", ["a", 1.0, None, True, [0.5], [[0]], [20], [True], {}])
    def test_nothing_else_selects(self, key: Any) -> None:
        with pytest.raises(IndexError, match="selected by a number in 0 … 19, a slice"):
            self.TRIALS[key]

    @pytest.mark.parametrize("key", [[], slice(0, 0), np.zeros(20, bool)])
    def test_an_empty_selection_is_refused(self, key: Any) -> None:
        with pytest.raises(ValueError, match="at least one trial"):
            self.TRIALS[key]

    def test_parts_can_be_joined(self) -> None:
        whole = Trials.concatenate([self.TRIALS[:6], self.TRIALS[6:7], self.TRIALS[7:]])
        assert_same(whole, self.HELD)
        assert whole.columns == self.TRIALS.columns and whole.metadata == self.TRIALS.metadata
        assert_same(self.TRIALS[:6] + self.TRIALS[6:], self.HELD)

    def test_what_only_some_know_is_none_elsewhere(self) -> None:
        other = Trials(self.HELD[:2], metadata={"made": 1, "b": 2}, columns={"sex": "mf"})
        both = self.TRIALS[:2] + other
        assert dict(both.columns)["sex"] == (None, None, "m", "f")
        assert both.columns["voice"] == ("a", "b", None, None)
        assert both.metadata == {}

    def test_only_equal_channels_are_joined(self) -> None:
        with pytest.raises(ValueError, match="the same n_inputs, got 5 and, at place 1, 10"):
            self.TRIALS + self.TRIALS.delayed([0, 1])
        with pytest.raises(ValueError, match="at least one Trials"):
            Trials.concatenate([])
        with pytest.raises(TypeError):
            self.TRIALS + 1  # type: ignore[operator]

    def test_shuffled_trials_are_the_same_trials(self) -> None:
        order = np.random.default_rng(5).permutation(20)
        assert order.tolist() != list(range(20))
        assert_same(self.TRIALS.shuffled(5), [self.HELD[i] for i in order])

    @given(st.integers(2, 40), st.floats(0, 1), st.integers(0, 2**128 - 1))
    @settings(deadline=None, max_examples=60)
    def test_a_split_shares_no_trial_and_loses_none(self, n: int, part: float, seed: int) -> None:
        empty = Trial.from_dense([[0]], label=0)
        trials = Trials([empty] * n, columns={"number": range(n)})
        nearest = [0 < k < n for k in range(n + 1) if abs(k - part * n) <= 0.5]
        if not any(nearest):
            with pytest.raises(ValueError, match="leaves one empty"):
                trials.split(part, seed)
            return
        if not all(nearest):  # half way between a part and none: either is right
            return
        first, second = (half.columns["number"] for half in trials.split(part, seed))
        assert sorted(first + second) == list(range(n))
        assert abs(len(first) - part * n) <= 0.5
        assert list(first) == sorted(first) and list(second) == sorted(second)

    def test_a_split_may_keep_groups_together(self) -> None:
        seen = set()
        for seed in range(20):
            first, second = self.TRIALS.split(0.4, seed, by="voice")
            assert (len(first), len(second)) == (8, 12)
            voices = set(first.columns["voice"])
            assert not voices & set(second.columns["voice"])
            seen.add(frozenset(voices))
        assert len(seen) > 3

    @pytest.mark.parametrize(
        ("fraction", "seed", "by", "why"),
        [
            (1.5, 0, None, "fraction must be in 0 … 1"),
            ("a", 0, None, "fraction must be a number"),
            (0.5, None, None, "seed must be a whole number"),
            (0.5, 0, "sex", "by must be one of the columns, ['voice', 'words']"),
            (0.5, 0, [], "by must be one of the columns"),
            (0.0, 0, None, "leaves one empty"),
            (0.04, 0, "voice", "(5 groups) leaves one empty"),
        ],
    )
    def test_says_how_it_cannot_be_split(self, fraction: Any, seed: Any, by: Any, why: str) -> None:
        with pytest.raises(ValueError) as refusal:
            self.TRIALS.split(fraction, seed, by=by)
        assert why in str(refusal.value)


class TestDelayedChannels:
    @given(st.integers(0, 2**32), st.lists(st.integers(0, 15), min_size=1, max_size=5))
    @settings(deadline=None, max_examples=60)
    def test_are_the_channels_so_many_bins_later(self, seed: int, delays: list[int]) -> None:
        held = random_trials(seed, 4)
        trials = Trials(held).delayed(delays)
        assert trials.n_inputs == N * len(delays)
        for trial, original in zip(trials, held, strict=True):
            raster = original.dense()
            expected = np.zeros((original.n_bins, N * len(delays)), np.bool_)
            for d, delay in enumerate(delays):
                for t in range(original.n_bins - delay):
                    expected[t + delay, d * N : (d + 1) * N] = raster[t]
            assert np.array_equal(trial.dense(), expected)
            again = pickle.loads(pickle.dumps(trial))  # checks that channels ascend
            assert again.edges.tolist() == original.edges.tolist()
            assert trial.label == original.label

    def test_keep_what_is_known(self) -> None:
        trials = Trials(random_trials(), **KNOWN).delayed(range(0, 4, 2))
        assert trials.columns["voice"] == tuple(KNOWN["columns"]["voice"])
        assert trials.metadata == KNOWN["metadata"]

    @pytest.mark.parametrize(
        ("delays", "why"),
        [
            ([], "at least one number of bins"),
            ([-1], "delays must lie in 0 …"),
            ([0.5], "whole numbers"),
            ([2**62], "delays must lie in 0 …"),
            (5, "a row of whole numbers, got 5"),
        ],
    )
    def test_say_what_they_need(self, delays: Any, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            Trials(random_trials()).delayed(delays)


class TestLayingOut:
    """Compiled loops hear the trials of a data set as they hear drawn ones."""

    @staticmethod
    def laid_out(trials: Trials, which: Any, first: int, room: int = 1, most: int = 64) -> Any:
        bin_of, edge_of = np.full(most + 1, -7), np.full(most + 1, -7)
        channels, offsets, edges, target, n, longest = lay_out(
            trials.arrays,
            np.asarray(which, np.int64),
            first,
            np.empty(room, np.int32),
            np.empty(room, np.int64),
            np.empty(room, np.int64),
            np.empty(room, np.int64),
            bin_of,
            edge_of,
        )
        laid = [
            TrialArrays(
                channels,
                offsets[bin_of[k] : bin_of[k + 1] + 1],
                edges[edge_of[k] : edge_of[k + 1]],
                target[edge_of[k] : edge_of[k + 1] - 1],
            )
            for k in range(n)
        ]
        assert longest == max(arrays.edges[-1] for arrays in laid)
        return laid

    @given(st.integers(0, 2**32), st.integers(1, 200), st.integers(0, 19))
    @settings(deadline=None, max_examples=40)
    def test_gives_each_trial_as_it_is(self, seed: int, room: int, first: int) -> None:
        trials = Trials(random_trials(seed))
        which = np.random.default_rng(seed).permutation(20)
        laid = self.laid_out(trials, which, first, room)
        assert len(laid) == 20 - first
        for arrays, i in zip(laid, which[first:], strict=True):
            expected = trials[int(i)].arrays
            assert (arrays.offsets - arrays.offsets[0]).tolist() == expected.offsets.tolist()
            spikes = arrays.channels[arrays.offsets[0] : arrays.offsets[-1]]
            assert spikes.tolist() == expected.channels.tolist()
            assert arrays.edges.tolist() == expected.edges.tolist()
            assert arrays.target.tolist() == expected.target.tolist()

    def test_stops_when_there_are_bins_enough(self) -> None:
        trials = Trials([Trial.from_dense(np.zeros((BATCH_BINS // 2, 1)), label=0)])
        assert len(self.laid_out(trials, np.zeros(9), 0)) == 2
        trials = Trials([Trial.from_dense(np.zeros((BATCH_BINS // 2 - 1, 1)), label=0)])
        assert len(self.laid_out(trials, np.zeros(9), 0)) == 3
        trials = Trials([Trial.from_dense(np.zeros((3 * BATCH_BINS, 1)), label=0)])
        assert len(self.laid_out(trials, np.zeros(9), 8)) == 1

    def test_stops_where_there_is_no_room_to_say_where_trials_begin(self) -> None:
        assert len(self.laid_out(Trials(random_trials()), range(20), 3, most=5)) == 5


class TestFiles:
    def test_give_back_what_was_saved(self, tmp_path: Path) -> None:
        for seed in range(10):
            trials = Trials(random_trials(seed), n_classes=7, **KNOWN)
            trials.save(tmp_path / "a.trials")
            again = Trials.load(tmp_path / "a.trials")
            assert_same(again, trials)
            assert again.n_classes == 7 and again.pattern_bins == trials.pattern_bins
            assert again.columns == trials.columns and again.metadata == trials.metadata
        assert [path.name for path in tmp_path.iterdir()] == ["a.trials"]

    def test_of_drawn_trials_keep_the_length_of_patterns(self, tmp_path: Path) -> None:
        task = Task(n_inputs=300, mean_occurrences=0.5, background_bins=70_000, rate=1e-5)
        trials = Trials.draw(task, Patterns.draw(task, 0), 6, 0)
        trials.save(tmp_path / "a")
        assert_same(Trials.load(tmp_path / "a"), trials)
        assert all(trial.pattern_bins == 50 for trial in Trials.load(tmp_path / "a"))

    def test_are_small(self, tmp_path: Path) -> None:
        """A spike of the default task holds about 9 bits."""
        trials = Trials.draw(Task(), Patterns.draw(Task(), 0), 2_000, 0)
        trials.save(tmp_path / "a")
        assert (tmp_path / "a").stat().st_size < 2.2 * trials.n_spikes.sum()

    def test_with_any_changed_byte_are_refused_or_the_same(self, tmp_path: Path) -> None:
        trials = Trials(random_trials(n=5), columns={"a": range(5)})
        path = tmp_path / "a"
        trials.save(path)
        good = path.read_bytes()
        rng = np.random.default_rng(0)
        refused = 0
        for place in rng.permutation(len(good))[:400]:
            damaged = bytearray(good)
            damaged[place] ^= int(rng.integers(1, 256))
            path.write_bytes(damaged)
            try:
                assert_same(Trials.load(path), trials)
            except ValueError as error:
                assert "is not a readable file of trials" in str(error)
                assert "\n" not in str(error)
                refused += 1
        assert refused > 250

    def test_cut_short_are_refused(self, tmp_path: Path) -> None:
        path = tmp_path / "a"
        Trials(random_trials(n=5)).save(path)
        good = path.read_bytes()
        for length in range(0, len(good), 37):
            path.write_bytes(good[:length])
            with pytest.raises(ValueError, match="is not a readable file of trials"):
                Trials.load(path)

    @pytest.mark.parametrize(
        ("name", "change", "why"),
        [
            ("channels", lambda a: a + 5, "channels must lie in 0 … 4"),
            ("channels", lambda a: a.astype(np.uint16), "'channels' must be uint8"),
            ("channels", lambda a: a[::-1].copy(), "spikes that are not sorted"),
            ("channels", lambda a: a[:-1], "'steps' must have shape"),
            ("steps", lambda a: a + np.uint8(9), "outside its bins"),
            ("spikes", lambda a: a + 1, "spikes must add up to"),
            ("spikes", lambda a: -a, "spikes must add up to"),
            ("spikes", lambda a: np.append(a[:-2], [2**62, 2**62]), "spikes must add up to"),
            ("segments", lambda a: a[::-1] + 1, "segments must add up to"),
            ("segments", lambda a: np.append(np.append(a[0] + 1, a[1] - 1), a[2:]), "even number"),
            ("edges", lambda a: a - 1, "edges must lie in"),
            ("edges", lambda a: a * 0, "outside its bins|presentations that overlap"),
            ("edges", lambda a: a + 2**60, "edges must lie in"),
            ("target", lambda a: a - 9, "spikes owed in noise, or fewer"),
            ("target", lambda a: a + 1, "spikes owed in noise"),
            ("target", lambda a: a * 2**50, "spikes owed in noise, or fewer|no trial may be owed"),
            ("classes", lambda a: a - 9, "classes must lie in"),
            ("classes", lambda a: a[1:], "one class for each presentation"),
            ("label_only", lambda a: ~a, "spikes owed in noise"),
            ("label_only", lambda a: a.astype(np.uint8), "'label_only' must be bool"),
            ("header", lambda a: a[:-1], "not a readable file of trials"),
            ("other", lambda a: np.zeros(3), "'other' that does not belong there"),
        ],
    )
    def test_whose_contents_do_not_fit_are_refused(
        self, tmp_path: Path, name: str, change: Any, why: str
    ) -> None:
        path = tmp_path / "a.npz"
        Trials(random_trials()).save(path)
        with np.load(path) as file:
            arrays = dict(file)
        arrays[name] = change(arrays.get(name))
        np.savez(path, **arrays)
        with pytest.raises(ValueError, match=why) as refusal:
            Trials.load(path)
        assert "\n" not in str(refusal.value)

    @pytest.mark.parametrize(
        ("key", "value", "why"),
        [
            ("kind", "neuron", "it holds no trials"),
            ("format", 2, "it is of format 2, this reads 1"),
            ("n_inputs", 4, "channels must lie in 0 … 3"),
            ("n_inputs", 10**12, "n_inputs must be at most"),
            ("n_inputs", None, "n_inputs must be a whole number"),
            ("steps", "object", "its steps are of type 'object"),
            ("steps", ["O"], "its steps are of type"),
            ("n_classes", 1, "n_classes must be more than the largest class"),
            ("pattern_bins", 3, "must all have pattern_bins = 3 bins"),
            ("columns", {"a": [1]}, "one entry per trial"),
            ("columns", 3, "columns must be a dictionary"),
            ("metadata", "a", "metadata must be a dictionary"),
        ],
    )
    def test_whose_header_does_not_fit_are_refused(
        self, tmp_path: Path, key: str, value: Any, why: str
    ) -> None:
        path = tmp_path / "a.npz"
        Trials(random_trials()).save(path)
        with np.load(path) as file:
            arrays = dict(file)
        header = json.loads(arrays["header"].tobytes())
        (header if key in header else header["known"])[key] = value
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
        np.savez(path, **arrays)
        with pytest.raises(ValueError, match=why):
            Trials.load(path)

    def test_of_another_kind_are_called_what_they_are(self, tmp_path: Path) -> None:
        path = tmp_path / "a"
        with pytest.raises(ValueError, match="there is no file of trials"):
            Trials.load(path)
        path.write_text("channel,time\n0,0.3\n")
        with pytest.raises(ValueError, match="it is a text file"):
            Trials.load(path)
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("a.txt", "text")
        with pytest.raises(ValueError, match="not an array of its own"):
            Trials.load(path)
        with pytest.raises(ValueError, match=r"cannot write .* no folder"):
            Trials(random_trials()).save(tmp_path / "none" / "a")

    def test_that_claim_more_than_they_hold_are_refused_before_memory_is_taken(
        self, tmp_path: Path
    ) -> None:
        path = tmp_path / "a.npz"
        Trials(random_trials()).save(path)
        with np.load(path) as file:
            arrays = dict(file)
        arrays["channels"] = np.zeros(1, np.uint8)
        np.savez(path, **arrays)
        raw = path.read_bytes()
        assert raw.count(b"'shape': (1,), }      ") == 1
        path.write_bytes(raw.replace(b"'shape': (1,), }      ", b"'shape': (9999999,), }"))
        with pytest.raises(ValueError, match=r"does not fill its|Bad CRC"):
            Trials.load(path)
