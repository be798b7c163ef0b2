"""Many neurons on one stream, drawn on the way: training, noisy performance, answers per class."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.kernels.slots import (
    USES_ERROR,
    WIDTH,
    WRONG_BEYOND,
    Parameters,
    State,
    correction,
    learn_trial,
    run_trial,
    step,
)
from agents.kernels.trial import Block, Heard, Log, drive_at
from agents.simd import any_lane, full, load, pack, repeated, store, unpack, where
from gnm_env.compiled import compiled
from gnm_env.sampling import (
    DRAFT,
    append_piece,
    append_trial,
    begin_trial,
    fill_trial,
    longer_buffers,
)
from gnm_env.task import TaskArrays

BATCH_BINS = 4_096
"""Trials are drawn ahead until this many bins are there (one trial at least): the parameters of a
block are then read once for some twenty trials, and what was drawn stays in the cache."""

MOST_SPIKES = 10
"""Responses are counted up to this many spikes per occurrence; the last count means "or more"."""


@compiled
def draw_trials(
    rng: Generator,
    task: TaskArrays,
    most: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    onsets: NDArray[np.int64],
    classes: NDArray[np.int64],
    bin_of: NDArray[np.int64],
    occurrence_of: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], int, int]:
    """Draw at most `most` trials one behind the other, until there are BATCH_BINS bins.

    Fills `bin_of` and `occurrence_of`, which begin with 0. Returns the four buffers, the number of
    trials and the length of the longest.
    """
    draft = np.zeros(1, DRAFT)
    drawn = longest = 0
    while drawn < most and bin_of[drawn] < BATCH_BINS:
        begin_trial(draft, offsets, bin_of[drawn], occurrence_of[drawn])
        while not fill_trial(rng, task, channels, offsets, onsets, classes, draft):
            channels, offsets, onsets, classes = longer_buffers(
                task, channels, offsets, onsets, classes, draft
            )
        drawn += 1
        bin_of[drawn], occurrence_of[drawn] = draft[0].bin_, draft[0].occurrence
        longest = max(longest, bin_of[drawn] - bin_of[drawn - 1])
    return channels, offsets, onsets, classes, drawn, longest


def train_template(
    rng: Generator,
    task: TaskArrays,
    trials: int,
    mode: Any,
    rule_mode: Any,
    parameters: Block,
    rule_parameters: Block,
    weights: Block,
    previous: Block,
    overflow: Block,
    first_trial: int,
) -> tuple[Block, Block]:
    """Draw `trials` trials; every neuron of every block hears and learns each of them.

    `overflow` (blocks, 1, WIDTH) holds, per neuron, the number of the trial in which a weight
    would have overflowed and learning ended, or −1; `first_trial` numbers the first trial here.
    Returns the number of trials answered wrongly and Σ |label − emitted|, (blocks, 1, WIDTH) each.
    """
    zero = full(0.0, WIDTH)
    n_blocks = len(weights)
    wrong = np.zeros((n_blocks, 1, WIDTH))
    absolute = np.zeros((n_blocks, 1, WIDTH))
    eligibility = np.empty((task.n_inputs, WIDTH))
    corrections = np.empty((1, WIDTH))
    sound = np.empty((1, WIDTH))
    # Buffers that a batch of the default task fits into.
    channels, offsets = np.empty(BATCH_BINS, np.int32), np.zeros(2 * BATCH_BINS, np.int64)
    onsets, classes = np.empty(256, np.int64), np.empty(256, np.int64)
    # First bin and first occurrence of each trial, and what follows the last; a trial has a bin.
    bin_of = np.zeros(BATCH_BINS + 1, np.int64)
    occurrence_of = np.zeros(BATCH_BINS + 1, np.int64)
    V = np.empty((0, WIDTH))
    above = np.empty((0, WIDTH))
    counts = np.empty((0, WIDTH))
    done = 0
    while done < trials:
        channels, offsets, onsets, classes, drawn, longest = draw_trials(
            rng, task, trials - done, channels, offsets, onsets, classes, bin_of, occurrence_of
        )
        owed = task.targets[classes[: occurrence_of[drawn]]]
        if longest > len(V):
            V = np.empty((2 * longest, WIDTH))
            above = np.empty((2 * longest if USES_ERROR else 0, WIDTH))
        if len(owed) > len(counts):
            counts = np.empty((2 * len(owed), WIDTH))
        log = Log(V, above, counts)
        for block in range(n_blocks):
            p = unpack(Parameters, parameters[block], zero)
            # Out of the inner loop, where a view of an array costs as much as some bins.
            its_weights = weights[block]
            overflowed_in = load(overflow[block], 0, zero)
            n_wrong = load(wrong[block], 0, zero)
            total_error = load(absolute[block], 0, zero)
            for k in range(drawn):
                heard = Heard(
                    channels,
                    offsets[bin_of[k] : bin_of[k + 1] + 1],
                    onsets[occurrence_of[k] : occurrence_of[k + 1]],
                    owed[occurrence_of[k] : occurrence_of[k + 1]],
                    task.pattern_bins,
                )
                outcome, _ = run_trial(p, mode, its_weights, heard, log)
                error = outcome.label - outcome.emitted
                error = where(error < 0.0, zero - error, error)
                n_wrong = n_wrong + where(error > WRONG_BEYOND, 1.0, zero)
                total_error = total_error + error
                c = where(overflowed_in < 0.0, correction(outcome), zero)
                if any_lane(c != 0.0):
                    store(corrections, 0, c)
                    learn_trial(
                        rule_parameters[block],
                        rule_mode,
                        corrections,
                        heard,
                        log,
                        eligibility,
                        its_weights,
                        previous[block],
                        sound,
                    )
                    failed = (c != 0.0) & (load(sound, 0, zero) == 0.0)
                    overflowed_in = where(failed, float(first_trial + done + k), overflowed_in)
            store(overflow[block], 0, overflowed_in)
            store(wrong[block], 0, n_wrong)
            store(absolute[block], 0, total_error)
        done += drawn
    return wrong, absolute


def survive_template(
    rng: Generator, task: TaskArrays, cap: int, mode: Any, parameters: Block, weights: Block
) -> Block:
    """Bins that each neuron survives on one endless stream from `rng`, at most `cap`.

    A mistake is any spike in noise, one spike too many in an occurrence, or too few by its last
    bin; the bin of the mistake is not counted. Returns shape (blocks, 1, WIDTH).
    """
    zero = full(0.0, WIDTH)
    n_blocks = len(weights)
    bins = np.zeros((n_blocks, 1, WIDTH))
    alive = np.ones((n_blocks, 1, WIDTH))
    states = np.zeros((n_blocks, len(repeated(State, zero)), WIDTH))
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    noise_left = -1.0
    heard_bins = 0
    while heard_bins < cap and alive.any():
        channels, offsets, n_noise, class_, noise_left = append_piece(
            rng, task, noise_left, channels, offsets, 0
        )
        n_bins = min(n_noise + (task.pattern_bins if class_ >= 0 else 0), cap - heard_bins)
        owed = float(task.targets[class_]) if class_ >= 0 else 0.0
        last_bin = n_noise + task.pattern_bins - 1
        for block in range(n_blocks):
            living = load(alive[block], 0, zero)
            if not any_lane(living > 0.0):
                continue
            p = unpack(Parameters, parameters[block], zero)
            state = unpack(State, states[block], zero)
            survived = load(bins[block], 0, zero)
            its_weights = weights[block]
            count = zero
            for t in range(n_bins):
                drive = drive_at(its_weights, channels, offsets, t, zero)
                state, response = step(p, mode, state, drive)
                count = count + where(response.spike, 1.0, zero)
                most = 0.0 if t < n_noise else owed
                living = where(count > most, zero, living)
                if t == last_bin:
                    living = where(count < most, zero, living)
                survived = survived + living
            pack(states[block], state)
            store(alive[block], 0, living)
            store(bins[block], 0, survived)
        heard_bins += n_bins
    return bins


def answer_template(
    rng: Generator, task: TaskArrays, trials: int, mode: Any, parameters: Block, weights: Block
) -> tuple[NDArray[np.int64], Block, Block, int]:
    """Responses of each neuron to `trials` trials, without learning.

    Returns how often each number of spikes was given to each class, (blocks, WIDTH, C,
    MOST_SPIKES + 1); spikes in noise and trials answered wrongly, (blocks, 1, WIDTH); and the
    number of noise bins.
    """
    zero = full(0.0, WIDTH)
    n_blocks = len(weights)
    table = np.zeros((n_blocks, WIDTH, task.n_classes, MOST_SPIKES + 1), np.int64)
    false_alarms = np.zeros((n_blocks, 1, WIDTH))
    wrong = np.zeros((n_blocks, 1, WIDTH))
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    onsets, classes = np.empty(8, np.int64), np.empty(8, np.int64)
    for _ in range(trials):
        channels, offsets, onsets, classes, n_bins, n_occurrences, _ = append_trial(
            rng, task, channels, offsets, onsets, classes, 0, 0
        )
        heard = Heard(
            channels,
            offsets[: n_bins + 1],
            onsets[:n_occurrences],
            task.targets[classes[:n_occurrences]],
            task.pattern_bins,
        )
        log = Log(
            np.empty((n_bins, WIDTH)), np.empty((n_bins, WIDTH)), np.empty((n_occurrences, WIDTH))
        )
        for block in range(n_blocks):
            p = unpack(Parameters, parameters[block], zero)
            outcome, in_noise = run_trial(p, mode, weights[block], heard, log)
            store(false_alarms[block], 0, load(false_alarms[block], 0, zero) + in_noise)
            missed = where(outcome.emitted != outcome.label, 1.0, zero)
            store(wrong[block], 0, load(wrong[block], 0, zero) + missed)
            for k in range(n_occurrences):
                for lane in range(WIDTH):
                    given = min(int(log.counts[k, lane]), MOST_SPIKES)
                    table[block, lane, classes[k], given] += 1
    return table, false_alarms, wrong, trials * task.background_bins
