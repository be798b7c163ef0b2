"""One trial in compiled code: what the models do, and what they learn from it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.momentum import apply_change
from agents.learning.rule import Outcome, RuleParameters
from agents.model import Arrays, Block
from agents.simd import any_lane, full, load, pack, repeated, store, unpack, where
from agents.training.slots import (
    LEARN_WIDTH,
    USES_ERROR,
    USES_OUTPUT,
    USES_READOUT,
    WIDTH,
    Memory,
    OwnNumbers,
    State,
    active,
    advance,
    compute_change,
    output,
    run_bins,
    weigh,
)
from gnm_env.compiled import inlined
from gnm_env.segments import TrialArrays

N_COMMON = len(RuleParameters._fields)
"""Rows of the parameters that all rules have; a rule's own follow."""


class TrialLog(NamedTuple):
    """What a trial leaves for learning: rows are bins, or segments for `counts`."""

    V: Block
    above: Block
    """1 where the readout is at or above the threshold; kept only for rules that use the error."""
    output: Block
    """Output of each bin; kept only for rules that use it."""
    readout: Block
    """X of each bin, kept only for rules that use it, where it is not V itself; or, for rules that
    draw spikes, the probability of one less the spike."""
    counts: Block
    """Output in each segment."""


class ModelBlock(NamedTuple):
    """A block of models."""

    parameters: Block
    arrays: Arrays
    static: tuple[int, ...]
    n_notes: int


class RuleBlock(NamedTuple):
    """What a block of models learns by."""

    parameters: Block
    velocity: Block
    static: tuple[int, ...]
    memory: Block
    """What the rule remembers from trial to trial, (numbers, WIDTH)."""


class Scratch(NamedTuple):
    """Room that the learning step uses."""

    change: Block
    """Δ (weights, WIDTH)."""
    corrections: Block
    """(1, WIDTH); 0 in the lanes that the trial teaches nothing."""
    finite: Block
    """(1, WIDTH); 0 in the lanes in which a weight would have overflowed."""
    rates: Block
    """(1, WIDTH), learning rates."""


@inlined
def spikes_of(response: Any, zero: Any) -> Any:
    """The output of a bin: a spike or none."""
    return where(response.spike, 1.0, zero)


@inlined
def is_above(response: Any) -> Any:
    """Whether the readout is at or above the threshold."""
    return response.above


@inlined
def amount_of(response: Any, zero: Any) -> Any:
    """The output of a bin: an amount."""
    return response.S


@inlined
def gives_any(response: Any) -> Any:
    """Whether a bin gives any output; it takes the place of being above the threshold."""
    return response.S > 0.0


def run_bins_template(
    p: Any,
    model: ModelBlock,
    state: Any,
    trial: TrialArrays,
    start: int,
    stop: int,
    log: TrialLog,
) -> Any:
    """Bins start … stop − 1: the new state, the output, and the bins above the threshold."""
    zero = full(0.0, WIDTH)
    total = zero
    bins_above = zero
    first = trial.offsets[start]
    for t in range(start, stop):
        last = trial.offsets[np.uint64(t + 1)]
        state, response = advance(
            p, model.static, model.arrays, state, trial.channels, first, last, t * model.n_notes
        )
        first = last
        out = output(response, zero)
        total = total + out
        store(log.V, t, response.V)
        if USES_ERROR:
            above = where(active(response), 1.0, zero)
            bins_above = bins_above + above
            store(log.above, t, above)
        if USES_OUTPUT:
            store(log.output, t, out)
        if USES_READOUT:
            store(log.readout, t, response.X)
    return state, total, bins_above


def run_trial_template(p: Any, model: ModelBlock, trial: TrialArrays, log: TrialLog) -> Any:
    """A whole trial without learning. Fills `log`; returns its Outcome and the output in noise."""
    zero = full(0.0, WIDTH)
    state = repeated(State, zero)
    for row in range(len(model.arrays.memory)):
        store(model.arrays.memory, row, zero)
    in_noise = zero
    in_presentations = zero
    blame = zero
    owed = 0
    for segment in range(len(trial.target)):
        state, given, bins_above = run_bins(
            p, model, state, trial, trial.edges[segment], trial.edges[segment + 1], log
        )
        store(log.counts, segment, given)
        if segment % 2 == 0:
            in_noise = in_noise + given
            blame = blame + (bins_above if USES_ERROR else given)
        else:
            in_presentations = in_presentations + given
            blame = blame + where(given == trial.target[segment], zero, 1.0)
        owed += trial.target[segment]
    emitted = in_noise + in_presentations
    return Outcome(emitted, full(float(owed), WIDTH), blame > 0.0), in_noise


def weighed_template(rule: RuleBlock, told: Any, learns: Any) -> Any:
    """The correction that the rule makes of what it is told, in the lanes that learn; 0 in others.

    Moves the rule's memory on in these lanes.
    """
    zero = full(0.0, WIDTH)
    own = unpack(OwnNumbers, rule.parameters[N_COMMON:], zero)
    c, memory = weigh(own, told, unpack(Memory, rule.memory, zero))
    moved = np.empty_like(rule.memory)
    pack(moved, memory)
    for row in range(len(moved)):
        old = load(rule.memory, row, zero)
        store(rule.memory, row, where(learns, load(moved, row, zero), old))
    return where(learns, c, zero)


def learn_trial_template(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """The learning step after a trial, in the lanes whose correction is not 0.

    Works through the block in parts of LEARN_WIDTH lanes and leaves out those with nothing to
    learn. Sets scratch.finite, in lanes whose correction is not 0, to 0 where a weight would have
    overflowed, else to 1.
    """
    compute_change(rule, model, trial, log, scratch)
    for first in range(0, WIDTH, LEARN_WIDTH):
        part = slice(first, first + LEARN_WIDTH)
        zero = full(0.0, LEARN_WIDTH)
        c = load(scratch.corrections[:, part], 0, zero)
        if any_lane(c != 0.0):
            p = unpack(RuleParameters, rule.parameters[:, part], zero)
            finite = apply_change(
                p,
                c != 0.0,
                scratch.change[:, part],
                model.arrays.weights[:, part],
                rule.velocity[:, part],
            )
            store(scratch.finite[:, part], 0, where(finite, 1.0, zero))


@inlined
def new_scratch(n_weights: int, width: int) -> Scratch:
    """Room for the learning step of a block."""
    return Scratch(
        np.zeros((n_weights, width)),
        np.zeros((1, width)),
        np.full((1, width), 1.0),
        np.zeros((1, width)),
    )


@inlined
def rate_of(p: RuleParameters, rates: NDArray[np.float64]) -> RuleParameters:
    """`p` with the learning rates of the present trial."""
    rate = load(rates, 0, p.learning_rate)
    return RuleParameters(
        rate, p.momentum, p.lowest, p.highest, p.slow, p.fast, p.scale, p.decay,
        p.average_first, p.average_last,
    )  # fmt: skip
