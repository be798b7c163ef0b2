"""A continuous neuron with input spikes at any times: exactly for η = 0, in small steps else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.continuous.flow import STEPS_PER_BIN
from agents.continuous.neuron import ContinuousGNM
from gnm_env.checks import real, whole
from gnm_env.trial import Trial


@dataclass(frozen=True, eq=False)
class InputSpikes:
    """Input spikes in continuous time. Raises ValueError unless they are in order and in range.

    Attributes:
        times: float64 (K,), ascending, in bins, each in 0 … duration.
        channels: int64 (K,), the channel of each spike.
        duration: T, where the trial ends, in bins.
        n_inputs: N, number of channels.
    """

    times: NDArray[np.float64]
    channels: NDArray[np.int64]
    duration: float
    n_inputs: int

    def __post_init__(self) -> None:
        duration = real("duration", self.duration, above=0.0)
        n_inputs = whole("n_inputs", self.n_inputs, low=1)
        times = np.array(self.times, np.float64)
        channels = np.asarray(self.channels)
        if times.ndim != 1 or channels.shape != times.shape:
            raise ValueError(
                "times and channels must have one entry per input spike each, "
                f"got shapes {times.shape} and {channels.shape}"
            )
        if channels.size and not np.issubdtype(channels.dtype, np.integer):
            raise ValueError(f"channels must be whole numbers, got {channels.dtype} values")
        _refuse_first(
            ~((times >= 0.0) & (times <= duration)),
            times,
            f"input spikes must lie within the trial, 0 … {duration:g}",
        )
        _refuse_first(
            np.diff(times, prepend=-np.inf) < 0.0,
            times,
            "input spikes must be in order of time; sort times and channels together",
        )
        _refuse_first(
            (channels < 0) | (channels >= n_inputs),
            channels,
            f"channels must lie in 0 … {n_inputs - 1} (n_inputs = {n_inputs})",
        )
        for name, value in (
            ("times", times),
            ("channels", channels.astype(np.int64)),
            ("duration", duration),
            ("n_inputs", n_inputs),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_trial(cls, trial: Trial) -> InputSpikes:
        """The spikes of a trial, each at the beginning of its bin."""
        times = np.repeat(np.arange(trial.n_bins, dtype=np.float64), np.diff(trial.offsets))
        return cls(times, trial.channels.astype(np.int64), float(trial.n_bins), trial.n_inputs)


def _refuse_first(wrong: NDArray[np.bool_], values: NDArray[np.number], expected: str) -> None:
    if np.any(wrong):
        first = int(np.argmax(wrong))
        raise ValueError(f"{expected}; spike {first} has {values[first]:g}")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The course of a continuous neuron: float64 arrays of equal length.

    Attributes:
        t: times in bins, ascending.
        V: membrane potential; at the time of an input spike, right after it.
        R: the neuron's own reset variable; 0 throughout for η = 0, where it has no effect. Of a
            `ReactingGNM` what waits to become potential.
        S: ∫ Θ(V − ϑ_R) V dt from 0 to t.
    """

    t: NDArray[np.float64]
    V: NDArray[np.float64]
    R: NDArray[np.float64]
    S: NDArray[np.float64]


def simulate(
    neuron: ContinuousGNM,
    weights: ArrayLike,
    spikes: InputSpikes,
    at: ArrayLike | None = None,
    steps_per_bin: int = STEPS_PER_BIN,
) -> Trajectory:
    """The course of `neuron` with `weights` (N,) under `spikes`, from V = R = 0.

    It is reported at the times `at` (ascending, in 0 … duration; None: at each input spike and at
    the end). For η = 0 it is exact to rounding; else `steps_per_bin` Runge–Kutta steps or more are
    taken per bin. Raises ValueError for weights or times that do not fit.
    """
    w, times = checked_weights(weights, spikes.n_inputs), report_times(spikes, at)
    steps = whole("steps_per_bin", steps_per_bin, low=1)
    course = np.empty((3, times.size))
    walk, numbers = neuron.compiled_walk()
    jumps = w[spikes.channels]
    walk(numbers, neuron.static(), jumps, spikes.times, times, steps, course)
    return Trajectory(times, *course)


def checked_weights(weights: ArrayLike, n_inputs: int) -> NDArray[np.float64]:
    """`weights` as finite float64 (N,), or ValueError."""
    w = np.array(weights, np.float64)
    if w.shape != (n_inputs,):
        raise ValueError(f"weights must have shape ({n_inputs},), one per channel, got {w.shape}")
    if not np.isfinite(w).all():
        raise ValueError(f"weights must be finite, channel {np.argmin(np.isfinite(w))} is not")
    return w


def report_times(spikes: InputSpikes, at: ArrayLike | None) -> NDArray[np.float64]:
    """The times to report at: `at`, or each input spike once and the end; else ValueError."""
    if at is None:
        return np.unique(np.append(spikes.times, spikes.duration))
    times = np.array(at, np.float64)
    inside = (times >= 0.0) & (times <= spikes.duration)
    if times.ndim != 1 or not inside.all() or np.any(np.diff(times) < 0.0):
        raise ValueError(
            f"the times to report at must be ascending and lie in 0 … {spikes.duration:g}"
        )
    return times
