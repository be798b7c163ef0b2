"""One model in somebody else's loop: a bin at a time, learning afterwards; and what it records."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.rule import Outcome
from agents.model import Arrays, Block
from agents.simd import full, pack, repeated, store, unpack, where
from agents.training.slots import (
    TOLD_REWARD,
    USES_ERROR,
    WEIGHS,
    WIDTH,
    Parameters,
    State,
    active,
    advance,
    correction,
    learn_trial,
    output,
    weighed,
)
from agents.training.trial import ModelBlock, RuleBlock, TrialLog, new_scratch
from gnm_env.segments import TrialArrays


class TrialSoFar(NamedTuple):
    """What an agent has heard of the present trial, and what came of it; buffers with room."""

    channels: NDArray[np.int32]
    offsets: NDArray[np.int64]
    V: Block
    above: Block
    output: Block
    readout: Block
    notes: Block


def record_template(
    model: ModelBlock, trial: TrialArrays
) -> tuple[Block, NDArray[np.float64], Block]:
    """V, D, R, X and spikes, (5, T); the output, (T,); the memory after each bin, (T, rows)."""
    zero = full(0.0, WIDTH)
    n_bins = len(trial.offsets) - 1
    values = np.empty((5, n_bins))
    given = np.empty(n_bins)
    memory = np.empty((n_bins, len(model.arrays.memory)))
    p = unpack(Parameters, model.parameters, zero)
    state = repeated(State, zero)
    for t in range(n_bins):
        state, response = advance(
            p, model.static, model.arrays, state,
            trial.channels, trial.offsets[t], trial.offsets[t + 1], 0,
        )  # fmt: skip
        values[0, t] = response.V
        values[1, t] = response.D
        values[2, t] = response.R
        values[3, t] = response.X
        values[4, t] = where(response.spike, 1.0, zero)
        given[t] = output(response, zero)
        for row in range(len(model.arrays.memory)):
            memory[t, row] = model.arrays.memory[row, 0]
    return values, given, memory


def step_template(
    observation: NDArray[np.int8],
    t: int,
    state: Block,
    static: tuple[int, ...],
    n_notes: int,
    parameters: Block,
    weights: Block,
    memory: Block,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    V: Block,
    above: Block,
    outputs: Block,
    readout: Block,
    notes: Block,
) -> float:
    """One bin of the standard loop: note what is heard, take the step, note what came of it.

    Every array by itself, the last seven those of `TrialSoFar`: to take tuples of arrays apart on
    the way from Python would cost twice as much as all the rest. Returns the output, or −1 if a
    buffer is too short for bin `t`.
    """
    zero = full(0.0, WIDTH)
    n_events = offsets[t]
    if t == len(V) or n_events + len(observation) > len(channels):
        return -1.0
    for i in range(len(observation)):
        if observation[i] != 0:
            channels[n_events] = i
            n_events += 1
    offsets[t + 1] = n_events
    new_state, response = advance(
        unpack(Parameters, parameters, zero), static, Arrays(weights, memory, notes),
        unpack(State, state, zero), channels, offsets[t], n_events, t * n_notes,
    )  # fmt: skip
    pack(state, new_state)
    out = output(response, zero)
    store(V, t, response.V)
    store(above, t, where(active(response), 1.0, zero))
    store(outputs, t, out)
    store(readout, t, response.X)
    return out


def update_template(
    rule: RuleBlock,
    model: ModelBlock,
    trial: TrialArrays,
    heard: TrialSoFar,
    told: float,
    label: float,
    rate: float,
) -> int:
    """The learning step of the standard loop, from the agent's own record of the trial.

    `told` is the sign of label − emitted, or the reward, where that is all that the agent may know;
    NaN where the label and the segments are known. Returns −1 if the step would have made a weight
    overflow, 0 if the trial taught nothing, else 1.
    """
    counts = np.empty((len(trial.target), WIDTH))
    log = TrialLog(heard.V, heard.above, heard.output, heard.readout, counts)
    in_noise = 0.0
    in_presentations = 0.0
    blame = 0.0
    for segment in range(len(trial.target)):
        given = 0.0
        above = 0.0
        for t in range(trial.edges[segment], trial.edges[segment + 1]):
            given += heard.output[t, 0]
            above += heard.above[t, 0]
        counts[segment, 0] = given
        if segment % 2 == 0:
            in_noise += given
            blame += above if USES_ERROR else given
        else:
            in_presentations += given
            blame += 0.0 if given == trial.target[segment] else 1.0
    if np.isnan(told):
        c = correction(Outcome(in_noise + in_presentations, label, blame > 0.0))
    else:
        c = told
    if WEIGHS and c != 0.0:
        c = weighed(rule, c + 1.0 if TOLD_REWARD else c, True)
    if c == 0.0:
        return 0
    scratch = new_scratch(len(model.arrays.weights), WIDTH)
    scratch.corrections[0, 0] = c
    scratch.rates[0, 0] = rate
    arrays = Arrays(model.arrays.weights, model.arrays.memory, heard.notes)
    block = ModelBlock(model.parameters, arrays, model.static, model.n_notes)
    learn_trial(rule, block, trial, log, scratch)
    if scratch.corrections[0, 0] == 0.0:
        return 0
    return 1 if scratch.finite[0, 0] > 0.0 else -1


def predict_template(
    model: ModelBlock, n_state: int, states: Block, observations: NDArray[np.int8]
) -> NDArray[np.float64]:
    """Outputs for one bin of n independent streams.

    `states` (n, rows, 1) holds the state, in `n_state` rows, and below it the memory; it is moved
    on in place.
    """
    zero = full(0.0, WIDTH)
    p = unpack(Parameters, model.parameters, zero)
    notes = np.empty((model.n_notes, WIDTH))
    channels = np.empty(observations.shape[1], np.int32)
    outputs = np.empty(len(observations))
    for k in range(len(observations)):
        n_events = 0
        for i in range(observations.shape[1]):
            if observations[k, i] != 0:
                channels[n_events] = i
                n_events += 1
        arrays = Arrays(model.arrays.weights, states[k, n_state:], notes)
        state, response = advance(
            p, model.static, arrays, unpack(State, states[k], zero), channels, 0, n_events, 0
        )
        pack(states[k], state)
        outputs[k] = output(response, zero)
    return outputs
