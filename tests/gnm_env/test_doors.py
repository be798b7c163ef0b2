"""Whatever a constructor is given, it refuses in a sentence, or compiled code can use it.

Compiled code looks at no bounds: what passes the door wrongly ends in a crash or in nonsense.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gnm_env import Patterns, Task, Trial, Trials

number = st.one_of(
    st.integers(-2, 6),
    st.sampled_from([2**31, 2**62, 2**63, -(2**63), 2**70, 0.5, np.nan, np.inf, None, "a", True]),
)
row = st.one_of(
    st.lists(st.integers(0, 4), max_size=8),
    st.lists(st.integers(0, 4), max_size=8).map(sorted),
    st.lists(st.integers(0, 4), max_size=8).map(lambda values: np.array(values, ">i2")),
    st.lists(number, max_size=6),
    st.lists(st.lists(number, max_size=3), max_size=3),
    number,
)
offsets = st.one_of(row, st.lists(st.integers(0, 3), max_size=6).map(lambda n: [0, *np.cumsum(n)]))


def refused(make: Any) -> Any:
    """What `make` makes, or None if it refuses with one sentence."""
    try:
        return make()
    except ValueError as error:
        assert "\n" not in str(error) and str(error)
        return None


def assert_sound(trial: Trial) -> None:
    raster = trial.dense()
    assert raster.sum() == len(trial.channels) and raster.shape == (trial.n_bins, trial.n_inputs)
    owner = trial.owner()
    assert np.bincount(owner[owner >= 0], minlength=len(trial.onsets)).tolist() == (
        (trial.ends - trial.onsets).tolist()
    )
    assert 0 <= trial.label == trial.target.sum()
    (again,) = Trials([trial])
    assert np.array_equal(again.dense(), raster)


@given(row, offsets, row, row, row, number, number, st.none() | row, st.none() | number)
@settings(deadline=None, max_examples=200)
def test_a_trial(
    channels: Any, starts: Any, onsets: Any, classes: Any, targets: Any, n_inputs: Any,
    pattern_bins: Any, ends: Any, label: Any,
) -> None:  # fmt: skip
    trial = refused(
        lambda: Trial(
            channels, starts, onsets, classes, targets, n_inputs, pattern_bins, ends, label
        )
    )
    if trial is not None:
        assert_sound(trial)


@given(st.integers(1, 6), st.integers(1, 4), st.data())
@settings(deadline=None, max_examples=200)
def test_a_trial_of_which_one_number_is_wrong(n_bins: int, n_inputs: int, data: Any) -> None:
    """Valid arrays with one entry changed: nearer to what a mistake looks like."""
    raster = np.array(data.draw(st.lists(st.booleans(), min_size=24, max_size=24)))
    good = Trial.from_dense(
        np.resize(raster, (n_bins, n_inputs)),
        [0],
        targets=[2],
        ends=[data.draw(st.integers(1, n_bins))],
    )
    arrays = {
        name: getattr(good, name).copy()
        for name in ("channels", "offsets", "onsets", "classes", "targets", "ends")
    }
    name = data.draw(st.sampled_from([name for name in arrays if len(arrays[name])]))
    place = data.draw(st.integers(0, len(arrays[name]) - 1))
    arrays[name][place] = data.draw(st.integers(-3, 10) | st.sampled_from([2**31 - 1, -(2**31)]))
    trial = refused(lambda: Trial(**arrays, n_inputs=n_inputs))
    if trial is not None:
        assert_sound(trial)


@given(row, offsets, st.one_of(st.tuples(number, number, number), number, st.lists(number)))
@settings(deadline=None, max_examples=200)
def test_patterns(channels: Any, starts: Any, shape: Any) -> None:
    patterns = refused(lambda: Patterns(channels, starts, shape))
    if patterns is not None:
        assert patterns.dense().shape == patterns.shape
        assert patterns.dense().sum() == len(patterns.channels)


@given(
    st.integers(1, 4), st.lists(st.integers(1, 5), max_size=3), row, row, row,
    st.none() | row, st.none() | row, row, row, row,
)  # fmt: skip
@settings(deadline=None, max_examples=200)
def test_trials_from_flat_arrays(
    n_inputs: Any, n_bins: Any, spikes: Any, channels: Any, bins: Any, labels: Any,
    presentations: Any, onsets: Any, ends: Any, targets: Any,
) -> None:  # fmt: skip
    trials = refused(
        lambda: Trials.from_arrays(
            n_inputs, n_bins, spikes, channels, bins, labels=labels, presentations=presentations,
            onsets=onsets, ends=ends, targets=targets,
        )
    )  # fmt: skip
    for trial in trials or ():
        assert_sound(trial)


@given(
    st.one_of(st.lists(row, max_size=4), row), number, number,
    st.none() | row, st.none() | row, st.none() | row, st.none() | number,
)  # fmt: skip
@settings(deadline=None, max_examples=200)
def test_a_trial_from_times(
    times: Any, n_bins: Any, bin_width: Any, onsets: Any, lengths: Any, targets: Any, label: Any
) -> None:
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of merged spikes and of seconds
        trial = refused(
            lambda: Trial.from_times(
                times, n_bins, onsets, bin_width=bin_width, lengths=lengths, targets=targets,
                label=label,
            )
        )  # fmt: skip
    if trial is not None:
        assert_sound(trial)


@given(st.dictionaries(st.sampled_from(list(Task.__dataclass_fields__)), number | row, max_size=3))
@settings(deadline=None, max_examples=200)
def test_a_task(fields: Any) -> None:
    task = refused(lambda: Task(**fields))
    if task is not None:
        assert 0.0 <= task.rate <= 1.0 and len(task.owed) == task.n_classes
        assert Task(*task.__reduce__()[1]) == task
