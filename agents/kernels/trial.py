"""One trial in compiled code: what is heard, what the neurons do, what they learn from it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.kernels.slots import (
    DOUBLE_TRACE,
    LEARN_WIDTH,
    USES_ERROR,
    WIDTH,
    State,
    run_bins,
    step,
    sum_eligibility,
    teaching_signal,
    weight_change,
)
from agents.learning.momentum import apply_change
from agents.learning.rule import Outcome, RuleParameters
from agents.simd import any_lane, full, load, repeated, store, unpack, where
from gnm_env.compiled import compiled

Block = NDArray[np.float64]
"""WIDTH neurons side by side: (rows, WIDTH); of many blocks, (blocks, rows, WIDTH)."""


class Heard(NamedTuple):
    """One trial as compiled code takes it. See `gnm_env.trial.Trial`."""

    channels: NDArray[np.int32]
    offsets: NDArray[np.int64]
    onsets: NDArray[np.int64]
    owed: NDArray[np.int64]
    pattern_bins: int


class Log(NamedTuple):
    """What a trial leaves for learning: rows are bins, or occurrences for `counts`."""

    V: Block
    above: Block
    """1 where the readout is at or above the threshold; kept only for rules that use the error."""
    counts: Block
    """Output spikes in each occurrence."""


@compiled
def drive_at(
    weights: Block, channels: NDArray[np.int32], offsets: NDArray[np.int64], t: int, zero: Any
) -> Any:
    """I(t) = Σ_i w_i s_i(t), summed from 0 over ascending channels."""
    drive = zero
    for e in range(offsets[t], offsets[t + 1]):
        drive = drive + load(weights, channels[e], zero)
    return drive


def run_bins_template(
    p: Any, mode: Any, state: Any, weights: Block, heard: Heard, start: int, stop: int, log: Log
) -> Any:
    """Bins start … stop − 1: the new state, the output spikes, and the bins above threshold."""
    zero = full(0.0, WIDTH)
    spikes = zero
    bins_above = zero
    for t in range(start, stop):
        drive = drive_at(weights, heard.channels, heard.offsets, t, zero)
        state, response = step(p, mode, state, drive)
        spikes = spikes + where(response.spike, 1.0, zero)
        store(log.V, t, response.V)
        if USES_ERROR:
            above = where(response.above, 1.0, zero)
            bins_above = bins_above + above
            store(log.above, t, above)
    return state, spikes, bins_above


def run_trial_template(p: Any, mode: Any, weights: Block, heard: Heard, log: Log) -> Any:
    """A whole trial without learning. Fills `log`; returns its Outcome and the spikes in noise."""
    zero = full(0.0, WIDTH)
    state = repeated(State, zero)
    in_noise = zero
    in_patterns = zero
    blame = zero
    owed = 0
    t = 0
    k = 0
    onsets, n_bins = heard.onsets, len(heard.offsets) - 1
    # One way out of the loop: with a second one numba counts references to all arrays in here, for
    # as long as twenty bins take.
    last = False
    while not last:
        last = k == len(onsets)
        stop = n_bins if last else onsets[k]
        state, spikes, bins_above = run_bins(p, mode, state, weights, heard, t, stop, log)
        in_noise = in_noise + spikes
        blame = blame + bins_above
        if not last:
            t = stop + heard.pattern_bins
            state, spikes, _ = run_bins(p, mode, state, weights, heard, stop, t, log)
            in_patterns = in_patterns + spikes
            blame = blame + where(spikes == heard.owed[k], zero, 1.0)
            store(log.counts, k, spikes)
            owed += heard.owed[k]
            k += 1
    return Outcome(in_noise + in_patterns, full(float(owed), WIDTH), blame > 0.0), in_noise


def learn_trial_template(
    rule_parameters: Block,
    mode: Any,
    corrections: Block,
    heard: Heard,
    log: Log,
    eligibility: Block,
    weights: Block,
    previous: Block,
    sound: Block,
) -> None:
    """The learning step after a trial, in the lanes whose correction is not 0.

    Works through the block in pieces of LEARN_WIDTH lanes and leaves out those with nothing to
    learn. Sets `sound` (1, WIDTH), in lanes whose correction is not 0, to 0 where a weight would
    have overflowed, else to 1.
    """
    for first in range(0, WIDTH, LEARN_WIDTH):
        part = slice(first, first + LEARN_WIDTH)
        zero = full(0.0, LEARN_WIDTH)
        c = load(corrections[:, part], 0, zero)
        if any_lane(c != 0.0):
            p = unpack(RuleParameters, rule_parameters[:, part], zero)
            part_log = Log(log.V[:, part], log.above[:, part], log.counts[:, part])
            part_eligibility = eligibility[:, part]
            sum_eligibility(p, mode, heard, part_log, part_eligibility)
            weight_change(p, mode, c, part_eligibility)
            taken = apply_change(p, c != 0.0, part_eligibility, weights[:, part], previous[:, part])
            store(sound[:, part], 0, where(taken, 1.0, zero))


def sum_eligibility_template(
    p: RuleParameters, mode: Any, heard: Heard, log: Log, eligibility: Block
) -> None:
    """ε_i = Σ_t x_i(t) y(t), with the presynaptic trace x_i and the rule's teaching signal y.

    Summed backward: g(t) = Σ_{s>=t} slow^(s−t) y(s) is what a spike at t adds to its channel's ε.
    """
    zero = full(0.0, LEARN_WIDTH)
    for i in range(len(eligibility)):
        store(eligibility, i, zero)
    slow = zero
    fast = zero
    E = zero
    k = len(heard.onsets) - 1
    for t in range(len(heard.offsets) - 2, -1, -1):
        if USES_ERROR:
            if k >= 0 and t < heard.onsets[k]:
                k -= 1
            if k >= 0 and t < heard.onsets[k] + heard.pattern_bins:
                E = float(heard.owed[k]) - load(log.counts, k, zero)
            else:
                E = zero - load(log.above, t, zero)
        y = teaching_signal(mode, load(log.V, t, zero), E)
        slow = y + p.slow * slow
        gain = slow
        if DOUBLE_TRACE:
            fast = y + p.fast * fast
            gain = p.scale * (slow - fast)
        for e in range(heard.offsets[t], heard.offsets[t + 1]):
            channel = heard.channels[e]
            store(eligibility, channel, load(eligibility, channel, zero) + gain)
