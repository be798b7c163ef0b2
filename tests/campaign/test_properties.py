"""Properties of what comes in from outside, on examples that Hypothesis makes up."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from agents import load_checkpoint
from gnm_env import Task, Trial, Trials
from gnm_env.files import ArraySpec, read_arrays, write_arrays

settings.register_profile("suite", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("suite")

ANYTHING: Any = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(-(10**400), 10**400),
    st.floats(),
    st.complex_numbers(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text(max_size=2), st.integers(), max_size=1),
    st.sampled_from([object(), np.array(2), np.float32(0.5), np.array([1, 2])]),
)
DTYPES = st.sampled_from(["f8", "f4", "i8", "i4", "u1", "?", ">f8", "<U3"])


@given(st.dictionaries(st.sampled_from(list(Task.__dataclass_fields__)), ANYTHING, max_size=3))
def test_a_task_is_made_or_refused_in_a_sentence(keywords: dict[str, Any]) -> None:
    try:
        task = Task(**keywords)
    except ValueError as refusal:
        assert any(name in str(refusal) for name in Task.__dataclass_fields__)
        return
    assert task == Task(**{name: getattr(task, name) for name in Task.__dataclass_fields__})


@given(
    st.binary(max_size=400),
    st.sampled_from([b"", b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY\x01\x00"]),
)
def test_bytes_that_mean_nothing_are_refused_by_everything_that_reads(
    content: bytes, start: bytes
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "file")
        path.write_bytes(start + content)
        for read in (
            load_checkpoint,
            Trials.load,
            lambda p: read_arrays(p, {"a": ArraySpec("f8")}),
        ):
            with pytest.raises(ValueError, match="file"):
                read(path)


@given(
    st.dictionaries(
        st.text("abcäß_0/.", min_size=1, max_size=4),
        arrays.arrays(DTYPES, arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)),
        max_size=4,
    )
)
def test_arrays_come_back_from_a_file_as_they_were(given_: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "file")
        write_arrays(path, given_)
        specs = {
            name: ArraySpec(array.dtype.newbyteorder("="), array.shape)
            for name, array in given_.items()
        }
        read = read_arrays(path, specs)
    assert read.keys() == given_.keys()
    for name, array in given_.items():
        assert read[name].shape == array.shape
        assert read[name].tobytes() == array.astype(array.dtype.newbyteorder("=")).tobytes()


@given(st.data())
def test_a_trial_is_the_same_from_spike_times_and_from_a_raster(data: st.DataObject) -> None:
    n_bins, n_inputs = data.draw(st.integers(1, 12)), data.draw(st.integers(1, 5))
    times = data.draw(
        st.lists(
            st.lists(st.floats(0, n_bins, exclude_max=True), max_size=6),
            min_size=n_inputs,
            max_size=n_inputs,
        )
    )
    raster = np.zeros((n_bins, n_inputs), np.bool_)
    for channel, spikes in enumerate(times):
        raster[np.floor(np.array(spikes)).astype(int), channel] = True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # two spikes in one bin, or times that look like seconds
        one = Trial.from_times(times, n_bins, label=2)
    other = Trial.from_dense(raster, label=2)
    assert np.array_equal(one.dense(), raster)
    assert np.array_equal(one.channels, other.channels)
    assert np.array_equal(one.offsets, other.offsets)


@given(
    st.lists(
        st.tuples(st.integers(1, 9), st.integers(0, 3), st.integers(0, 99)), min_size=1, max_size=4
    )
)
def test_trials_come_back_from_a_file_as_they_were(shapes: list[tuple[int, int, int]]) -> None:
    made = [
        Trial.from_dense(np.random.default_rng(seed).random((n_bins, 3)) < 0.3, label=label)
        for n_bins, label, seed in shapes
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "file")
        Trials(made).save(path)
        read = Trials.load(path)
    assert len(read) == len(made)
    for one, other in zip(read, made, strict=True):
        assert np.array_equal(one.dense(), other.dense())
        assert one.label == other.label
