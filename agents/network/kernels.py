"""The compiled loops that drive networks: whole trials of many networks, single bins of one.

Networks of one group have the same n_inputs and hidden. Arrays of a group have a row for each:
`wirings` and `rules` their parameters, (networks, …), `weights` and `previous` (networks, weights).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from agents.kernels import MOST_SPIKES, Heard
from agents.network.backpropagation import Rule, count_spikes, learn_trial, rule_at
from agents.network.dynamics import Log, Row, Table, Wiring, new_log, run_trial, step, wiring_at
from gnm_env.compiled import compiled
from gnm_env.sampling import append_piece, append_trial
from gnm_env.task import TaskArrays


@compiled
def _draw_trial(
    rng: Generator, task: TaskArrays, buffers: tuple[Any, Any, Any, Any]
) -> tuple[Heard, NDArray[np.int64], tuple[Any, Any, Any, Any], int]:
    """The next trial, its classes, the buffers that now hold it, and its aggregate label."""
    channels, offsets, onsets, classes, n_bins, n_occurrences, label = append_trial(
        rng, task, buffers[0], buffers[1], buffers[2], buffers[3], 0, 0
    )
    which = classes[:n_occurrences]
    heard = Heard(
        channels,
        offsets[: n_bins + 1],
        onsets[:n_occurrences],
        task.targets[which],
        task.pattern_bins,
    )
    return heard, which, (channels, offsets, onsets, classes), label


@compiled
def _new_buffers() -> tuple[Any, Any, Any, Any]:
    channels, offsets = np.empty(4096, np.int32), np.zeros(4096, np.int64)
    return channels, offsets, np.empty(64, np.int64), np.empty(64, np.int64)


@compiled
def train(
    rng: Generator,
    task: TaskArrays,
    trials: int,
    wirings: Table,
    rules: Table,
    weights: Table,
    previous: Table,
    overflow: NDArray[np.int64],
    first_trial: int,
) -> tuple[NDArray[np.int64], Row]:
    """Draw `trials` trials; every network hears and learns each of them.

    `overflow` holds, per network, the number of the trial in which a weight would have overflowed
    and learning ended, or −1; `first_trial` numbers the first trial here. Returns the number of
    trials answered wrongly and Σ |label − emitted|, per network.
    """
    n_networks = len(weights)
    hidden = wiring_at(wirings, 0).hidden
    wrong = np.zeros(n_networks, np.int64)
    absolute = np.zeros(n_networks)
    gradient = np.empty(weights.shape[1])
    state = np.empty(3 * hidden + 1)
    buffers = _new_buffers()
    log = new_log(0, hidden)
    E = np.empty(0)
    counts = np.empty(0, np.int64)
    for trial in range(trials):
        heard, _, buffers, label = _draw_trial(rng, task, buffers)
        n_bins = len(heard.offsets) - 1
        if n_bins > len(E):
            log = new_log(2 * n_bins, hidden)
            E = np.empty(2 * n_bins)
        if len(heard.onsets) > len(counts):
            counts = np.empty(2 * len(heard.onsets), np.int64)
        for n in range(n_networks):
            wiring = wiring_at(wirings, n)
            run_trial(wiring, weights[n], heard, state, log)
            in_patterns, in_noise = count_spikes(wiring.theta_r, log.V, heard, counts)
            error = abs(label - in_patterns - in_noise)
            absolute[n] += error
            wrong[n] += error != 0
            if overflow[n] >= 0:
                continue
            rule = rule_at(rules, n)
            if not learn_trial(
                wiring, rule, heard, log, counts, E, gradient, weights[n], previous[n]
            ):
                overflow[n] = first_trial + trial
    return wrong, absolute


@compiled
def survive(
    rng: Generator, task: TaskArrays, cap: int, wirings: Table, weights: Table
) -> NDArray[np.int64]:
    """Bins that each network survives on one endless stream from `rng`, at most `cap`.

    A mistake is any spike in noise, one spike too many in an occurrence, or too few by its last
    bin; the bin of the mistake is not counted.
    """
    n_networks = len(weights)
    hidden = wiring_at(wirings, 0).hidden
    bins = np.zeros(n_networks, np.int64)
    alive = np.ones(n_networks, np.bool_)
    states = np.zeros((n_networks, 3 * hidden + 1))
    slopes = np.empty(hidden)
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
        for n in range(n_networks):
            if not alive[n]:
                continue
            wiring = wiring_at(wirings, n)
            state = states[n]
            count = 0
            for t in range(n_bins):
                was_below = state[3 * hidden] < wiring.theta_r
                V = step(wiring, weights[n], state, slopes, channels, offsets[t], offsets[t + 1])
                count += was_below and wiring.theta_r <= V
                if count > (0 if t < n_noise else owed) or (t == last_bin and count < owed):
                    alive[n] = False
                    break
                bins[n] += 1
        heard_bins += n_bins
    return bins


@compiled
def answer(
    rng: Generator, task: TaskArrays, trials: int, wirings: Table, weights: Table
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Responses of each network to `trials` trials, without learning.

    Returns how often each number of spikes was given to each class, (networks, C, MOST_SPIKES + 1),
    and per network the spikes in noise and the trials answered wrongly.
    """
    n_networks = len(weights)
    hidden = wiring_at(wirings, 0).hidden
    table = np.zeros((n_networks, task.n_classes, MOST_SPIKES + 1), np.int64)
    false_alarms = np.zeros(n_networks, np.int64)
    wrong = np.zeros(n_networks, np.int64)
    state = np.empty(3 * hidden + 1)
    buffers = _new_buffers()
    for _ in range(trials):
        heard, classes, buffers, label = _draw_trial(rng, task, buffers)
        log = new_log(len(heard.offsets) - 1, hidden)
        counts = np.empty(len(classes), np.int64)
        for n in range(n_networks):
            wiring = wiring_at(wirings, n)
            run_trial(wiring, weights[n], heard, state, log)
            in_patterns, in_noise = count_spikes(wiring.theta_r, log.V, heard, counts)
            false_alarms[n] += in_noise
            wrong[n] += in_patterns + in_noise != label
            for k in range(len(classes)):
                table[n, classes[k], min(counts[k], MOST_SPIKES)] += 1
    return table, false_alarms, wrong


@compiled
def record(wiring: Wiring, weights: Row, heard: Heard) -> Table:
    """The state after every bin of a trial, (T, 3H + 1)."""
    n_bins = len(heard.offsets) - 1
    states = np.zeros((n_bins, 3 * wiring.hidden + 1))
    slopes = np.empty(wiring.hidden)
    for t in range(n_bins):
        if t > 0:
            states[t] = states[t - 1]
        step(
            wiring,
            weights,
            states[t],
            slopes,
            heard.channels,
            heard.offsets[t],
            heard.offsets[t + 1],
        )
    return states


@compiled
def hear(
    wiring: Wiring,
    weights: Row,
    state: Row,
    observation: NDArray[np.int8],
    t: int,
    channels: NDArray[np.int32],
    offsets: NDArray[np.int64],
    log: Log,
) -> int:
    """One bin of the standard loop: note what is heard, take the step, note what came of it.

    Returns the action, 1 for an output spike, or −1 if a buffer is too short for bin `t`.
    """
    H = wiring.hidden
    n_events = offsets[t]
    if t == len(log.V) or n_events + len(observation) > len(channels):
        return -1
    for i in range(len(observation)):
        if observation[i] != 0:
            channels[n_events] = i
            n_events += 1
    offsets[t + 1] = n_events
    was_below = state[3 * H] < wiring.theta_r
    V = step(wiring, weights, state, log.slopes[t], channels, offsets[t], n_events)
    log.V[t] = V
    for k in range(H):
        log.currents[t, k] = state[2 * H + k]
    return 1 if was_below and wiring.theta_r <= V else 0


@compiled
def study(wiring: Wiring, rule: Rule, heard: Heard, log: Log, weights: Row, previous: Row) -> bool:
    """The learning step of the standard loop, from the agent's own record of the trial.

    Returns False if the step was called for but would have made a weight overflow.
    """
    counts = np.empty(len(heard.onsets), np.int64)
    count_spikes(wiring.theta_r, log.V, heard, counts)
    E = np.empty(len(heard.offsets) - 1)
    gradient = np.empty(len(weights))
    return learn_trial(wiring, rule, heard, log, counts, E, gradient, weights, previous)


@compiled
def foresee(
    wiring: Wiring, weights: Row, states: Table, observations: NDArray[np.int8]
) -> NDArray[np.int64]:
    """Actions for one bin of n independent streams; `states` (n, 3H + 1) is moved on in place."""
    slopes = np.empty(wiring.hidden)
    channels = np.empty(wiring.n_inputs, np.int32)
    actions = np.empty(len(observations), np.int64)
    for n in range(len(observations)):
        n_events = 0
        for i in range(wiring.n_inputs):
            if observations[n, i] != 0:
                channels[n_events] = i
                n_events += 1
        was_below = states[n, 3 * wiring.hidden] < wiring.theta_r
        V = step(wiring, weights, states[n], slopes, channels, 0, n_events)
        actions[n] = 1 if was_below and wiring.theta_r <= V else 0
    return actions
