"""One neuron in somebody else's loop: a bin at a time, learning afterwards; and what it records."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.kernels.slots import WIDTH, Parameters, State, correction, learn_trial, step
from agents.kernels.trial import Block, Heard, Log, drive_at
from agents.learning.rule import Outcome
from agents.simd import full, load, pack, repeated, unpack, where


def record_template(
    mode: Any, parameters: Block, weights: Block, heard: Heard
) -> tuple[Block, NDArray[np.bool_]]:
    """V, D, R, X of one neuron in every bin, shape (4, T), and its output spikes, (T,)."""
    zero = full(0.0, WIDTH)
    n_bins = len(heard.offsets) - 1
    values = np.empty((4, n_bins))
    spikes = np.empty(n_bins, np.bool_)
    p = unpack(Parameters, parameters, zero)
    state = repeated(State, zero)
    for t in range(n_bins):
        drive = drive_at(weights, heard.channels, heard.offsets, t, zero)
        state, response = step(p, mode, state, drive)
        values[0, t] = response.V
        values[1, t] = response.D
        values[2, t] = response.R
        values[3, t] = response.X
        spikes[t] = response.spike
    return values, spikes


def hear_template(
    mode: Any,
    parameters: Block,
    weights: Block,
    state: Block,
    observation: NDArray[np.int8],
    t: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    V: Block,
    above: Block,
    spikes: NDArray[np.int64],
) -> int:
    """One bin of the standard loop: note what is heard, take the step, note what came of it.

    Returns the action, 1 for an output spike, or −1 if a buffer is too short for bin `t`.
    """
    zero = full(0.0, WIDTH)
    n_events = offsets[t]
    if t == len(V) or n_events + len(observation) > len(channels):
        return -1
    for i in range(len(observation)):
        if observation[i] != 0:
            channels[n_events] = i
            n_events += 1
    offsets[t + 1] = n_events
    p = unpack(Parameters, parameters, zero)
    drive = drive_at(weights, channels, offsets, t, zero)
    new_state, response = step(p, mode, unpack(State, state, zero), drive)
    pack(state, new_state)
    V[t, 0] = response.V
    above[t, 0] = where(response.above, 1.0, zero)
    spikes[t] = 1 if response.spike else 0
    return spikes[t]


def study_template(
    rule_mode: Any,
    rule_parameters: Block,
    sign: float,
    heard: Heard,
    label: int,
    log: Log,
    spikes: NDArray[np.int64],
    weights: Block,
    previous: Block,
) -> bool:
    """The learning step of the standard loop, from the agent's own record of the trial.

    `sign` is that of label − emitted where nothing else is known; NaN where the label and the
    occurrences are.
    Returns False if the step was called for but would have made a weight overflow.
    """
    if np.isnan(sign):
        emitted = 0
        blame = 0.0
        t = 0
        for k in range(len(heard.onsets) + 1):
            last = k == len(heard.onsets)
            stop = len(heard.offsets) - 1 if last else heard.onsets[k]
            for s in range(t, stop):
                emitted += spikes[s]
                blame += log.above[s, 0]
            if last:
                break
            t = stop + heard.pattern_bins
            count = 0
            for s in range(stop, t):
                count += spikes[s]
            emitted += count
            log.counts[k, 0] = count
            blame += 1.0 if count != heard.owed[k] else 0.0
        c = correction(Outcome(float(emitted), float(label), blame > 0.0))
    else:
        c = correction(Outcome(0.0, sign, False))
    if c == 0.0:
        return True
    eligibility = np.empty((len(weights), WIDTH))
    corrections = np.full((1, WIDTH), c)
    sound = np.empty((1, WIDTH))
    learn_trial(
        rule_parameters, rule_mode, corrections, heard, log, eligibility, weights, previous, sound
    )
    return sound[0, 0] > 0.0


def foresee_template(
    mode: Any, parameters: Block, weights: Block, states: Block, observations: NDArray[np.int8]
) -> NDArray[np.int64]:
    """Actions for one bin of n independent streams; `states` (n, rows, 1) is moved on in place."""
    zero = full(0.0, WIDTH)
    p = unpack(Parameters, parameters, zero)
    actions = np.empty(len(observations), np.int64)
    for k in range(len(observations)):
        drive = zero
        for i in range(observations.shape[1]):
            if observations[k, i] != 0:
                drive = drive + load(weights, i, zero)
        state, response = step(p, mode, unpack(State, states[k], zero), drive)
        pack(states[k], state)
        actions[k] = 1 if response.spike else 0
    return actions
