"""The compiled loops that drive every neuron and every rule.

The functions here are templates: `kernels(neuron, rule, width)` binds `step` and its types to a
neuron, `correction`, `teaching_signal` and `weight_change` to a rule, and WIDTH to a number of
neurons side by side. WIDTH 1 serves the standard loop, a bin at a time; larger ones whole trials
for many neurons. They share every formula, and so end with the same bits.

A *block* holds WIDTH neurons; its arrays have shape (rows, WIDTH): parameters (one row a field),
weights and their previous changes (one row an input), state. Arrays of many blocks have shape
(blocks, rows, WIDTH).
"""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.lanes import any_lane, full, load, pack, repeated, store, unpack, where
from agents.learning.momentum import apply_change
from agents.learning.rule import Outcome, Rule, RuleParameters
from agents.neurons.neuron import Neuron
from gnm_env.compiled import compiled, specialise
from gnm_env.sampling import append_piece, append_trial
from gnm_env.task import World

Block = NDArray[np.float64]

BATCH_BINS = 4_096
"""Trials are drawn ahead until this many bins are there (one trial at least)."""

MOST_SPIKES = 10
"""Responses are counted up to this many spikes per occurrence; the last count means "or more"."""

# Bound by `kernels`; the values here only say what belongs there.
WIDTH = 1
LEARN_WIDTH = 8
WRONG_BEYOND = 0.0
"""A trial counts as wrong if its sum is further than this from the label; ½ for graded output."""
Parameters: Any = None
State: Any = None
step: Any = None
correction: Any = None
teaching_signal: Any = None
weight_change: Any = None
USES_ERROR = False
DOUBLE_TRACE = False
run_bins: Any = None
run_trial: Any = None
sum_eligibility: Any = None
learn_trial: Any = None


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
    for k in range(len(heard.onsets) + 1):
        last = k == len(heard.onsets)
        stop = len(heard.offsets) - 1 if last else heard.onsets[k]
        state, spikes, bins_above = run_bins(p, mode, state, weights, heard, t, stop, log)
        in_noise = in_noise + spikes
        blame = blame + bins_above
        if last:
            break
        t = stop + heard.pattern_bins
        state, spikes, _ = run_bins(p, mode, state, weights, heard, stop, t, log)
        in_patterns = in_patterns + spikes
        blame = blame + where(spikes == heard.owed[k], zero, 1.0)
        store(log.counts, k, spikes)
        owed += heard.owed[k]
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
    learn. Sets `sound` (1, WIDTH) to 0 where a weight would have overflowed, else to 1.
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


def train_template(
    rng: Generator,
    world: World,
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
    eligibility = np.empty((world.n_inputs, WIDTH))
    corrections = np.empty((1, WIDTH))
    sound = np.empty((1, WIDTH))
    channels, offsets = np.empty(4096, np.int32), np.zeros(8192, np.int64)
    onsets, classes = np.empty(256, np.int64), np.empty(256, np.int64)
    bin_of = np.zeros(BATCH_BINS + 2, np.int64)  # first bin and first occurrence of each trial
    occurrence_of = np.zeros(BATCH_BINS + 2, np.int64)
    V = np.empty((0, WIDTH))
    above = np.empty((0, WIDTH))
    counts = np.empty((0, WIDTH))
    done = 0
    while done < trials:
        drawn = 0
        longest = 0
        while done + drawn < trials and bin_of[drawn] < BATCH_BINS:
            channels, offsets, onsets, classes, stop, occurrence_of[drawn + 1], _ = append_trial(
                rng, world, channels, offsets, onsets, classes, bin_of[drawn], occurrence_of[drawn]
            )
            longest = max(longest, stop - bin_of[drawn])
            bin_of[drawn + 1] = stop
            drawn += 1
        owed = world.targets[classes[: occurrence_of[drawn]]]
        if longest > len(V):
            V = np.empty((2 * longest, WIDTH))
            above = np.empty((2 * longest if USES_ERROR else 0, WIDTH))
        if len(owed) > len(counts):
            counts = np.empty((2 * len(owed), WIDTH))
        log = Log(V, above, counts)
        for block in range(n_blocks):
            p = unpack(Parameters, parameters[block], zero)
            for k in range(drawn):
                heard = Heard(
                    channels,
                    offsets[bin_of[k] : bin_of[k + 1] + 1],
                    onsets[occurrence_of[k] : occurrence_of[k + 1]],
                    owed[occurrence_of[k] : occurrence_of[k + 1]],
                    world.pattern_bins,
                )
                outcome, _ = run_trial(p, mode, weights[block], heard, log)
                error = outcome.label - outcome.emitted
                error = where(error < 0.0, zero - error, error)
                missed = where(error > WRONG_BEYOND, 1.0, zero)
                store(wrong[block], 0, load(wrong[block], 0, zero) + missed)
                store(absolute[block], 0, load(absolute[block], 0, zero) + error)
                ended = load(overflow[block], 0, zero)
                c = where(ended < 0.0, correction(outcome), zero)
                store(corrections, 0, c)
                if any_lane(c != 0.0):
                    learn_trial(
                        rule_parameters[block],
                        rule_mode,
                        corrections,
                        heard,
                        log,
                        eligibility,
                        weights[block],
                        previous[block],
                        sound,
                    )
                    failed = (c != 0.0) & (load(sound, 0, zero) == 0.0)
                    if any_lane(failed):
                        trial = float(first_trial + done + k)
                        store(overflow[block], 0, where(failed, trial, ended))
        done += drawn
    return wrong, absolute


def survive_template(
    rng: Generator, world: World, cap: int, mode: Any, parameters: Block, weights: Block
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
            rng, world, noise_left, channels, offsets, 0
        )
        n_bins = min(n_noise + (world.pattern_bins if class_ >= 0 else 0), cap - heard_bins)
        owed = float(world.targets[class_]) if class_ >= 0 else 0.0
        last_bin = n_noise + world.pattern_bins - 1
        for block in range(n_blocks):
            living = load(alive[block], 0, zero)
            if not any_lane(living > 0.0):
                continue
            p = unpack(Parameters, parameters[block], zero)
            state = unpack(State, states[block], zero)
            survived = load(bins[block], 0, zero)
            count = zero
            for t in range(n_bins):
                drive = drive_at(weights[block], channels, offsets, t, zero)
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
    rng: Generator, world: World, trials: int, mode: Any, parameters: Block, weights: Block
) -> tuple[NDArray[np.int64], Block, Block, int]:
    """Responses of each neuron to `trials` trials, without learning.

    Returns how often each number of spikes was given to each class, (blocks, WIDTH, C,
    MOST_SPIKES + 1); spikes in noise and trials answered wrongly, (blocks, 1, WIDTH); and the
    number of noise bins.
    """
    zero = full(0.0, WIDTH)
    n_blocks = len(weights)
    table = np.zeros((n_blocks, WIDTH, world.n_classes, MOST_SPIKES + 1), np.int64)
    false_alarms = np.zeros((n_blocks, 1, WIDTH))
    wrong = np.zeros((n_blocks, 1, WIDTH))
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    onsets, classes = np.empty(8, np.int64), np.empty(8, np.int64)
    for _ in range(trials):
        channels, offsets, onsets, classes, n_bins, n_occurrences, _ = append_trial(
            rng, world, channels, offsets, onsets, classes, 0, 0
        )
        heard = Heard(
            channels,
            offsets[: n_bins + 1],
            onsets[:n_occurrences],
            world.targets[classes[:n_occurrences]],
            world.pattern_bins,
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
    return table, false_alarms, wrong, trials * world.background_bins


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

    `sign` is the feedback where only its sign is known, NaN where label and occurrences are.
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
        c = sign
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


def kernels(neuron: Neuron, rule: Rule, width: int = 1) -> Any:
    """The compiled loops for neurons and rules such as these, `width` neurons side by side.

    Compiled at their first call and kept on disk.
    """
    return _kernels(*neuron.step(), type(neuron), type(rule), rule.trace(neuron).double, width)


@functools.cache
def _kernels(
    name: str, step: Any, neuron: type[Neuron], rule: type[Rule], double: bool, width: int
) -> Any:
    of_neuron = _neuron_bindings(step, neuron, width)
    of_rule = {
        "WIDTH": width,
        "LEARN_WIDTH": min(width, LEARN_WIDTH),
        "USES_ERROR": rule.uses_error,
        "DOUBLE_TRACE": double,
        "correction": rule.correction,
        "teaching_signal": rule.teaching_signal,
        "weight_change": rule.weight_change,
    }
    alone = f"{name}_{width}"
    together = f"{name}_{rule.name}_{'double' if double else 'single'}_{width}"
    bins = specialise(run_bins_template, together, **of_neuron, USES_ERROR=rule.uses_error)
    trial = specialise(run_trial_template, together, **of_neuron, run_bins=bins)
    eligibility = specialise(sum_eligibility_template, together, **of_rule)
    learn = specialise(learn_trial_template, together, **of_rule, sum_eligibility=eligibility)
    all_ = {**of_neuron, **of_rule, "run_trial": trial, "learn_trial": learn}
    return SimpleNamespace(
        train=specialise(train_template, together, **all_),
        answer=specialise(answer_template, together, **all_),
        study=specialise(study_template, together, **all_),
        survive=specialise(survive_template, alone, **of_neuron),
        hear=specialise(hear_template, alone, **of_neuron),
        foresee=specialise(foresee_template, alone, **of_neuron),
    )


def recorder(neuron: Neuron) -> Any:
    """The compiled loop that notes every variable of a neuron such as this."""
    return _recorder(*neuron.recording_step(), type(neuron))


@functools.cache
def _recorder(name: str, step: Any, neuron: type[Neuron]) -> Any:
    return specialise(record_template, name, **_neuron_bindings(step, neuron, 1))


def _neuron_bindings(step: Any, neuron: type[Neuron], width: int) -> dict[str, Any]:
    return {
        "WIDTH": width,
        "Parameters": neuron.parameters_type,
        "State": neuron.state_type,
        "step": step,
    }
