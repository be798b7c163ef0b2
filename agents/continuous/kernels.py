"""The compiled loops of a continuous neuron in bins: each bin's input arrives at its beginning.

They take the place of those in `agents.kernels` that count spikes; the loops that only drive these,
and the learning step, are the ones from there. One neuron at a time (WIDTH 1). V is above the
threshold, as the log of a trial has it, in the bins that give any output; the standard loop and
`answer` note the amount itself there.
"""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.continuous.flow import STEPS_PER_BIN, Between, amount, flow
from agents.kernels import MOST_SPIKES, Block, Heard, Log, kernels
from agents.kernels.streams import train_template
from agents.kernels.trial import (
    drive_at,
    learn_trial_template,
    run_trial_template,
    sum_eligibility_template,
)
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron
from agents.simd import pack, store, unpack
from gnm_env.compiled import compiled, specialise
from gnm_env.sampling import append_piece, append_trial
from gnm_env.task import TaskArrays

# Bound by `_continuous_kernels`.
step: Any = None
run_trial: Any = None
AMOUNTS = False
"""Whether the log is to have the amount of output of each bin, instead of 1 where there is any."""


class Parameters(NamedTuple):
    """`agents.neurons.gnm.Parameters`, as rates per bin, and what the readout can give."""

    leak: Any
    eta_gamma: Any
    beta: Any
    zeta: Any
    theta_b: Any
    theta_r: Any
    h: Any
    flat_below: Any
    flat_above: Any
    max_output: Any
    left: Any
    """e^−(1−η)α, what is left of V after a bin; of use for η = 0 only."""


class State(NamedTuple):
    """At the end of a bin."""

    V: Any
    R: Any


class GradedResponse(NamedTuple):
    """What the neuron shows in one bin; compare `agents.neurons.neuron.Response`."""

    V: Any
    """Membrane potential right after the bin's input."""
    D: Any
    """What the rest of the bin takes away from it."""
    R: Any
    """The neuron's own reset variable at the beginning of the bin."""
    X: Any
    """Readout, compared with the threshold: V."""
    above: Any
    """Whether the readout is at or above the threshold right after the bin's input."""
    spike: Any
    """Whether V rises through ϑ_R in this bin: at its beginning, since only input lifts V."""
    S: Any
    """The amount of output, ∫ Θ(V − ϑ_R) V dt over the bin."""


@compiled
def exact_step(
    p: Parameters, mode: tuple[int, ...], state: State, drive: float
) -> tuple[State, GradedResponse]:
    """One bin for η = 0: the input adds `drive` to V at once, then V decays."""
    V = state.V + drive
    return _respond(p, state, V, Between(p.left * V, 0.0, amount(p, V, p.left * V)))


@compiled
def numerical_step(
    p: Parameters, mode: tuple[int, ...], state: State, drive: float
) -> tuple[State, GradedResponse]:
    """One bin for η > 0: the input adds `drive` to V at once, then V and R go on together."""
    V = state.V + drive
    return _respond(p, state, V, flow(p, mode, V, state.R, 1.0, STEPS_PER_BIN))


@compiled
def _respond(p: Parameters, state: State, V: float, end: Between) -> tuple[State, GradedResponse]:
    S = min(end.S, p.max_output)
    above = p.theta_r <= V
    spike = above and p.theta_r > state.V
    return State(end.V, end.R), GradedResponse(V, V - end.V, state.R, V, above, spike, S)


def run_bins_template(
    p: Any, mode: Any, state: Any, weights: Block, heard: Heard, start: int, stop: int, log: Log
) -> tuple[Any, float, float]:
    """Bins start … stop − 1: the new state, the amount of output, and the bins that gave any."""
    S = 0.0
    bins_above = 0.0
    for t in range(start, stop):
        drive = drive_at(weights, heard.channels, heard.offsets, t, 0.0)
        state, response = step(p, mode, state, drive)
        store(log.V, t, response.V)
        above = 1.0 if response.S > 0.0 else 0.0
        store(log.above, t, response.S if AMOUNTS else above)
        S += response.S
        bins_above += above
    return state, S, bins_above


@compiled
def rounded(S: float) -> float:
    """The number of spikes that the amount S stands for."""
    return np.floor(S + 0.5)


def survive_template(
    rng: Generator, task: TaskArrays, cap: int, mode: Any, parameters: Block, weights: Block
) -> Block:
    """Bins that each neuron survives on one endless stream from `rng`, at most `cap`.

    A mistake is an amount of more than ½ in a stretch of noise (in the bin that exceeds it), and in
    an occurrence an amount that rounds to more than is owed (in that bin) or to less (in its last
    bin). The bin of the mistake is not counted. `parameters` and `weights` have shape
    (neurons, rows, 1); the result has (neurons, 1, 1).
    """
    n_neurons = len(weights)
    bins = np.zeros((n_neurons, 1, 1))
    alive = np.ones(n_neurons, np.bool_)
    states = np.zeros((n_neurons, 2, 1))
    amounts = np.zeros(n_neurons)
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    noise_left = -1.0
    heard_bins = 0
    while heard_bins < cap and alive.any():
        channels, offsets, n_noise, class_, noise_left = append_piece(
            rng, task, noise_left, channels, offsets, 0
        )
        n_bins = min(n_noise + (task.pattern_bins if class_ >= 0 else 0), cap - heard_bins)
        owed = task.targets[class_] if class_ >= 0 else 0
        last_bin = n_noise + task.pattern_bins - 1
        for k in range(n_neurons):
            if not alive[k]:
                continue
            p = unpack(Parameters, parameters[k], 0.0)
            state = unpack(State, states[k], 0.0)
            S = amounts[k]
            for t in range(n_bins):
                if t == n_noise:
                    S = 0.0
                drive = drive_at(weights[k], channels, offsets, t, 0.0)
                state, response = step(p, mode, state, drive)
                S += response.S
                if t < n_noise:
                    alive[k] = S <= 0.5
                else:
                    alive[k] = rounded(S) <= owed and (t < last_bin or rounded(S) == owed)
                if not alive[k]:
                    break
                bins[k, 0, 0] += 1.0
            pack(states[k], state)
            # The next piece goes on in the same noise, unless a pattern has ended this one.
            amounts[k] = S if class_ < 0 else 0.0
        heard_bins += n_bins
    return bins


def answer_template(
    rng: Generator, task: TaskArrays, trials: int, mode: Any, parameters: Block, weights: Block
) -> tuple[NDArray[np.int64], Block, Block, int]:
    """Rounded responses of each neuron to `trials` trials; as in `agents.kernels.streams`."""
    n_neurons = len(weights)
    table = np.zeros((n_neurons, 1, task.n_classes, MOST_SPIKES + 1), np.int64)
    false_alarms = np.zeros((n_neurons, 1, 1))
    wrong = np.zeros((n_neurons, 1, 1))
    channels, offsets = np.empty(256, np.int32), np.zeros(512, np.int64)
    onsets, classes = np.empty(8, np.int64), np.empty(8, np.int64)
    for _ in range(trials):
        channels, offsets, onsets, classes, n_bins, n_occurrences, label = append_trial(
            rng, task, channels, offsets, onsets, classes, 0, 0
        )
        heard = Heard(
            channels,
            offsets[: n_bins + 1],
            onsets[:n_occurrences],
            task.targets[classes[:n_occurrences]],
            task.pattern_bins,
        )
        log = Log(np.empty((n_bins, 1)), np.empty((n_bins, 1)), np.empty((n_occurrences, 1)))
        for k in range(n_neurons):
            p = unpack(Parameters, parameters[k], 0.0)
            outcome, _ = run_trial(p, mode, weights[k], heard, log)
            false_alarms[k, 0, 0] += in_noise(heard, log)
            if rounded(outcome.emitted) != label:
                wrong[k, 0, 0] += 1.0
            for j in range(n_occurrences):
                given = min(int(rounded(log.counts[j, 0])), MOST_SPIKES)
                table[k, 0, classes[j], given] += 1
    return table, false_alarms, wrong, trials * task.background_bins


@compiled
def in_noise(heard: Heard, log: Log) -> float:
    """Σ over the stretches of noise of the rounded amount in each."""
    total = 0.0
    t = 0
    for k in range(len(heard.onsets) + 1):
        last = k == len(heard.onsets)
        stop = len(heard.offsets) - 1 if last else heard.onsets[k]
        total += rounded(log.above[t:stop].sum())
        if not last:
            t = stop + heard.pattern_bins
    return total


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
) -> float:
    """One bin of the standard loop, as in `agents.kernels.stepwise`; returns the amount S."""
    n_events = offsets[t]
    if t == len(V) or n_events + len(observation) > len(channels):
        return -1.0
    for i in range(len(observation)):
        if observation[i] != 0:
            channels[n_events] = i
            n_events += 1
    offsets[t + 1] = n_events
    p = unpack(Parameters, parameters, 0.0)
    drive = drive_at(weights, channels, offsets, t, 0.0)
    new_state, response = step(p, mode, unpack(State, state, 0.0), drive)
    pack(state, new_state)
    V[t, 0] = response.V
    above[t, 0] = response.S
    return response.S


def foresee_template(
    mode: Any, parameters: Block, weights: Block, states: Block, observations: NDArray[np.int8]
) -> NDArray[np.float64]:
    """Amounts for one bin of n independent streams; `states` (n, 2, 1) is moved on in place."""
    p = unpack(Parameters, parameters, 0.0)
    amounts = np.empty((len(observations), 1))
    for k in range(len(observations)):
        drive = 0.0
        for i in range(observations.shape[1]):
            if observations[k, i] != 0:
                drive += weights[i, 0]
        state, response = step(p, mode, unpack(State, states[k], 0.0), drive)
        pack(states[k], state)
        amounts[k, 0] = response.S
    return amounts


WRONG_BEYOND = 0.5
"""A sum is answered wrongly if it is further than this from what is owed."""

STEPS = {True: ("continuous_exact", exact_step), False: ("continuous_numerical", numerical_step)}
"""The step for η = 0 and for other η, each with its name."""


def continuous_kernels(neuron: Neuron, rule: Rule) -> Any:
    """The compiled loops for a continuous neuron and a rule; names as in `agents.kernels`."""
    return _continuous_kernels(*neuron.step(), type(rule), kernels(neuron, rule).study)


@functools.cache
def _continuous_kernels(name: str, step: Any, rule: type[Rule], study: Any) -> Any:
    of_neuron = {"WIDTH": 1, "Parameters": Parameters, "State": State, "step": step}
    of_rule = {
        "WIDTH": 1,
        "LEARN_WIDTH": 1,
        "USES_ERROR": rule.uses_error,
        "DOUBLE_TRACE": False,
        "correction": rule.correction,
        "teaching_signal": rule.teaching_signal,
        "weight_change": rule.weight_change,
    }
    together = f"{name}_{rule.name}"
    trial, noting_trial = (
        specialise(
            run_trial_template,
            f"{name}{suffix}",
            run_bins=specialise(run_bins_template, f"{name}{suffix}", step=step, AMOUNTS=amounts),
            **of_neuron,
        )
        for suffix, amounts in (("", False), ("_amounts", True))
    )
    eligibility = specialise(sum_eligibility_template, together, **of_rule)
    learn = specialise(learn_trial_template, together, **of_rule, sum_eligibility=eligibility)
    # The log is kept whatever the rule: it needs the room that rules with an error ask for.
    all_ = {
        **of_neuron,
        **of_rule,
        "USES_ERROR": True,
        "WRONG_BEYOND": WRONG_BEYOND,
        "run_trial": trial,
        "learn_trial": learn,
    }

    def study_amounts(
        mode: Any, parameters: Block, sign: float, heard: Heard, label: int, log: Log, *rest: Any
    ) -> bool:
        """The learning step of the standard loop: amounts, noted by `hear`, in place of spikes."""
        _, weights, previous = rest
        amounts = log.above[:, 0].copy()
        log.above[:] = log.above > 0.0
        taken: bool = study(mode, parameters, sign, heard, label, log, amounts, weights, previous)
        return taken

    return SimpleNamespace(
        train=specialise(train_template, together, **all_),
        study=study_amounts,
        answer=specialise(answer_template, name, run_trial=noting_trial),
        survive=specialise(survive_template, name, step=step),
        hear=specialise(hear_template, name, step=step),
        foresee=specialise(foresee_template, name, step=step),
    )
