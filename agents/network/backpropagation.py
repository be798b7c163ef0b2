"""Backpropagation of the error trace, compiled: what a trial teaches a network."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.kernels import Heard
from agents.learning.momentum import apply_change
from agents.learning.rule import RuleParameters
from agents.network.dynamics import Log, Row, Table, Wiring
from agents.network.parameters import BackPropagation
from gnm_env.compiled import compiled


class Rule(NamedTuple):
    """The parameters of the rule as compiled code takes them. Made by `rule_at`."""

    rate_hidden: float
    rate_output: float
    momentum: float
    at_spikes: float
    """1 where E in noise is −1 at output spikes only, else 0."""
    lift_above: float
    """1 where E > 0 reaches bins above threshold too, else 0."""
    max_step: float


def rule_row(settings: BackPropagation) -> tuple[float, ...]:
    """The numbers of a Rule, in order; a group of networks keeps a row for each."""
    return (
        settings.learning_rate_hidden,
        settings.learning_rate_output,
        settings.momentum,
        float(settings.noise_error == "spikes"),
        float(settings.lift_above),
        settings.max_step,
    )


@compiled
def rule_at(rows: Table, n: int) -> Rule:
    """Row `n` as a Rule."""
    row = rows[n]
    return Rule(row[0], row[1], row[2], row[3], row[4], row[5])


@compiled
def count_spikes(
    theta_r: float, V: Row, heard: Heard, counts: NDArray[np.int64]
) -> tuple[int, int]:
    """Output spikes in each occurrence, into `counts`; returns those in patterns and in noise."""
    in_patterns = 0
    in_noise = 0
    before = 0.0
    k = 0
    count = 0
    for t in range(len(heard.offsets) - 1):
        if k < len(heard.onsets) and t == heard.onsets[k] + heard.pattern_bins:
            counts[k] = count
            in_patterns += count
            count = 0
            k += 1
        spike = 1 if V[t] >= theta_r and before < theta_r else 0
        before = V[t]
        if k < len(heard.onsets) and t >= heard.onsets[k]:
            count += spike
        else:
            in_noise += spike
    if k < len(heard.onsets):  # a trial of the user's own may end with a pattern
        counts[k] = count
        in_patterns += count
    return in_patterns, in_noise


@compiled
def error_trace(
    rule: Rule, theta_r: float, V: Row, heard: Heard, counts: NDArray[np.int64], E: Row
) -> bool:
    """E(t), into `E`; returns whether it is anything but zero."""
    blamed = False
    before = 0.0
    k = 0
    for t in range(len(heard.offsets) - 1):
        if k < len(heard.onsets) and t == heard.onsets[k] + heard.pattern_bins:
            k += 1
        above = V[t] >= theta_r
        error = 0.0
        if k < len(heard.onsets) and t >= heard.onsets[k]:
            error = float(heard.owed[k] - counts[k])
            if error > 0.0 and above and rule.lift_above == 0.0:
                error = 0.0
        elif above and (rule.at_spikes == 0.0 or before < theta_r):
            error = -1.0
        before = V[t]
        E[t] = error
        blamed = blamed or error != 0.0
    return blamed


@compiled
def backpropagate(
    wiring: Wiring, weights: Row, heard: Heard, log: Log, E: Row, gradient: Row
) -> None:
    """∂J/∂w of J = Σ_t E(t) V(t), into `gradient`, which is laid out as `weights` is.

    Backward in time, with g(x) for the derivative of J by the variable x:

        g(V(t))   = E(t) + (1 − α) g(V(t+1))
        g(j_k(t)) = u_k g(V(t)) + (1 − κ) g(j_k(t+1))
        g(v_k(t)) = H'(v_k(t)) [g(j_k(t)) − c Σ_{l≠k} g(v_l(t+1))] + (1 − α) g(v_k(t+1))
        ∂J/∂u_k = Σ_t g(V(t)) j_k(t),   ∂J/∂W_ik = Σ_t g(v_k(t)) s_i(t)

    Without a hidden layer ∂J/∂u_i = Σ_t g(V(t)) s_i(t): the eligibility of error-trace learning.
    """
    H = wiring.hidden
    keep = 1.0 - wiring.alpha
    keep_current = 1.0 - wiring.kappa
    u = weights[wiring.n_inputs * H :]
    g_u = gradient[wiring.n_inputs * H :]
    g_j = np.zeros(H)
    g_v = np.zeros(H)
    g_V = 0.0
    gradient[:] = 0.0
    for t in range(len(heard.offsets) - 2, -1, -1):
        g_V = E[t] + keep * g_V
        if H == 0:
            for e in range(heard.offsets[t], heard.offsets[t + 1]):
                gradient[heard.channels[e]] += g_V
            continue
        total = 0.0
        for k in range(H):
            total += g_v[k]
        for k in range(H):
            g_u[k] += g_V * log.currents[t, k]
            g_j[k] = u[k] * g_V + keep_current * g_j[k]
            g_z = g_j[k] - wiring.inhibition * (total - g_v[k])
            g_v[k] = log.slopes[t, k] * g_z + keep * g_v[k]
        for e in range(heard.offsets[t], heard.offsets[t + 1]):
            g_W = gradient[heard.channels[e] * H : (heard.channels[e] + 1) * H]
            for k in range(H):
                g_W[k] += g_v[k]


@compiled
def shorten(change: Row, max_step: float) -> None:
    """Scale `change` down to the length `max_step` if it is longer."""
    largest = 0.0
    for i in range(len(change)):
        largest = max(largest, abs(change[i]))
    if largest == 0.0 or max_step == np.inf:
        return
    # Squares of numbers up to 1 do not overflow. What is infinite or NaN already becomes NaN.
    total = 0.0
    for i in range(len(change)):
        total += (change[i] / largest) ** 2
    length = largest * np.sqrt(total)
    if not length <= max_step:
        for i in range(len(change)):
            change[i] *= max_step / length


@compiled
def learn_trial(
    wiring: Wiring,
    rule: Rule,
    heard: Heard,
    log: Log,
    counts: NDArray[np.int64],
    E: Row,
    gradient: Row,
    weights: Row,
    previous: Row,
) -> bool:
    """The learning step after a trial. Returns False if a weight would have overflowed.

    If E is zero throughout, nothing changes, the previous change included.
    """
    if not error_trace(rule, wiring.theta_r, log.V, heard, counts, E):
        return True
    backpropagate(wiring, weights, heard, log, E, gradient)
    n_hidden = wiring.n_inputs * wiring.hidden
    for i in range(n_hidden):
        gradient[i] *= rule.rate_hidden
    for i in range(n_hidden, len(gradient)):
        gradient[i] *= rule.rate_output
    shorten(gradient, rule.max_step)
    p = RuleParameters(rule.rate_output, rule.momentum, -np.inf, np.inf, 0.0, 0.0, 1.0)
    sound: bool = apply_change(
        p, True, gradient.reshape(-1, 1), weights.reshape(-1, 1), previous.reshape(-1, 1)
    )
    return sound
