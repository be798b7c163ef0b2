"""Each format on a small file, or object, that the test makes with the format's own library."""

from __future__ import annotations

import sys
import warnings
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gnm_env import Trials, recordings
from gnm_env.recordings import from_csv, from_events, from_hdf5, from_neo, from_nwb, from_pynapple
from gnm_env.recordings.common import Spikes, binned_trials, cut


def library(name: str) -> Any:
    """The library, whose own warnings are not ours to mend; skips the test where it is missing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name)


def where(trials: Trials, i: int) -> list[tuple[int, int]]:
    """(bin, channel) of each spike of a trial."""
    return [tuple(cell) for cell in np.argwhere(trials[i].dense()).tolist()]


class TestNeo:
    @pytest.fixture
    def block(self) -> Any:
        neo = library("neo")
        import quantities as pq

        block = neo.Block()
        for k, start in enumerate((0.0, 10.0)):
            segment = neo.Segment(name=f"run {k}", licks=np.int64(3 * k))
            block.segments.append(segment)
            for times in ([1.0, 57.5, 99.0], [20.0], []):
                segment.spiketrains.append(
                    neo.SpikeTrain(
                        (np.array(times) + 1000 * start) * pq.ms,
                        t_start=start * pq.s,
                        t_stop=(start + 0.1) * pq.s,
                    )
                )
            segment.epochs.append(
                neo.Epoch(
                    times=(np.array([0.07, 0.01]) + start) * pq.s,
                    durations=np.array([20.0, 30.0]) * pq.ms,
                    labels=np.array(["click", "tone" if k == 0 else "cough"]),
                )
            )
        return block

    def test_segments_are_trials_and_epochs_presentations(self, block: Any) -> None:
        trials = from_neo(block, bin_width=0.001, targets={"tone": 2, "click": 1})
        assert trials.n_bins.tolist() == [100, 100] and trials.n_inputs == 3
        assert where(trials, 0) == where(trials, 1) == [(1, 0), (20, 1), (57, 0), (99, 0)]
        assert trials[0].onsets.tolist() == [10, 70] and trials[0].ends.tolist() == [40, 90]
        assert trials[0].classes.tolist() == [0, 1] and trials.labels.tolist() == [3, 1]
        assert trials.columns["segment"] == ("run 0", "run 1")
        assert trials.metadata == {"classes": ["tone", "click"]}

    def test_labels_are_an_annotation_or_a_function(self, block: Any) -> None:
        trials = from_neo(block, bin_width=0.001, label="licks")
        assert trials.labels.tolist() == [0, 3] and trials.label_only.all()
        trials = from_neo(
            block.segments, bin_width=0.01, label=lambda segment: len(segment.spiketrains[0])
        )
        assert trials.labels.tolist() == [3, 3] and trials.n_bins.tolist() == [10, 10]

    def test_says_what_does_not_fit(self, block: Any) -> None:
        for arguments, why in [
            (dict(), "give either label, for each trial, or targets, for each epoch label"),
            (dict(label="cats"), "segment 0 has no annotation 'cats'"),
            (dict(label=[1]), "one label for each of the 2 trials, got 1"),
            (dict(label=[1, 0.5]), "the label of trial 1 must be a whole number"),
            (dict(label=[1, -1]), "the label of trial 1 must be >= 0"),
            (dict(targets={"tone": -1}), r"targets\['tone'\] must be >= 0"),
            (dict(targets=["tone"]), "targets must be a dictionary"),
        ]:
            with pytest.raises(ValueError, match=why):
                from_neo(block, bin_width=0.001, **arguments)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="must be a neo Block or Segments, got 3"):
            from_neo(3, bin_width=0.001, label=[1])
        block.segments[1].spiketrains.pop()
        with pytest.raises(ValueError, match=r"the same number of spike trains.*\[2, 3\]"):
            from_neo(block, bin_width=0.001, label="licks")


class TestNWB:
    @pytest.fixture
    def path(self, tmp_path: Path) -> Path:
        pynwb = library("pynwb")
        file = pynwb.NWBFile("a session", "id", datetime(2020, 1, 1, tzinfo=timezone.utc))  # noqa: UP017
        for times in ([0.1, 0.25, 1.05, 3.0], [1.0, 1.199]):
            file.add_unit(spike_times=times)
        file.add_trial_column("licks", "how often it licked")
        file.add_trial_column("on", "stimulus begins")
        file.add_trial_column("off", "stimulus ends")
        file.add_trial_column("kind", "which stimulus")
        file.add_trial(start_time=0.0, stop_time=0.3, licks=2, on=0.1, off=0.15, kind="A")
        file.add_trial(start_time=1.0, stop_time=1.2, licks=0, on=1.05, off=1.1, kind="none")
        path = tmp_path / "session.nwb"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with pynwb.NWBHDF5IO(str(path), "w") as io:
                io.write(file)
        return path

    @pytest.mark.filterwarnings("ignore")
    def test_units_are_channels_and_rows_trials(self, path: Path) -> None:
        trials = from_nwb(path, bin_width=0.01, label="licks")
        assert trials.n_inputs == 2 and trials.n_bins.tolist() == [30, 20]
        assert where(trials, 0) == [(10, 0), (25, 0)]
        assert where(trials, 1) == [(0, 1), (5, 0), (19, 1)]
        assert trials.labels.tolist() == [2, 0] and trials.label_only.all()
        assert trials.columns["kind"] == ("A", "none") and trials.columns["licks"] == (2, 0)

    @pytest.mark.filterwarnings("ignore")
    def test_presentations_are_in_columns(self, path: Path) -> None:
        trials = from_nwb(
            path, bin_width=0.01, targets={"B": 4, "A": 1}, presentation=("on", "off", "kind")
        )
        assert trials[0].onsets.tolist() == [10] and trials[0].ends.tolist() == [15]
        assert trials[0].classes.tolist() == [1] and len(trials[1].onsets) == 0
        assert trials.labels.tolist() == [1, 0]

    @pytest.mark.filterwarnings("ignore")
    def test_labels_are_a_function_of_the_row(self, path: Path) -> None:
        trials = from_nwb(path, bin_width=0.01, label=lambda row: int(row["kind"] == "A"))
        assert trials.labels.tolist() == [1, 0]

    @pytest.mark.filterwarnings("ignore")
    def test_says_what_does_not_fit(self, path: Path, tmp_path: Path) -> None:
        for arguments, why in [
            (dict(label="cats"), "no column 'cats': start_time, stop_time, licks"),
            (dict(targets={"A": 1}), "give presentation, the names of three columns"),
            (dict(targets={"A": 1}, label="licks"), "got both"),
        ]:
            with pytest.raises(ValueError, match=why):
                from_nwb(path, bin_width=0.01, **arguments)  # type: ignore[arg-type]
        (tmp_path / "text.nwb").write_text("no")
        for place in (tmp_path / "none.nwb", tmp_path / "text.nwb"):
            with pytest.raises(ValueError, match="cannot be read as an NWB file"):
                from_nwb(place, bin_width=0.01, label="licks")
        import pynwb

        empty = pynwb.NWBFile("a session", "id", datetime(2020, 1, 1, tzinfo=timezone.utc))  # noqa: UP017
        with pytest.raises(ValueError, match="has no units"):
            from_nwb(empty, bin_width=0.01, label="licks")


class TestHDF5:
    @pytest.fixture
    def path(self, tmp_path: Path) -> Path:
        h5py = library("h5py")
        path = tmp_path / "shd.h5"
        rows = [([0.001, 0.0101, 0.0405], [3, 0, 3]), ([0.02], [5])]
        with h5py.File(path, "w") as file:
            for k, (name, kind) in enumerate((("times", np.float64), ("units", np.uint16))):
                array = file.create_dataset(f"spikes/{name}", (2,), h5py.vlen_dtype(kind))
                for i, row in enumerate(rows):
                    array[i] = np.array(row[k], kind)
            file["labels"] = np.array([7, 2])
            file["extra/speaker"] = np.array([1, 0])
        return path

    def test_rows_are_trials(self, path: Path) -> None:
        trials = from_hdf5(path, bin_width=0.01)
        assert trials.n_inputs == 6 and trials.n_bins.tolist() == [5, 2]
        assert where(trials, 0) == [(0, 3), (1, 0), (4, 3)] and where(trials, 1) == [(1, 5)]
        assert trials.labels.tolist() == [7, 2] and trials.label_only.all()
        assert trials.columns["label"] == (7, 2) and trials.columns["speaker"] == (1, 0)

    def test_labels_sizes_and_durations_can_be_said(self, path: Path) -> None:
        trials = from_hdf5(
            path, bin_width=0.01, label=lambda word: int(word == 7), n_inputs=700, duration=1.0
        )
        assert trials.labels.tolist() == [1, 0] and trials.n_inputs == 700
        assert trials.n_bins.tolist() == [100, 100]
        assert from_hdf5(path, bin_width=0.02, label="extra/speaker").labels.tolist() == [1, 0]

    def test_says_what_does_not_fit(self, path: Path, tmp_path: Path) -> None:
        import h5py

        for arguments, why in [
            (dict(n_inputs=5), "n_inputs must be at least 6"),
            (dict(duration=0.04), "channel 3 has 0.0405 after the start of trial 0"),
            (dict(label="words"), "no array 'words'"),
            (dict(bin_width=0.0), "bin_width must be"),
            (dict(bin_width="1"), "bin_width must be a number, got '1'"),
            (dict(duration=[1]), r"duration must be a number, got \[1\]"),
            (dict(label=lambda word: int("x")), "of trial 0, .* it says: invalid literal"),
            (dict(path=3), "cannot read 3: a path must be text"),
        ]:
            with pytest.raises(ValueError, match=why):
                from_hdf5(**{"path": path, "bin_width": 0.01, **arguments})  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="cannot be read as an HDF5 file"):
            from_hdf5(tmp_path / "none.h5", bin_width=0.01)
        with h5py.File(path, "r+") as file:
            del file["labels"]
        with pytest.raises(ValueError, match="no labels for its 2 trials"):
            from_hdf5(path, bin_width=0.01)
        with h5py.File(path, "r+") as file:
            del file["spikes/units"]
        with pytest.raises(ValueError, match="no array 'spikes/units'"):
            from_hdf5(path, bin_width=0.01)


class TestEvents:
    TYPE = np.dtype([("x", np.int16), ("y", np.int16), ("t", np.int64), ("p", bool)])

    def test_pixels_and_polarities_are_channels(self) -> None:
        events = np.array([(0, 0, 1000, 0), (2, 1, 3500, 1), (2, 1, 9999, 0)], self.TYPE)
        trials = from_events(
            [events, events[:1]], bin_width=1000, label=[1, 0], sensor_size=(3, 2, 2)
        )
        assert trials.n_inputs == 12 and trials.n_bins.tolist() == [9, 1]
        assert where(trials, 0) == [(0, 0), (2, 6 + 5), (8, 5)]
        assert trials.labels.tolist() == [1, 0]

    def test_audio_has_no_rows(self) -> None:
        events = np.array([(4, 10), (1, 30)], np.dtype([("x", int), ("t", int)]))
        trials = from_events([events], bin_width=10, label=len, sensor_size=(5, 1, 1), duration=50)
        assert where(trials, 0) == [(0, 4), (2, 1)] and trials.n_bins.tolist() == [5]
        assert trials.labels.tolist() == [2]

    def test_says_what_does_not_fit(self) -> None:
        events = np.array([(0, 0, 1000, 0), (2, 1, 3500, 1)], self.TYPE)
        good = dict(recordings=[events], bin_width=10.0, label=[1], sensor_size=(3, 2, 2))
        for change, why in [
            (dict(sensor_size=(2, 2, 2)), r"x in 0 … 1 as sensor_size says, got 0 … 2"),
            (dict(sensor_size=5), "sensor_size must be"),
            (dict(sensor_size=(10**9, 1, 1)), "width of sensor_size must be at most"),
            (dict(sensor_size=(10**5, 10**5, 1)), "number of channels must be at most"),
            (dict(recordings=[]), "at least one recording"),
            (dict(recordings=[np.zeros(3)]), "recording 0 must be a structured array"),
            (dict(recordings=3), "recordings must be structured arrays, .* got 3"),
            (dict(recordings=[np.zeros(2, [("t", "U3")])]), "must have numbers as t, got <U3"),
            (dict(bin_width=None), "bin_width must be a number, got None"),
            (dict(duration="1"), "duration must be a number, got '1'"),
            (dict(label="class"), "label must be a function or a number"),
            (dict(label=5), "label must be a function, the name"),
            (dict(duration=100.0), "must lie within their trial"),
        ]:
            with pytest.raises(ValueError, match=why):
                from_events(**{**good, **change})  # type: ignore[arg-type]


class TestPynapple:
    @pytest.fixture
    def session(self) -> tuple[Any, Any, Any]:
        nap = library("pynapple")
        units = nap.TsGroup(
            {3: nap.Ts(np.array([0.1, 0.25, 1.05])), 7: nap.Ts(np.array([1.0, 2.0]))}
        )
        trials = nap.IntervalSet([0.0, 1.0], [0.3, 1.2], metadata={"licks": [2, 0]})
        return nap, units, trials

    def test_units_are_channels_and_intervals_trials(self, session: Any) -> None:
        _, units, trials = session
        found = from_pynapple(units, trials, bin_width=0.01, label="licks")
        assert found.n_inputs == 2 and found.n_bins.tolist() == [30, 20]
        assert where(found, 0) == [(10, 0), (25, 0)] and where(found, 1) == [(0, 1), (5, 0)]
        assert found.labels.tolist() == [2, 0] and found.columns["licks"] == (2, 0)
        found = from_pynapple(units, trials, bin_width=0.01, label=lambda t: int(t["end"] > 1))
        assert found.labels.tolist() == [0, 1]

    def test_interval_sets_are_presentations(self, session: Any) -> None:
        nap, units, trials = session
        shown = {"A": nap.IntervalSet([0.1, 0.4], [0.15, 0.5]), "B": nap.IntervalSet(1.1, 1.2)}
        found = from_pynapple(
            units, trials, bin_width=0.01, presentations=shown, targets={"A": 1, "B": 2}
        )
        assert [t.onsets.tolist() for t in found] == [[10], [10]]
        assert [t.ends.tolist() for t in found] == [[15], [20]]
        assert [t.classes.tolist() for t in found] == [[0], [1]]
        assert found.labels.tolist() == [1, 2]

    def test_says_what_does_not_fit(self, session: Any) -> None:
        _, units, trials = session
        for arguments, why in [
            ((units, 3, dict(label="licks")), r"trials must be a pynapple\.IntervalSet"),
            ((None, trials, dict(label="licks")), r"units must be a pynapple\.TsGroup"),
            ((units, trials, dict(label="cats")), "no metadata column 'cats': licks"),
            ((units, trials, dict(targets={"A": 1})), "an IntervalSet for each name in targets"),
        ]:
            with pytest.raises(ValueError, match=why):
                from_pynapple(arguments[0], arguments[1], bin_width=0.01, **arguments[2])  # type: ignore[arg-type]


class TestCSV:
    TEXT = "trial,channel,time,label\na,0,0.0131,2\nb,1,0.0007,0\na,2,0.0150,2\n"

    def test_lines_are_spikes(self, tmp_path: Path) -> None:
        path = tmp_path / "a.csv"
        path.write_text(self.TEXT)
        trials = from_csv(path, bin_width=0.001, label="label", n_inputs=5, duration=0.02)
        assert trials.n_inputs == 5 and trials.n_bins.tolist() == [20, 20]
        assert where(trials, 0) == [(13, 0), (15, 2)] and where(trials, 1) == [(0, 1)]
        assert trials.labels.tolist() == [2, 0] and trials.columns["trial"] == ("a", "b")

    def test_without_trials_all_is_one(self, tmp_path: Path) -> None:
        path = tmp_path / "a.csv"
        path.write_text("time;channel\n3;left\n1.5;right\n0.5;left\n")
        trials = from_csv(path, bin_width=1.0, label=[4], delimiter=";")
        assert where(trials, 0) == [(0, 0), (1, 1), (2, 0)]  # 3 is the very end
        assert trials.metadata == {"channels": ["left", "right"]} and trials.labels.tolist() == [4]

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("", "must name the columns channel and time in its first line, got nothing"),
            ("a,b\n1,2\n", "in its first line, got a, b"),
            ("channel,time\n", "has no spikes"),
            ("channel,time\n0\n", "line 2 of .* must have 2 entries"),
            ("channel,time\n0,1,2\n", "line 2 of .* must have 2 entries"),
            ("channel,time\n0,1\n0,x\n", "line 3 of .* must have a number as time, got 'x'"),
            (
                "channel,time\n0,nan\n",
                "must lie within their trial|must last longer|must be at most",
            ),
            ("channel,time\n0,-1\n", "channel 0 has -1"),
            ("channel,time\n-1,1\n", "channel must be >= 0, got -1"),
            (f"channel,time\n{10**30},1\n", "channel must be at most 99,999,999"),
            (
                "channel,time,label\n0,1,1\n0,2,2\n",
                "line 3 of .* must have '1' in the column 'label'",
            ),
        ],
    )
    def test_says_what_does_not_fit(self, tmp_path: Path, text: str, why: str) -> None:
        path = tmp_path / "a.csv"
        path.write_text(text)
        label: Any = "label" if "label" in text else [1]
        with pytest.raises(ValueError, match=why):
            from_csv(path, bin_width=1.0, label=label)

    @pytest.mark.parametrize(
        ("arguments", "why"),
        [
            (dict(path=None), "cannot read None: a path must be text"),
            (dict(path=3), "cannot read 3: a path must be text"),  # not the file that is open as 3
            (dict(path="a\0b"), "null byte"),
            (dict(delimiter=""), "delimiter must be one character, got ''"),
            (dict(delimiter=None), "delimiter must be one character, got None"),
            (dict(bin_width="1"), "bin_width must be a number, got '1'"),
            (dict(duration=True), "duration must be a number, got True"),
        ],
    )
    def test_says_which_argument_is_wrong(
        self, tmp_path: Path, arguments: dict[str, Any], why: str
    ) -> None:
        (tmp_path / "a.csv").write_text("channel,time\n0,1\n")
        good = dict(path=tmp_path / "a.csv", bin_width=1.0, label=[1])
        with pytest.raises(ValueError, match=why):
            from_csv(**{**good, **arguments})  # type: ignore[arg-type]

    def test_says_when_there_is_no_file(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="cannot be read as a table"):
            from_csv(tmp_path / "none.csv", bin_width=1.0, label=[1])


class TestGrasshopper:
    def test_hears_most_before_it_spikes(self) -> None:
        """The label knows about the sound, the spikes know something about the label."""
        library("nitime")
        trials = recordings.grasshopper()
        assert len(trials) == 400 and set(trials.n_bins.tolist()) == {50} and trials.n_inputs == 1
        first = np.array(trials.columns["recording"]) == 0
        assert trials.n_spikes[first].sum() == pytest.approx(929, abs=3)
        assert np.corrcoef(trials.n_spikes[first], trials.labels[first])[0, 1] > 0.25

    def test_takes_a_label_of_ones_own(self) -> None:
        library("nitime")
        trials = recordings.grasshopper(window=1.0, label=lambda loudness: loudness.size)
        assert trials.labels.tolist() == [20_000] * 20
        with pytest.raises(ValueError, match="window must be in"):
            recordings.grasshopper(window=20.0)


class TestCutting:
    def test_follows_each_interval(self) -> None:
        rng = np.random.default_rng(0)
        channels = [rng.random(50) * 10 for _ in range(3)]
        begins, ends = np.array([1.0, 0.5, 9.0]), np.array([3.0, 2.0, 9.5])
        spikes = cut(channels, begins, ends)
        for k in range(3):
            for i, train in enumerate(channels):
                mine = (spikes.trial == k) & (spikes.channel == i)
                inside = train[(train >= begins[k]) & (train < ends[k])]
                assert np.allclose(np.sort(spikes.time[mine]), np.sort(inside) - begins[k])

    def test_several_spikes_in_a_bin_are_told_once(self) -> None:
        rows = np.array([0, 0, 1, 1])
        spikes = Spikes(rows, rows * 0, np.array([0.1, 0.2, 0.3, 1.2]), np.array([2.0, 2.0]), 1)
        with pytest.warns(UserWarning, match="1 spike falls into a bin") as said:
            trials = binned_trials(spikes, 1.0, labels=np.array([0, 1]))
        assert len(said) == 1 and trials.n_spikes.tolist() == [1, 2]


def test_a_missing_library_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("neo", "pynwb", "h5py", "pynapple", "nitime"):
        monkeypatch.setitem(sys.modules, name, None)
    for call, extra in [
        (lambda: from_neo(None, bin_width=1.0, label=[1]), "neo"),
        (lambda: from_nwb("a", bin_width=1.0, label=[1]), "nwb"),
        (lambda: from_hdf5("a", bin_width=1.0), "hdf5"),
        (lambda: from_pynapple(1, 1, bin_width=1.0, label=[1]), "pynapple"),
        (recordings.grasshopper, "nitime"),
    ]:
        with pytest.raises(ImportError, match=rf"pip install 'gnm-env\[{extra}\]'"):
            call()
