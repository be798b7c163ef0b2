"""Δw before momentum and bounds, in three ways: by y(t) of V and E, by a whole trial, by gradient.

ε_i = Σ_t x_i(t) y(t) is summed backward: g(t) = Σ_{s>=t} slow^(s−t) y(s) is what an input spike at
t adds to the ε of its channel. Bins descend, channels ascend within a bin, so that every path has
the same bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.error_trace import error_at
from agents.learning.rule import RuleParameters
from agents.learning.teaching import Again, HeardTrial
from agents.model import Arrays
from agents.simd import any_lane, full, load, store, unpack
from agents.training.slots import (
    BIEXPONENTIAL,
    LEARN_WIDTH,
    SEES_PRESENTATIONS,
    THRESHOLD,
    USES_ERROR,
    WIDTH,
    OwnNumbers,
    epsilon,
    learn_alone,
    teach,
    teaching_signal,
    weight_change,
)
from agents.training.trial import ModelBlock, RuleBlock, Scratch, TrialLog, rate_of
from gnm_env.compiled import inlined
from gnm_env.segments import TrialArrays

N_COMMON = len(RuleParameters._fields)
"""Rows of the parameters that all rules have; a rule's own follow."""


def pointwise_change_template(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """The change by a rule whose y(t) follows from V(t) and E(t) of the same bin."""
    for first in range(0, WIDTH, LEARN_WIDTH):
        part = slice(first, first + LEARN_WIDTH)
        zero = full(0.0, LEARN_WIDTH)
        c = load(scratch.corrections[:, part], 0, zero)
        if any_lane(c != 0.0):
            p = unpack(RuleParameters, rule.parameters[:, part], zero)
            p = rate_of(p, scratch.rates[:, part])
            change = scratch.change[:, part]
            sum_eligibility(
                p, rule.static, trial, log.V[:, part], log.above[:, part], log.counts[:, part],
                change,
            )  # fmt: skip
            weight_change(p, rule.static, c, change)


sum_eligibility: Any = None  # bound to the template below


def sum_eligibility_template(
    p: RuleParameters,
    static: Any,
    trial: TrialArrays,
    V: NDArray[np.float64],
    above: NDArray[np.float64],
    counts: NDArray[np.float64],
    eligibility: NDArray[np.float64],
) -> None:
    """ε_i = Σ_t x_i(t) y(t) for LEARN_WIDTH neurons side by side."""
    zero = full(0.0, LEARN_WIDTH)
    for i in range(len(eligibility)):
        store(eligibility, i, zero)
    slow = zero
    fast = zero
    E = zero
    for segment in range(len(trial.target) - 1, -1, -1):
        for t in range(trial.edges[segment + 1] - 1, trial.edges[segment] - 1, -1):
            if USES_ERROR:
                E = error_at(trial.target, counts, above, segment, t, zero)
            y = teaching_signal(static, load(V, t, zero), E)
            slow = y + p.slow * slow
            gain = slow
            if BIEXPONENTIAL:
                fast = y + p.fast * fast
                gain = p.scale * (slow - fast)
            for e in range(trial.offsets[t], trial.offsets[t + 1]):
                channel = trial.channels[e]
                store(eligibility, channel, load(eligibility, channel, zero) + gain)


def taught_change_template(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """The change by a rule that sees the whole trial: one neuron after the other."""
    n_bins = trial.edges[len(trial.edges) - 1]
    for lane in range(WIDTH):
        error = scratch.corrections[0, lane]
        if error != 0.0:
            V = np.empty(n_bins)
            given = np.empty(n_bins)
            for t in range(n_bins):
                V[t] = log.V[t, lane]
                given[t] = log.output[t, lane]
            counts = np.empty(len(trial.target))
            for segment in range(len(trial.target)):
                counts[segment] = log.counts[segment, lane]
            taught = learn_alone(
                _column(rule.parameters, lane),
                _column(model.parameters, lane),
                _column(model.arrays.weights, lane),
                model.static, scratch.rates[0, lane], error, trial, V, given, counts,
                scratch.change[:, lane],
            )  # fmt: skip
            if not taught:
                scratch.corrections[0, lane] = 0.0


@inlined
def _column(block: NDArray[np.float64], lane: int) -> NDArray[np.float64]:
    """Column `lane` of a block, as a block of one, (rows, 1)."""
    column = np.empty((len(block), 1))
    for row in range(len(block)):
        column[row, 0] = block[row, lane]
    return column


def learn_alone_template(
    rule_parameters: NDArray[np.float64],
    parameters: NDArray[np.float64],
    weights: NDArray[np.float64],
    static: Any,
    rate: float,
    error: float,
    trial: TrialArrays,
    V: NDArray[np.float64],
    given: NDArray[np.float64],
    counts: NDArray[np.float64],
    change: NDArray[np.float64],
) -> bool:
    """What a trial teaches one neuron by a rule that sees all of it: writes λ·ε into `change`.

    Returns False if that is nothing. One function for any number of neurons side by side, so that
    they have the same bits and are compiled once.
    """
    p = unpack(OwnNumbers, rule_parameters[N_COMMON:], 0.0)
    common = unpack(RuleParameters, rule_parameters, 0.0)
    edges, target = trial.edges, trial.target
    if not SEES_PRESENTATIONS:
        edges = np.array([0, len(V)])
        target = np.zeros(1, np.int64)
        counts = np.array([counts.sum()])
    again = Again(parameters, Arrays(weights, np.empty((0, 1)), np.empty((0, 1))), static)
    heard = HeardTrial(
        V, given, trial.channels, trial.offsets, edges, target, counts, error,
        parameters[THRESHOLD, 0], common.slow, common.fast, common.scale, again,
    )  # fmt: skip
    if not epsilon(p, heard, change):
        return False
    for i in range(len(change)):
        change[i] = rate * change[i]
    return True


def epsilon_template(p: Any, heard: HeardTrial, eligibility: NDArray[np.float64]) -> bool:
    """ε_i = Σ_t x_i(t) y(t) by a rule's `teach`; False if y is 0 throughout."""
    y = np.zeros(len(heard.V))
    teach(p, heard, y)
    last = len(y) - 1
    while last >= 0 and y[last] == 0.0:
        last -= 1
    if last < 0:
        return False
    for i in range(len(eligibility)):
        eligibility[i] = 0.0
    slow = 0.0
    fast = 0.0
    for t in range(last, -1, -1):
        slow = y[t] + heard.slow * slow
        gain = slow
        if BIEXPONENTIAL:
            fast = y[t] + heard.fast * fast
            gain = heard.scale * (slow - fast)
        for e in range(heard.offsets[t], heard.offsets[t + 1]):
            eligibility[heard.channels[e]] += gain
    return True
