"""Δw before momentum and bounds, in three ways: by y(t) bin by bin, by a whole trial, by gradient.

ε_i = Σ_t x_i(t) y(t) is summed backward: g(t) = Σ_{s>=t} slow^(s−t) y(s) is what an input spike at
t adds to the ε of its channel. Bins descend, channels ascend within a bin, so that every path has
the same bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.error_trace import error_at
from agents.learning.rule import BinOfTrial, RuleParameters
from agents.learning.teaching import Again, HeardTrial
from agents.model import Arrays, Block
from agents.simd import any_lane, full, load, store, unpack, where
from agents.training.slots import (
    BIEXPONENTIAL,
    BY_BIN,
    LAG,
    LEARN_WIDTH,
    READS_V,
    SEES_PRESENTATIONS,
    THRESHOLD,
    TOLD_REWARD,
    USES_ERROR,
    USES_OUTPUT,
    WEIGHS,
    WIDTH,
    OwnNumbers,
    accumulate,
    bin_signal,
    epsilon,
    learn_alone,
    side_by_side,
    teach,
    teaching_signal,
    weight_change,
)
from agents.training.trial import N_COMMON, ModelBlock, RuleBlock, Scratch, TrialLog, rate_of
from gnm_env.segments import TrialArrays


def pointwise_change_template(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """The change by a rule whose y(t) follows from what happens in bin t."""
    for first in range(0, WIDTH, LEARN_WIDTH):
        part = slice(first, first + LEARN_WIDTH)
        zero = full(0.0, LEARN_WIDTH)
        c = load(scratch.corrections[:, part], 0, zero)
        if any_lane(c != 0.0):
            p = unpack(RuleParameters, rule.parameters[:, part], zero)
            p = rate_of(p, scratch.rates[:, part])
            change = scratch.change[:, part]
            log_part = TrialLog(
                log.V[:, part], log.above[:, part], log.output[:, part], log.readout[:, part],
                log.counts[:, part],
            )  # fmt: skip
            threshold = zero
            if BY_BIN:
                threshold = load(model.parameters[:, part], THRESHOLD, zero)
            taught = sum_eligibility(
                p, rule.parameters[N_COMMON:, part], rule.static, threshold, c, trial, log_part,
                change,
            )  # fmt: skip
            if BY_BIN:
                c = where(taught, c, zero)
                store(scratch.corrections[:, part], 0, c)
            weight_change(p, rule.static, c, change)


sum_eligibility: Any = None  # bound to the template below


def bin_signal_template(own: Any, static: Any, bin_: BinOfTrial) -> Any:
    """The y(t) of a rule that needs no more than V and E, or of one that needs more."""
    if BY_BIN:
        return bin_signal(own, bin_)
    return teaching_signal(static, bin_.V, bin_.E)


def sum_eligibility_template(
    p: RuleParameters,
    own_parameters: Block,
    static: Any,
    threshold: Any,
    c: Any,
    trial: TrialArrays,
    log: TrialLog,
    eligibility: Block,
) -> Any:
    """ε_i = Σ_t x_i(t) y(t) for LEARN_WIDTH neurons side by side.

    What a rule says of the readout in bin t is said of the potential of bin t − LAG. Returns in
    which lanes y is not 0 throughout, asked of rules with a `bin_signal` only.
    """
    zero = full(0.0, LEARN_WIDTH)
    own = unpack(OwnNumbers, own_parameters, zero)
    for i in range(len(eligibility)):
        store(eligibility, i, zero)
    slow = zero
    fast = zero
    coming = zero
    E = zero if USES_ERROR else c
    taught = zero != zero
    for segment in range(len(trial.target) - 1, -1, -1):
        for t in range(trial.edges[segment + 1] - 1, trial.edges[segment] - 1, -1):
            if USES_ERROR:
                E = error_at(trial.target, log.counts, log.above, segment, t, zero)
            V = load(log.V, t, zero)
            X = V if READS_V else load(log.readout, t, zero)
            z = load(log.output, t, zero) if USES_OUTPUT else zero
            y = bin_signal(own, static, BinOfTrial(V, X, E, z, threshold))
            if LAG == 1:
                y, coming = coming, y
            if BY_BIN:
                taught = taught | (y != 0.0)
            slow = y + p.slow * slow
            gain = slow
            if BIEXPONENTIAL:
                fast = y + p.fast * fast
                gain = p.scale * (slow - fast)
            for e in range(trial.offsets[t], trial.offsets[t + 1]):
                # Unsigned: signed indices count from the end as well, and numba pays for looking.
                channel = trial.channels[np.uint64(e)]
                store(eligibility, channel, load(eligibility, channel, zero) + gain)
    return taught


def side_by_side_template(
    p: RuleParameters,
    own_parameters: Block,
    static: Any,
    threshold: Any,
    c: Any,
    trial: TrialArrays,
    log: TrialLog,
    eligibility: Block,
) -> Any:
    """As `sum_eligibility`, where the rule does it itself."""
    return side_by_side(unpack(OwnNumbers, own_parameters, c), c, trial, log, eligibility)


def taught_change_template(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """The change by a rule that sees the whole trial: one neuron after the other."""
    n_bins = trial.edges[len(trial.edges) - 1]
    edges, target = trial.edges, trial.target
    total = np.empty((1, 2))[:, 0]
    if not SEES_PRESENTATIONS:
        edges = np.array([0, n_bins])
        target = np.zeros(1, np.int64)
    for lane in range(WIDTH):
        if scratch.corrections[0, lane] != 0.0:
            V = log.V[:n_bins, lane]
            counts = log.counts[: len(trial.target), lane]
            if not SEES_PRESENTATIONS:
                total[0] = counts.sum()
                counts = total
            one = slice(lane, lane + 1)
            again = Again(
                model.parameters[:, one],
                Arrays(model.arrays.weights[:, one], np.empty((0, 1)), np.empty((0, 1))),
                model.static,
            )
            common = unpack(RuleParameters, rule.parameters[:, one], 0.0)
            error = scratch.corrections[0, lane]
            if TOLD_REWARD and not WEIGHS:
                error += 1.0
            heard = HeardTrial(
                V, V if READS_V else log.readout[:n_bins, lane], log.output[:n_bins, lane],
                trial.channels, trial.offsets, edges, target, counts, error,
                model.parameters[THRESHOLD, lane], LAG, common.slow, common.fast, common.scale,
                rule.memory[:, lane], again,
            )  # fmt: skip
            change = scratch.change[:, lane]
            if learn_alone(rule.parameters[N_COMMON:, one], heard, change):
                rate = scratch.rates[0, lane]
                for i in range(len(change)):
                    change[i] = rate * change[i]
            else:
                scratch.corrections[0, lane] = 0.0


def learn_alone_template(
    own_parameters: NDArray[np.float64], heard: HeardTrial, eligibility: NDArray[np.float64]
) -> bool:
    """ε of one neuron by a rule that sees the whole trial; False if there is nothing to learn.

    One function for any number of neurons side by side, so that they have the same bits and are
    compiled once.
    """
    return epsilon(unpack(OwnNumbers, own_parameters, 0.0), heard, eligibility)


def epsilon_template(p: Any, heard: HeardTrial, eligibility: NDArray[np.float64]) -> bool:
    """ε_i = Σ_t x_i(t) y(t) by a rule's `teach`; False if y is 0 throughout."""
    y = np.zeros(len(heard.V))
    teach(p, heard, y)
    return accumulate(heard, y, eligibility)
