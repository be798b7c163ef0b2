"""What a rule that sees the whole trial is handed, and how it hears the trial again."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.model import Arrays
from agents.simd import repeated, unpack
from agents.training.slots import BIEXPONENTIAL, THRESHOLD, Parameters, State, advance


class Again(NamedTuple):
    """What it takes to hear a trial again."""

    parameters: NDArray[np.float64]
    """The neuron's numbers, (rows, 1)."""
    arrays: Arrays
    static: Any


class HeardTrial(NamedTuple):
    """A trial as one neuron heard it. T bins; a rule sees only what its feedback tells.

    A rule whose feedback is not "presentations" finds one segment that is the whole trial, owed 0.
    """

    V: NDArray[np.float64]
    """Membrane potential, (T,), before any reset that the bin's spike causes."""
    X: NDArray[np.float64]
    """Readout, (T,), which is compared with the threshold: V itself, but for a GNM that reads D."""
    spikes: NDArray[np.float64]
    """1 in the bins with an output spike, else 0, (T,); amounts where output is graded."""
    channels: NDArray[np.int32]
    """The input spikes of bin t are channels[offsets[t] : offsets[t + 1]]."""
    offsets: NDArray[np.int64]
    edges: NDArray[np.int64]
    """Segments, as in `gnm_env.segments`; odd ones are presentations."""
    target: NDArray[np.int64]
    counts: NDArray[np.float64]
    """Output in each segment."""
    error: float
    """By feedback: the sign of label − emitted; label − emitted; the reward; else 1. Where the rule
    weighs it, what has come of it."""
    threshold: float
    """Of the readout."""
    lag: int
    """Bins by which X is behind the potential that it shows: a lesson for X(t) is one for the V of
    bin t − lag, where y belongs; see `agents.learning.peaks.mark`."""
    slow: float
    """The presynaptic trace: slow^t, or scale·(slow^t − fast^t); see `agents.model.PSPKernel`."""
    fast: float
    scale: float
    memory: NDArray[np.float64]
    """What the rule remembers from trial to trial, a number for each field of its `memory_type`."""
    again: Again


def accumulate(trial: HeardTrial, y: NDArray[np.float64], eligibility: NDArray[np.float64]) -> bool:
    """ε_i = Σ_t x_i(t) y(t), for rules with a `change`; False if y is 0 throughout.

    `change` calls it by this name; it is compiled for each kind of presynaptic trace.
    """
    raise NotImplementedError("accumulate is for compiled rules")


def accumulate_template(
    trial: HeardTrial, y: NDArray[np.float64], eligibility: NDArray[np.float64]
) -> bool:
    """See `accumulate`."""
    for i in range(len(eligibility)):
        eligibility[i] = 0.0
    last = len(y) - 1
    while last >= 0 and y[last] == 0.0:
        last -= 1
    slow = 0.0
    fast = 0.0
    for t in range(last, -1, -1):
        slow = y[t] + trial.slow * slow
        gain = slow
        if BIEXPONENTIAL:
            fast = y[t] + trial.fast * fast
            gain = trial.scale * (slow - fast)
        for e in range(trial.offsets[t], trial.offsets[t + 1]):
            eligibility[trial.channels[e]] += gain
    return last >= 0


def replay(
    trial: HeardTrial, threshold: float, V: NDArray[np.float64], spikes: NDArray[np.float64]
) -> int:
    """Hear the trial again at another threshold, and with it another reset.

    Writes V and spikes, (T,) each; returns the number of spikes. `teach` calls it by this name; it
    is compiled for each kind of neuron.
    """
    raise NotImplementedError("replay is for compiled rules: check_rule tells how to try a rule")


def replay_template(
    trial: HeardTrial, threshold: float, V: NDArray[np.float64], spikes: NDArray[np.float64]
) -> int:
    """See `replay`."""
    parameters = trial.again.parameters.copy()
    parameters[THRESHOLD, 0] = threshold
    p = unpack(Parameters, parameters, 0.0)
    state = repeated(State, 0.0)
    count = 0
    for t in range(len(V)):
        state, response = advance(
            p, trial.again.static, trial.again.arrays, state,
            trial.channels, trial.offsets[t], trial.offsets[t + 1], 0,
        )  # fmt: skip
        V[t] = response.V
        spikes[t] = 1.0 if response.spike else 0.0
        count += response.spike
    return count
