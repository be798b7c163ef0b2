"""The critical thresholds of the multi-spike tempotron, exactly.

With U the potential without resets and S(t) = Σ_{t_s<t} e^(−(t−t_s)/τ_m) over the output spikes so
far, the neuron with threshold θ is at or above it in bin t where U(t) − θ S(t) >= θ, that is where

    ρ(t) = U(t) / (1 + S(t)) >= θ.

So as long as the spike train stays what it is, ρ does, and the train changes only where θ passes a
value of ρ. Moving θ down from ϑ, the next change is at the highest ρ(t) below θ that would open an
excursion, or join or advance one; moving it up, at the lowest ρ(t) that closes, delays or splits
one. The event's bin is the t whose ρ(t) = θ: there, with the spikes before it unchanged, the
derivative of that θ is ∂ρ(t)/∂w_i = x_i(t) / (1 + S(t)). (Spike times fall on bins, so S does not
depend on w.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tests.agents.learning.oracles.neurons import MST, Floats


class Train(NamedTuple):
    """What the neuron does at one threshold."""

    spikes: list[int]
    rho: list[float]
    S: list[float]


class Critical(NamedTuple):
    """A critical threshold."""

    theta: float
    bin_: int
    """t*, where ρ(t*) = ϑ*."""
    C: float
    """1 + S(t*)."""


def spike_train(neuron: MST, U: Floats, theta: float, strict: bool = False) -> Train:
    """STS(θ). `strict` asks for ρ > θ instead of ρ >= θ: the train just above θ."""
    spikes: list[int] = []
    rho: list[float] = []
    sums: list[float] = []
    before = False
    for t in range(len(U)):
        S = sum(math.exp(-(t - s) / neuron.tau_m) for s in spikes)
        sums.append(S)
        rho.append(float(U[t]) / (1.0 + S))
        above = rho[t] > theta if strict else rho[t] >= theta
        if above and not before:
            spikes.append(t)
        before = above
    return Train(spikes, rho, sums)


def critical_thresholds(neuron: MST, U: Floats, output: int, label: int) -> list[Critical]:
    """The critical thresholds between the present count and the label, the nearest to ϑ first.

    Too few: ϑ*_k for k = output + 1 … label, each the first θ that gives k spikes when θ falls from
    ϑ; the list ends early if no θ > 0 gives so many. Too many: ϑ*_k for k = output … label + 1,
    each the θ above which fewer than k spikes are left when θ rises from ϑ.
    """
    down = output < label
    step = 1 if down else -1
    k = output + 1 if down else output
    theta = neuron.theta
    train = spike_train(neuron, U, theta)
    found: list[Critical] = []
    strict = False
    while len(found) < abs(label - output):
        event = _event_below(train, theta) if down else _event_above(train, theta, strict)
        if event is None or event[0] <= 0.0:
            break
        theta, t = event
        C = 1.0 + train.S[t]
        strict = not down
        train = spike_train(neuron, U, theta, strict)
        while _passed(len(train.spikes), k, down) and len(found) < abs(label - output):
            found.append(Critical(theta, t, C))
            k += step
    return found


def _passed(count: int, k: int, down: bool) -> bool:
    return count >= k if down else count < k


def _event_below(train: Train, theta: float) -> tuple[float, int] | None:
    """The highest θ' < θ at which the train changes, and the bin that comes up to it; or None."""
    best: tuple[float, int] | None = None
    for t, rho in enumerate(train.rho):
        previous = train.rho[t - 1] if t else 0.0
        if t in train.spikes:
            value, bin_ = previous, t - 1  # the bin before joins the excursion
        elif rho > previous:
            value, bin_ = rho, t  # a new excursion opens
        else:
            continue
        if bin_ >= 0 and value < theta and (best is None or value > best[0]):
            best = (value, bin_)
    return best


def _event_above(train: Train, theta: float, strict: bool) -> tuple[float, int] | None:
    """The lowest θ' >= θ (> θ after an event) just above which the train changes, and the bin."""
    best: tuple[float, int] | None = None
    for t, rho in enumerate(train.rho):
        previous = train.rho[t - 1] if t else 0.0
        if t in train.spikes:
            value, bin_ = rho, t  # the spike's own bin falls below
        elif t and rho > previous:
            value, bin_ = previous, t - 1  # the excursion splits before a rise
        else:
            continue
        inside = value > theta or (value == theta and not strict)
        if inside and (best is None or value < best[0]):
            best = (value, bin_)
    return best


def by_bisection(
    neuron: MST, U: Floats, output: int, label: int, step: float = 0.03, halvings: int = 60
) -> float | None:
    """ϑ* of the nearest missing or extra spike by scanning away from ϑ, then bisecting; or None.

    Scanning may pass over two changes that cancel; the exact search does not.
    """
    down = output < label
    k = output + 1 if down else output
    inner = neuron.theta
    for _ in range(2_000):
        outer = inner * (1.0 - step if down else 1.0 + step)
        if _passed(len(spike_train(neuron, U, outer).spikes), k, down):
            break
        inner = outer
    else:
        return None
    for _ in range(halvings):
        middle = (inner + outer) / 2.0
        if _passed(len(spike_train(neuron, U, middle).spikes), k, down):
            outer = middle
        else:
            inner = middle
    return float(np.mean([inner, outer]))
