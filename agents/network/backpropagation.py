"""Backpropagation of the error trace, compiled: what a trial teaches networks side by side."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.error_trace import error_at
from agents.learning.rule import RuleParameters
from agents.network.dynamics import NetworkParams
from agents.simd import any_lane, full, load, negated, store, unpack, where
from agents.training.slots import WIDTH
from agents.training.trial import ModelBlock, RuleBlock, Scratch, TrialLog
from gnm_env.compiled import compiled, inlined
from gnm_env.rules import compiled_rising as rising
from gnm_env.segments import TrialArrays

N_COMMON = len(RuleParameters._fields)


class RuleNumbers(NamedTuple):
    """The rule's own numbers, one per lane; they follow those that all rules have."""

    rate_hidden: Any
    rate_output: Any
    at_spikes: Any
    """1 where E in noise is −1 at output spikes only, else 0."""
    lift_above: Any
    """1 where E > 0 reaches bins above threshold too, else 0."""
    max_step: Any


@inlined
def error_in(
    p: RuleNumbers,
    theta_r: Any,
    trial: TrialArrays,
    log: TrialLog,
    segment: int,
    t: int,
    zero: Any,
) -> Any:
    """The error trace E(t) as the rule's options have it."""
    E = error_at(trial.target, log.counts, log.above, segment, t, zero)
    if segment % 2 == 1:
        above = load(log.above, t, zero) > 0.0
        return where(above & (E > 0.0) & (p.lift_above == 0.0), zero, E)
    before = load(log.V, t - 1, zero) if t > 0 else zero
    return where(rising(theta_r, load(log.V, t, zero), before) | (p.at_spikes == 0.0), E, zero)


@compiled
def error_trace_of(
    p: RuleNumbers, theta_r: float, V: NDArray[np.float64], trial: TrialArrays
) -> NDArray[np.float64]:
    """E(t) of one network in a trial, (T,), from the potential V (T,) of its readout."""
    n_bins, n_segments = len(V), len(trial.target)
    potential, above = V.copy().reshape(n_bins, 1), np.zeros((n_bins, 1))
    log = TrialLog(potential, above, above, above, np.zeros((n_segments, 1)))
    E = np.zeros(n_bins)
    for segment in range(n_segments):
        for t in range(trial.edges[segment], trial.edges[segment + 1]):
            above[t, 0] = 1.0 if theta_r <= V[t] else 0.0
            log.counts[segment, 0] += rising(theta_r, V[t], V[t - 1] if t > 0 else 0.0)
    for segment in range(n_segments):
        for t in range(trial.edges[segment], trial.edges[segment + 1]):
            E[t] = error_in(p, theta_r, trial, log, segment, t, 0.0)
    return E


def backpropagated_change(
    rule: RuleBlock, model: ModelBlock, trial: TrialArrays, log: TrialLog, scratch: Scratch
) -> None:
    """λ ∂J/∂w of J = Σ_t E(t) V(t), clipped in length, in the lanes whose correction is not 0.

    Backward in time, with g(x) for the derivative of J by the variable x:

        g(V(t))   = E(t) + (1 − α) g(V(t+1))
        g(j_k(t)) = u_k g(V(t)) + (1 − κ) g(j_k(t+1))
        g(v_k(t)) = H'(v_k(t)) [g(j_k(t)) − c Σ_{l≠k} g(v_l(t+1))] + (1 − α) g(v_k(t+1))
        ∂J/∂u_k = Σ_t g(V(t)) j_k(t),   ∂J/∂W_ik = Σ_t g(v_k(t)) s_i(t)

    Without a hidden layer ∂J/∂u_i = Σ_t g(V(t)) s_i(t): the eligibility of error-trace learning.
    Lanes in which E is 0 throughout learn nothing: their correction becomes 0.
    """
    zero = full(0.0, WIDTH)
    numbers = unpack(RuleNumbers, rule.parameters[N_COMMON:], zero)
    p = unpack(NetworkParams, model.parameters, zero)
    weights, notes, gradient = model.arrays.weights, model.arrays.notes, scratch.change
    n_inputs, H = model.static[0], model.static[1]
    u = n_inputs * H
    keep = 1.0 - p.alpha
    keep_current = 1.0 - p.kappa
    for i in range(len(gradient)):
        store(gradient, i, zero)
    g_j = np.zeros((H, WIDTH))
    g_v = np.zeros((H, WIDTH))
    g_V = zero
    next_total = zero
    blame = zero
    for segment in range(len(trial.target) - 1, -1, -1):
        for t in range(trial.edges[segment + 1] - 1, trial.edges[segment] - 1, -1):
            E = error_in(numbers, p.theta_r, trial, log, segment, t, zero)
            blame = where(E != 0.0, 1.0, blame)
            g_V = E + keep * g_V
            if H == 0:
                for e in range(trial.offsets[t], trial.offsets[t + 1]):
                    i = trial.channels[e]
                    store(gradient, i, load(gradient, i, zero) + g_V)
            else:
                row = 2 * H * t
                total, next_total = next_total, zero
                for k in range(H):
                    of_current = load(gradient, u + k, zero) + g_V * load(notes, row + H + k, zero)
                    store(gradient, u + k, of_current)
                    g = load(weights, u + k, zero) * g_V + keep_current * load(g_j, k, zero)
                    store(g_j, k, g)
                    before = load(g_v, k, zero)
                    g_z = g - p.inhibition * (total - before)
                    g_z = load(notes, row + k, zero) * g_z + keep * before
                    store(g_v, k, g_z)
                    next_total = next_total + g_z
                for e in range(trial.offsets[t], trial.offsets[t + 1]):
                    W = trial.channels[e] * H
                    for k in range(H):
                        store(gradient, W + k, load(gradient, W + k, zero) + load(g_v, k, zero))
    rate_hidden = load(scratch.rates, 0, zero) * numbers.rate_hidden
    rate_output = load(scratch.rates, 0, zero) * numbers.rate_output
    squares = zero
    for i in range(len(gradient)):
        change = (rate_hidden if i < u else rate_output) * load(gradient, i, zero)
        squares = squares + change * change
        store(gradient, i, change)
    # Well below the limit, which most steps are, there is no need to look more closely.
    if any_lane(negated(squares < 0.999 * numbers.max_step * numbers.max_step)):
        clip_by_norm(gradient, numbers.max_step, zero)
    c = load(scratch.corrections, 0, zero)
    store(scratch.corrections, 0, where(blame > 0.0, c, zero))


@inlined
def clip_by_norm(change: NDArray[np.float64], max_step: Any, zero: Any) -> None:
    """Scale the `change` of each network down to the length `max_step` where it is longer."""
    largest = zero
    for i in range(len(change)):
        size = load(change, i, zero)
        size = where(size < 0.0, zero - size, size)
        largest = where(size > largest, size, largest)
    # Squares of numbers up to 1 do not overflow. What is infinite or NaN already becomes NaN.
    scale = where(largest == 0.0, 1.0, largest)
    total = zero
    for i in range(len(change)):
        part = load(change, i, zero) / scale
        total = total + part * part
    length = largest * np.sqrt(total)
    short = (length <= max_step) | (max_step == np.inf)
    if any_lane(negated(short)):
        factor = where(short, 1.0, max_step / length)
        for i in range(len(change)):
            part = load(change, i, zero)
            store(change, i, where(short, part, part * factor))
