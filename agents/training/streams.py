"""Many models on one stream: training, noisy performance, responses per class."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.learning.averaging import average
from agents.learning.rule import RuleParameters
from agents.model import Arrays, Block
from agents.simd import any_lane, full, load, pack, store, unpack, where
from agents.training.slots import (
    AVERAGES,
    EXPLORES,
    TOLD_REWARD,
    USES_ERROR,
    USES_OUTPUT,
    USES_READOUT,
    WEIGHS,
    WIDTH,
    Parameters,
    State,
    advance,
    correction,
    explore_trial,
    learn_trial,
    output,
    run_trial,
    weighed,
)
from agents.training.trial import ModelBlock, RuleBlock, TrialLog, new_scratch
from gnm_env.batches import Batch, trial_of
from gnm_env.compiled import inlined
from gnm_env.rules import compiled_too_few as too_few
from gnm_env.rules import compiled_too_many as too_many
from gnm_env.sampling import append_piece
from gnm_env.task import TaskArrays

MOST_SPIKES = 10
"""Responses are counted up to this many spikes per presentation; the last count means "or more"."""

WRONG_BEYOND = 0.5
"""A trial is answered wrongly if its sum is further than this from the label."""


class Models(NamedTuple):
    """All blocks of models."""

    parameters: Block
    """(blocks, rows, WIDTH)"""
    weights: Block
    """(blocks, weights, WIDTH)"""
    static: tuple[int, ...]
    n_state: int
    n_memory: int
    n_notes: int


class Learning(NamedTuple):
    """What all blocks learn by."""

    parameters: Block
    """(blocks, rows, WIDTH)"""
    velocity: Block
    """(blocks, weights, WIDTH)"""
    overflow: Block
    """(blocks, 1, WIDTH); the trial in which a weight would have overflowed, or −1."""
    heard: Block
    """(blocks, 1, WIDTH); trials that each model had heard before."""
    memory: Block
    """(blocks, numbers, WIDTH); what the rule remembers from trial to trial."""
    weight_sum: Block
    """(blocks, weights, WIDTH) for rules that average, else (blocks, 0, WIDTH)."""
    generators: NDArray[np.uint64]
    """(blocks, 4, WIDTH); see `agents.training.exploration`."""
    static: tuple[int, ...]


@inlined
def block_of(models: Models, block: int, memory: Block, notes: Block) -> ModelBlock:
    """Block `block` of the models."""
    arrays = Arrays(models.weights[block], memory, notes)
    return ModelBlock(models.parameters[block], arrays, models.static, models.n_notes)


def new_log_template(bins: int, segments: int) -> TrialLog:
    """Room for what trials of so many bins and segments leave for learning."""
    return TrialLog(
        np.empty((bins, WIDTH)),
        np.empty((bins if USES_ERROR else 0, WIDTH)),
        np.empty((bins if USES_OUTPUT else 0, WIDTH)),
        np.empty((bins if USES_READOUT else 0, WIDTH)),
        np.empty((segments, WIDTH)),
    )


new_log: Any = None  # bound to the template above


def train_template(
    batch: Batch,
    drawn: int,
    longest: int,
    models: Models,
    learning: Learning,
    first_trial: int,
    wrong: Block,
    absolute: Block,
) -> None:
    """Every model of every block hears and learns the `drawn` trials of `batch`, one by one.

    `longest` is the length of the longest in bins, `first_trial` the number of the first. Adds the
    number of trials answered wrongly and Σ |label − emitted|, (blocks, 1, WIDTH) each.
    """
    zero = full(0.0, WIDTH)
    memory = np.zeros((models.n_memory, WIDTH))
    scratch = new_scratch(models.weights.shape[1], WIDTH)
    notes = np.empty((longest * models.n_notes, WIDTH))
    log = new_log(longest, batch.edges.size)
    for block in range(len(models.weights)):
        p = unpack(Parameters, models.parameters[block], zero)
        # Out of the inner loop, where a view of an array costs as much as some bins.
        model = block_of(models, block, memory, notes)
        rule = RuleBlock(
            learning.parameters[block], learning.velocity[block], learning.static,
            learning.memory[block],
        )  # fmt: skip
        decay = unpack(RuleParameters, learning.parameters[block], zero).decay
        rate = unpack(RuleParameters, learning.parameters[block], zero).learning_rate
        heard = load(learning.heard[block], 0, zero) + float(first_trial)
        overflowed_in = load(learning.overflow[block], 0, zero)
        n_wrong = load(wrong[block], 0, zero)
        total_error = load(absolute[block], 0, zero)
        for k in range(drawn):
            trial = trial_of(batch, k)
            outcome, _ = run_trial(p, model, trial, log)
            if EXPLORES:
                outcome = explore_trial(rule, model, trial, log, learning.generators[block])
            error = outcome.label - outcome.emitted
            error = where(error < 0.0, zero - error, error)
            n_wrong = n_wrong + where(error > WRONG_BEYOND, 1.0, zero)
            total_error = total_error + error
            # What is not finite stays so: the last bin tells for all.
            V = load(log.V, trial.edges[len(trial.edges) - 1] - 1, zero)
            diverged = (overflowed_in < 0.0) & (V * 0.0 != 0.0)
            overflowed_in = where(diverged, float(first_trial + k), overflowed_in)
            c = where(overflowed_in < 0.0, correction(outcome), zero)
            if WEIGHS and any_lane(c != 0.0):
                c = weighed(rule, c + 1.0 if TOLD_REWARD else c, c != 0.0)
            if any_lane(c != 0.0):
                store(scratch.corrections, 0, c)
                left = 1.0 - (heard + float(k)) * decay
                store(scratch.rates, 0, rate * where(left > 0.0, left, zero))
                learn_trial(rule, model, trial, log, scratch)
                taught = load(scratch.corrections, 0, zero) != 0.0
                failed = taught & (load(scratch.finite, 0, zero) == 0.0)
                overflowed_in = where(failed, float(first_trial + k), overflowed_in)
            if AVERAGES:
                number = where(overflowed_in < 0.0, heard + float(k + 1), zero)
                shared = unpack(RuleParameters, learning.parameters[block], zero)
                average(shared, number, model.arrays.weights, learning.weight_sum[block])
        store(learning.overflow[block], 0, overflowed_in)
        store(wrong[block], 0, n_wrong)
        store(absolute[block], 0, total_error)


def survive_template(rng: Generator, task: TaskArrays, cap: int, models: Models) -> Block:
    """Bins that each model survives on one endless stream from `rng`, at most `cap`.

    Mistakes are those of `gnm_env.rules`; the bin of the mistake is not counted. Returns shape
    (blocks, 1, WIDTH).
    """
    zero = full(0.0, WIDTH)
    n_blocks = len(models.weights)
    bins = np.zeros((n_blocks, 1, WIDTH))
    alive = np.ones((n_blocks, 1, WIDTH))
    counts = np.zeros((n_blocks, 1, WIDTH))
    states = np.zeros((n_blocks, models.n_state, WIDTH))
    memories = np.zeros((n_blocks, models.n_memory, WIDTH))
    notes = np.empty((models.n_notes, WIDTH))
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    noise_left = -1.0
    heard_bins = 0
    any_alive = True
    while heard_bins < cap and any_alive:
        channels, offsets, n_noise, class_, noise_left = append_piece(
            rng, task, noise_left, channels, offsets, 0
        )
        n_bins = min(n_noise + (task.pattern_bins if class_ >= 0 else 0), cap - heard_bins)
        owed = float(task.targets[class_]) if class_ >= 0 else 0.0
        last_bin = n_noise + task.pattern_bins - 1
        any_alive = False
        for block in range(n_blocks):
            living = load(alive[block], 0, zero)
            if not any_lane(living > 0.0):
                continue
            p = unpack(Parameters, models.parameters[block], zero)
            state = unpack(State, states[block], zero)
            survived = load(bins[block], 0, zero)
            given = load(counts[block], 0, zero)
            model = block_of(models, block, memories[block], notes)
            for t in range(n_bins):
                given = where(t == n_noise, zero, given)
                state, response = advance(
                    p, model.static, model.arrays, state, channels, offsets[t], offsets[t + 1], 0
                )
                given = given + output(response, zero)
                living = where(too_many(given, 0.0 if t < n_noise else owed), zero, living)
                if t == last_bin:
                    living = where(too_few(given, owed), zero, living)
                survived = survived + living
            pack(states[block], state)
            any_alive |= any_lane(living > 0.0)
            store(alive[block], 0, living)
            store(bins[block], 0, survived)
            # The next piece goes on in the same noise, unless a pattern has ended this one.
            store(counts[block], 0, given if class_ < 0 else zero)
        heard_bins += n_bins
    return bins


class Tally(NamedTuple):
    """What `answer` adds up."""

    table: NDArray[np.int64]
    """How often each number of spikes was given to each class: (blocks, WIDTH, C, most + 1)."""
    false_positives: Block
    """Output in noise, rounded in each segment; this and what follows: (blocks, 1, WIDTH)."""
    wrong: Block
    absolute: Block


def answer_template(batch: Batch, drawn: int, longest: int, models: Models, tally: Tally) -> int:
    """Add the responses of each model to the `drawn` trials of `batch`, without learning.

    Returns the number of noise bins.
    """
    zero = full(0.0, WIDTH)
    memory = np.zeros((models.n_memory, WIDTH))
    log = new_log(longest, batch.edges.size)
    notes = np.empty((longest * models.n_notes, WIDTH))
    noise_bins = 0
    for k in range(drawn):
        trial = trial_of(batch, k)
        classes = batch.classes[batch.edge_of[k] : batch.edge_of[k + 1] - 1]
        for segment in range(len(trial.target)):
            if classes[segment] == -1:
                noise_bins += trial.edges[segment + 1] - trial.edges[segment]
        for block in range(len(models.weights)):
            p = unpack(Parameters, models.parameters[block], zero)
            outcome, _ = run_trial(p, block_of(models, block, memory, notes), trial, log)
            error = outcome.label - outcome.emitted
            error = where(error < 0.0, zero - error, error)
            wrong, absolute = tally.wrong[block], tally.absolute[block]
            store(wrong, 0, load(wrong, 0, zero) + where(error > WRONG_BEYOND, 1.0, zero))
            store(absolute, 0, load(absolute, 0, zero) + error)
            for segment in range(len(trial.target)):
                class_ = classes[segment]
                for lane in range(WIDTH):
                    given = int(np.floor(log.counts[segment, lane] + 0.5))
                    if class_ == -1:
                        tally.false_positives[block, 0, lane] += given
                    elif class_ >= 0:
                        tally.table[block, lane, class_, min(given, MOST_SPIKES)] += 1
    return noise_bins
