"""The second opinion itself: worked out by hand over ten bins, and checked by differences.

The trial of ten bins, GNM with α = ½ (so that every number is a sum of powers of two):

    bin         0      1     2     3      4      5       6        7         8          9
    channel 0   |                         |
    channel 1          |                         |                                     |
    channel 2                                                     |
    V          .5     .5   .25  .125  .5625 .53125 .265625 1.3828125 .69140625 .595703125

with weights .5, .25, 1.25, and a fourth channel that is silent. The only output spike is in bin 7.
Missed peaks: bin 0 (the first bin need not rise, and a plateau counts once) and bin 4. Bin 9 ends
the trial but does not rise. Presentations are bins 0 … 2 and 6 … 8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.agents import reference
from tests.agents.learning.oracles import events, rules
from tests.agents.learning.oracles.critical import (
    by_bisection,
    critical_thresholds,
    spike_train,
)
from tests.agents.learning.oracles.neurons import (
    GNM,
    LIF,
    MST,
    Floats,
    Spec,
    hear,
    kernel,
    spec,
    traces,
)
from tests.agents.learning.oracles.rules import Lesson, Trial, act
from tests.agents.learning.oracles.trials import NEURONS, Case, binary_cases, cases, kinds

HALF = GNM(alpha=0.5)
WEIGHTS = np.array([0.5, 0.25, 1.25, -9.0])
V = [0.5, 0.5, 0.25, 0.125, 0.5625, 0.53125, 0.265625, 1.3828125, 0.69140625, 0.595703125]
# Presynaptic traces in the bins that are taught: ½ per bin since each spike, its own bin 1.
X0 = np.array([1.0, 0.0, 0.0, 0.0])
X1 = np.array([0.5, 1.0, 0.0, 0.0])
X4 = np.array([1.0625, 0.125, 0.0, 0.0])
X7 = np.array([0.1328125, 0.265625, 1.0, 0.0])


def ten_bins(first: int, second: int, last: int = 9) -> Trial:
    """The trial above, owed so much in its two presentations; the second ends before `last`."""
    raster = np.zeros((10, 4), np.bool_)
    for channel, bins in enumerate([[0, 4], [1, 5, 9], [7]]):
        raster[bins, channel] = True
    return Trial(raster, [0, 0, 3, 6, last, 10], [0, first, 0, second, 0])


FEW, RIGHT, MANY, MIXED = ten_bins(1, 1), ten_bins(0, 1), ten_bins(0, 0), ten_bins(1, 0)


def y_of(*marks: tuple[int, float]) -> Floats:
    y = np.zeros(10)
    for bin_, value in marks:
        y[bin_] = value
    return y


def assert_taught(lesson: Lesson, y: Any, change: Any) -> None:
    assert lesson.teaches
    if y is not None:
        assert lesson.y is not None
        np.testing.assert_allclose(lesson.y, y, rtol=1e-14, atol=0.0)
    np.testing.assert_allclose(lesson.change, change, rtol=1e-13, atol=1e-16)


def assert_nothing(lesson: Lesson) -> None:
    weights, velocity = act(lesson, WEIGHTS, np.ones(4))
    assert not lesson.teaches
    assert np.array_equal(weights, WEIGHTS) and np.array_equal(velocity, np.ones(4))


def test_the_trial_of_ten_bins_is_heard_as_by_hand() -> None:
    heard = hear(HALF, FEW.raster, WEIGHTS)
    assert heard.V.tolist() == V
    assert heard.times == [7]
    assert [peak.bin_ for peak in events.missed_peaks(heard, 1.0)] == [0, 4]
    assert events.spike_peaks(heard, 1.0) == [events.Peak(1.3828125, 7, 7)]


def test_critical_threshold_by_hand() -> None:
    assert_taught(rules.critical_threshold(FEW, HALF, WEIGHTS, 2.0), y_of((4, 1.0)), 2.0 * X4)
    assert_taught(rules.critical_threshold(MANY, HALF, WEIGHTS, 2.0), y_of((7, -1.0)), -2.0 * X7)
    assert_nothing(rules.critical_threshold(RIGHT, HALF, WEIGHTS))
    # Owed 4 and given 1: the sign names one peak, the amount both that there are.
    more = ten_bins(1, 3)
    assert_taught(rules.critical_threshold(more, HALF, WEIGHTS, 1.0), y_of((4, 1.0)), X4)
    both = rules.critical_threshold(more, HALF, WEIGHTS, 1.0, amount=True)
    assert_taught(both, y_of((0, 1.0), (4, 1.0)), X0 + X4)


def test_mpdal_and_tempotron_by_hand() -> None:
    assert_taught(rules.mpdal(FEW, HALF, WEIGHTS, 1.0), y_of((4, 1.0)), X4)
    assert_taught(rules.mpdal(MANY, HALF, WEIGHTS, 1.0), y_of((7, -1.0)), -X7)
    assert_taught(rules.tempotron(MANY, HALF, WEIGHTS, 1.0), y_of((7, -1.0)), -X7)
    # At half the weights the neuron is silent, and its largest potential still in bin 7.
    assert_taught(rules.tempotron(MIXED, HALF, WEIGHTS / 2, 1.0), y_of((7, 1.0)), X7)
    assert_nothing(rules.tempotron(MIXED, HALF, WEIGHTS))
    assert_nothing(rules.tempotron(MANY, HALF, WEIGHTS / 2))
    with pytest.raises(ValueError, match="0 or 1, got 2"):
        rules.tempotron(FEW, HALF, WEIGHTS)


def test_peak_error_by_hand() -> None:
    assert_taught(rules.peak_error(FEW, HALF, WEIGHTS, 1.0), y_of((0, 1.0)), X0)
    assert_taught(rules.peak_error(MANY, HALF, WEIGHTS, 1.0), y_of((7, -1.0)), -X7)
    both = rules.peak_error(MIXED, HALF, WEIGHTS, 1.0)  # the count is right, the places are not
    assert_taught(both, y_of((0, 1.0), (7, -1.0)), X0 - X7)
    first = rules.peak_error(MIXED, HALF, WEIGHTS, 1.0, first_only=True)
    assert_taught(first, y_of((0, 1.0)), X0)
    assert_nothing(rules.peak_error(RIGHT, HALF, WEIGHTS))


def test_surrogate_gradient_by_hand() -> None:
    # E = 1 over the first presentation, 0 elsewhere. ψ(½) = 1/3.5² = 4/49, ψ(¼) = 1/4.75² = 16/361.
    a, b = 4 / 49, 16 / 361
    change = np.array([a + a / 2 + b / 4, a + b / 2, 0.0, 0.0])
    lesson = rules.surrogate_gradient(FEW, HALF, WEIGHTS, 1.0)
    assert_taught(lesson, y_of((0, a), (1, a), (2, b)), change)
    assert_nothing(rules.surrogate_gradient(RIGHT, HALF, WEIGHTS))
    # On the count every bin is taught; the triangle is 0.3 V below threshold and 0.3 (2 − V) above.
    lesson = rules.surrogate_gradient(FEW, HALF, WEIGHTS, 1.0, surrogate="triangle", on_count=True)
    psi = [0.3 * v if v < 1 else 0.3 * (2 - v) for v in V]
    assert lesson.y is not None and np.allclose(lesson.y, psi, rtol=1e-14)
    by_hand = 0.3 * (0.6171875 + 0.69140625 / 2 + 0.595703125 / 4)  # channel 2: bins 7, 8, 9
    assert lesson.change[2] == pytest.approx(by_hand, rel=1e-14)


def test_noise_at_or_above_the_threshold_is_an_error_of_the_trace_in_every_bin() -> None:
    trial = FEW._replace(edges=[0, 0, 3, 3, 6, 10])  # bins 6 … 9 are noise now
    heard = hear(HALF, trial.raster, 2.0 * WEIGHTS)  # doubled: V at or above 1 in 0 1 4 5 7 8 9
    assert rules.error_trace(trial, heard).tolist() == [0, 0, 0, 0, 0, 0, 0, -1, -1, -1]
    assert heard.times == [0, 4, 7]


def test_target_times_by_hand() -> None:
    heard = hear(HALF, FEW.raster, WEIGHTS)
    assert events.even_targets(FEW.edges, [0, 1, 0, 2, 0]) == [1, 7, 8]
    assert events.chosen_targets(heard, 1.0, FEW.edges, [0, 1, 0, 1, 0]) == [0, 7]
    # The second presentation has one spike and no missed peak: one of two owed is all there is.
    assert events.chosen_targets(heard, 1.0, FEW.edges, [0, 0, 0, 2, 0]) == [7]


def test_resume_psd_and_span_by_hand() -> None:
    # Chosen: target 0 is missing, 7 is there. Evenly spaced: 1 is missing, 7 is there.
    assert_taught(rules.resume(FEW, HALF, WEIGHTS, 1.0), y_of((0, 1.0)), X0)
    even = rules.resume(FEW, HALF, WEIGHTS, 1.0, times="even", a=0.25)
    assert_taught(even, y_of((1, 1.0)), X1 + 0.25)
    assert_nothing(rules.resume(RIGHT, HALF, WEIGHTS, times="even"))
    # PSD: one bin after channel 0's spike, in the bin of channel 1's, where the current is still 0.
    current = 4 ** (4 / 3) / 3 * (math.exp(-0.1) - math.exp(-0.4))
    psd = rules.psd(FEW, HALF, WEIGHTS, 1.0, times="even")
    assert_taught(psd, y_of((1, 1.0)), [current, 0.0, 0.0, 0.0])
    # SPAN: distances to bin 1 are 1 and 3; 0, 4 and 8; 6.
    e = math.exp
    change = np.array(
        [
            6 * e(-1 / 5) + 8 * e(-3 / 5),
            5 + 9 * e(-4 / 5) + 13 * e(-8 / 5),
            11 * e(-6 / 5),
            0.0,
        ]
    )
    span = rules.span(FEW, HALF, WEIGHTS, 1.0, times="even", tau=5.0)
    assert_taught(span, None, (math.e / 2) ** 2 * change)
    assert_nothing(rules.span(RIGHT, HALF, WEIGHTS, times="even"))


def test_chronotron_by_hand() -> None:
    # Evenly spaced in bins 0 … 2 and 6 … 9: targets 1 and 8; the output 7 is moved to 8 for ⅛, and
    # 1 is added. The move teaches (γ/τ²)(7 − 8) = −½ in bin 7.
    trial = ten_bins(1, 1, last=10)
    aligned = events.align([7], [1, 8], 2.0)
    assert aligned == events.Alignment(1.125, [], [1], [(7, 8)])
    lesson = rules.chronotron(trial, HALF, WEIGHTS, 1.0, times="even", tau_q=2.0)
    assert_taught(lesson, y_of((1, 1.0), (7, -0.5)), X1 - X7 / 2)
    # I: |w| (κ(1) + κ(8) − κ(7)), and κ(8) = κ(7)/2 for inputs up to 7.
    lesson = rules.chronotron(trial, HALF, WEIGHTS, 1.0, times="even", rule="I")
    y = y_of((1, 1.0), (7, -1.0), (8, 1.0))
    assert_taught(lesson, y, np.abs(WEIGHTS) * (X1 - X7 / 2))
    # Inhibited, the neuron lacks both targets, and the inhibition weakens.
    inhibited = rules.chronotron(trial, HALF, -WEIGHTS, 1.0, times="even", rule="I")
    assert_taught(inhibited, y_of((1, 1.0), (8, 1.0)), np.abs(WEIGHTS) * (X1 + X7 / 2))


def test_stdp_and_mstdpet_by_hand() -> None:
    # Output 7; last inputs before it 4, 5, 7; channel 1's next input after it 9.
    a, e = 0.03125, math.exp
    change = [
        a * e(-3 / 16.8),
        a * e(-2 / 16.8) - 0.85 * a * e(-2 / 33.7),
        a,
        0.0,
    ]
    assert_taught(rules.stdp(FEW, HALF, WEIGHTS), None, change)
    assert not rules.stdp(FEW, HALF, WEIGHTS / 2).teaches
    # r = −1. Channel 2 spikes with the output: +1 − 1 = 0. Bin 7 fades for two bins, 9 does not.
    fade = e(-2 / 25) / 25
    change = [
        -(e(-7 / 20) + e(-3 / 20)) * fade,
        -((e(-6 / 20) + e(-2 / 20)) * fade - e(-2 / 20) / 25),
        0.0,
        0.0,
    ]
    assert_taught(rules.mstdpet(FEW, HALF, WEIGHTS, 1.0), None, change)
    assert_nothing(rules.mstdpet(RIGHT, HALF, WEIGHTS))


def test_policy_gradient_by_hand() -> None:
    # A spike in bin 7, the next one after the end: o = 1, r = −1, two above the mean of −3.
    P = [1 / (1 + math.exp((1 - v) / 0.5)) for v in V]
    silent = np.cumprod(1.0 - np.array(P))
    draws = [(silent[6] + silent[7]) / 2, 1e-9]
    policy = rules.policy_gradient(
        FEW, HALF, WEIGHTS, iter(draws).__next__, 1.0, 0.5, baseline=-3.0
    )
    y = [2 * ((t == 7) - P[t]) / 0.5 for t in range(10)]
    assert policy.spikes.tolist() == [t == 7 for t in range(10)]
    assert policy.baseline == pytest.approx(-2.9)
    x2 = y[7] + y[8] / 2 + y[9] / 4
    assert policy.lesson.change[2] == pytest.approx(x2, rel=1e-13)
    assert_taught(policy.lesson, y, policy.lesson.change)
    first = rules.policy_gradient(FEW, HALF, WEIGHTS, iter(draws).__next__, width=0.5)
    assert first.baseline == -1.0
    assert_nothing(first.lesson)


# The multi-spike tempotron with e^(−1/τ_m) = ½ and e^(−1/τ_s) = ¼: K(t) = 4(2^−t − 4^−t), that is
# 0, 1, ¾, .4375, .234375, .12109375 … Channel 0 spikes in bin 0 with weight 3, channel 1 in bin 4.
# With weight ½: U = 0, 3, 2.25, 1.3125, .703125, .86328125, … One spike, in bin 1. After it S(5) is
# 2⁻⁴, and ρ(5) = .86328125 / 1.0625 = .8125 is the highest peak of ρ below 1: ϑ*_2.
EXACT = MST(tau_m=1 / math.log(2), tau_s=1 / math.log(4))


def tempotron_trial(label: int) -> Trial:
    raster = np.zeros((10, 3), np.bool_)
    raster[0, 0] = raster[4, 1] = True
    return Trial(raster, [0, 0, 10, 10], [0, label, 0])


def test_critical_threshold_of_the_multi_spike_tempotron_by_hand() -> None:
    K5 = 0.12109375
    weights = np.array([3.0, 0.5, 1.0])
    heard = hear(EXACT, tempotron_trial(2).raster, weights)
    assert heard.times == [1]
    (found,) = critical_thresholds(EXACT, heard.U, 1, 2)
    assert found.theta == pytest.approx(0.8125, rel=1e-14)
    assert found.bin_ == 5
    assert found.C == pytest.approx(1.0625)
    lesson = rules.critical_threshold(tempotron_trial(2), EXACT, weights, 1.0)
    assert_taught(lesson, y_of((5, 1 / 1.0625)), np.array([K5, 1.0, 0.0]) / 1.0625)
    # With weight 1 there is a second spike in bin 5: ρ(5) = 1.36328125 / 1.0625. The first spike
    # goes at ρ(1) = 3, where no reset precedes it.
    weights[1] = 1.0
    lesson = rules.critical_threshold(tempotron_trial(0), EXACT, weights, 1.0)
    assert_taught(lesson, y_of((5, -1 / 1.0625)), -np.array([K5, 1.0, 0.0]) / 1.0625)
    both = rules.critical_threshold(tempotron_trial(0), EXACT, weights, 1.0, amount=True)
    assert both.y is not None
    np.testing.assert_allclose(both.y, y_of((1, -1.0), (5, -1 / 1.0625)), rtol=1e-14)
    # Inhibited alone, nothing can be taught: no θ > 0 gives a spike.
    silent = np.array([-3.0, -1.0, 1.0])
    assert not rules.critical_threshold(tempotron_trial(1), EXACT, silent).teaches


def test_a_tempotron_teaches_at_the_maximum_before_the_next_input() -> None:
    # First spike in bin 1; U is highest there, and bin 4 brings the next input.
    trial, weights = tempotron_trial(0), np.array([3.0, 0.5, 1.0])
    assert_taught(rules.tempotron(trial, EXACT, weights, 1.0), y_of((1, -1.0)), [-1.0, 0.0, 0.0])
    # Slower synapses: after the crossing in bin 2, U rises up to bin 9 by itself, but bin 4 brings
    # the next input. The higher of bins 2 and 3 is 3.
    slow = MST(tau_m=20.0, tau_s=5.0)
    lesson = rules.tempotron(trial, slow, weights, 1.0)
    K = kernel(slow, 4)
    assert 3.0 * K[1] < 1.0 <= 3.0 * K[2]
    assert_taught(lesson, y_of((3, -1.0)), [-K[3], 0.0, 0.0])


def test_the_lif_is_taught_at_the_potential_before_its_reset() -> None:
    # α = ½, one channel in bins 0, 1, 2 with weight .75: V = .75, 1.125 → 0, .75, then decay.
    raster = np.zeros((10, 1), np.bool_)
    raster[:3, 0] = True
    lif = LIF(alpha=0.5)
    heard = hear(lif, raster, [0.75])
    assert heard.V.tolist()[:4] == [0.75, 1.125, 0.75, 0.375]
    assert heard.times == [1]
    # Bin 2 is lower than bin 1 before the reset, so there is no missed peak at all.
    assert events.missed_peaks(heard, 1.0) == []
    few = Trial(raster, [0, 0, 10, 10], [0, 2, 0])
    assert not rules.critical_threshold(few, lif, [0.75]).teaches
    many = few._replace(target=[0, 0, 0])
    assert_taught(rules.critical_threshold(many, lif, [0.75], 1.0), y_of((1, -1.0)), [-1.5])


def test_with_readout_D_the_lesson_lies_a_bin_earlier() -> None:
    # D(t) = V(t−1)/2: it peaks in bins 1 and 5 below .6, and its spike is in bin 8.
    neuron = GNM(alpha=0.5, readout="D", theta_r=0.6)
    heard = hear(neuron, FEW.raster, WEIGHTS)
    assert heard.times == [8]
    assert_taught(rules.critical_threshold(FEW, neuron, WEIGHTS, 1.0), y_of((4, 1.0)), X4)
    assert_taught(rules.critical_threshold(MANY, neuron, WEIGHTS, 1.0), y_of((7, -1.0)), -X7)


def test_an_excursion_has_its_peak_after_its_crossing() -> None:
    # Doubled weights: V = 1, 1, .5, .25, 1.125, 1.0625, .53, 2.77, …: the excursion of bin 0 is
    # level (its first bin counts), that of 4 peaks there.
    raster, weights = FEW.raster, 2.0 * WEIGHTS
    heard = hear(HALF, raster, weights)
    assert [(p.spike, p.bin_) for p in events.spike_peaks(heard, 1.0)] == [(0, 0), (4, 4), (7, 7)]
    late = raster.copy()
    late[8, 2] = True  # V(8) = 1.3828125 + 2.5: the peak of the spike in bin 7
    heard = hear(HALF, late, weights)
    assert [(p.spike, p.bin_) for p in events.spike_peaks(heard, 1.0)][-1] == (7, 8)
    assert events.spike_peaks(heard, 1.0, at="crossing")[-1].bin_ == 7
    many = MANY._replace(raster=late)
    lesson = rules.peak_error(many, HALF, weights, 1.0)
    assert lesson.y is not None and np.flatnonzero(lesson.y).tolist() == [0, 4, 8]


def test_of_equal_heights_the_earliest_wins() -> None:
    peaks = [events.Peak(1.0, 5, 5), events.Peak(2.0, 3, 3), events.Peak(1.0, 2, 2)]
    assert [peak.bin_ for peak in events.lowest(peaks, 2)] == [2, 5]
    assert [peak.bin_ for peak in events.highest(peaks, 2)] == [3, 2]
    assert events.lowest(peaks, 0) == events.highest(peaks, -1) == []
    assert len(events.highest(peaks, 9)) == 3


@pytest.mark.parametrize(
    ("outputs", "targets", "expected"),
    [
        ([], [4], ([], [4], [])),
        ([4], [], ([4], [], [])),
        ([4], [4], ([], [], [(4, 4)])),
        ([3, 7], [5], ([7], [], [(3, 5)])),  # both are as near: the later one is removed
        ([0], [40], ([0], [40], [])),  # too far to move
        ([0], [8], ([0], [8], [])),  # ½(8/4)² = 2 = 1 + 1: a draw, and removing goes first
    ],
)
def test_spike_trains_are_aligned_at_the_least_cost(
    outputs: list[int], targets: list[int], expected: tuple[Any, ...]
) -> None:
    aligned = events.align(outputs, targets, 4.0)
    assert (aligned.removed, aligned.added, aligned.moved) == expected
    moves = sum(((o - d) / 4.0) ** 2 / 2 for o, d in aligned.moved)
    assert aligned.cost == len(aligned.removed) + len(aligned.added) + moves


def test_no_alignment_of_random_trains_is_cheaper() -> None:
    """Against every way to pair the spikes in order, found by trying them all."""

    def cheapest(outputs: list[int], targets: list[int]) -> float:
        if not outputs or not targets:
            return float(len(outputs) + len(targets))
        moved = ((outputs[0] - targets[0]) / 3.0) ** 2 / 2
        return min(
            1 + cheapest(outputs[1:], targets),
            1 + cheapest(outputs, targets[1:]),
            moved + cheapest(outputs[1:], targets[1:]),
        )

    rng = np.random.default_rng(3)
    for _ in range(40):
        outputs = sorted(int(t) for t in rng.integers(0, 20, rng.integers(0, 5)))
        targets = sorted(int(t) for t in rng.integers(0, 20, rng.integers(0, 5)))
        assert events.align(outputs, targets, 3.0).cost == pytest.approx(cheapest(outputs, targets))


def test_the_autocorrelation_of_spans_kernel_is_the_closed_form() -> None:
    tau, fine = 5.0, np.arange(0.0, 120.0, 0.001)

    def alpha(t: Floats) -> Floats:
        return np.where(t >= 0, math.e / tau * t * np.exp(-t / tau), 0.0)

    for lag in (0.0, 1.0, 7.0):
        summed = float(np.sum(alpha(fine) * alpha(fine + lag))) * 0.001
        closed = (math.e / 2) ** 2 * (lag + tau) * math.exp(-lag / tau)
        assert summed == pytest.approx(closed, rel=1e-6)


@pytest.mark.parametrize("name", NEURONS)
def test_neurons_agree_with_the_other_plain_reference(name: str) -> None:
    neuron = NEURONS[name]
    for case in cases(neuron, n=10):
        heard = hear(neuron, case.trial.raster, case.weights)
        fields = {key: getattr(neuron, key) for key in neuron.__dataclass_fields__}
        if isinstance(neuron, MST):
            other = reference.mst(case.trial.raster, case.weights, **fields)
        else:
            step: Callable[..., reference.Trace] = (
                reference.gnm if isinstance(neuron, GNM) else reference.lif
            )
            other = step(reference.drives(case.trial.raster, case.weights), **fields)
        np.testing.assert_allclose(heard.V, other.V, rtol=0.0, atol=1e-12)
        assert np.array_equal(heard.spikes, other.spikes)


@pytest.mark.parametrize("name", NEURONS)
def test_the_random_trials_ask_for_more_and_for_less(name: str) -> None:
    found = kinds(cases(NEURONS[name], n=60))
    assert min(found["few"], found["many"]) >= 4, found
    assert set(kinds(binary_cases(NEURONS[name], n=60))) == {"few", "many", "right"}


def tempotron_cases() -> list[Case]:
    made = cases(NEURONS["mst"], n=60, seed=1) + cases(NEURONS["mst_slow"], n=60, seed=2)
    return made + cases(replace(EXACT, tau_m=6.0, tau_s=3.0), n=40, seed=3)


def test_exact_critical_thresholds_are_those_of_bisection() -> None:
    """Where scanning finds another one, it has passed over changes that cancel: a nearer count."""
    same = 0
    for case in tempotron_cases():
        assert isinstance(case.neuron, MST)
        heard = hear(case.neuron, case.trial.raster, case.weights)
        output, d = len(heard.times), case.trial.label
        if output == d:
            continue
        found = critical_thresholds(case.neuron, heard.U, output, output + int(np.sign(d - output)))
        other = by_bisection(case.neuron, heard.U, output, d)
        if not found:
            assert other is None or other < 1e-9
            continue
        assert other is not None
        (one,) = found
        if other == pytest.approx(one.theta, rel=1e-9):
            same += 1
        else:
            assert abs(one.theta - 1.0) < abs(other - 1.0)
        k = output + 1 if output < d else output
        below = len(spike_train(case.neuron, heard.U, one.theta * (1 - 1e-9)).spikes)
        above = len(spike_train(case.neuron, heard.U, one.theta * (1 + 1e-9)).spikes)
        assert above < k <= below
    assert same > 60


def test_the_gradient_of_a_critical_threshold_is_that_of_central_differences() -> None:
    """For ϑ*_1 … ϑ*_4, at every one of them that the random trials hold."""
    seen: dict[int, int] = {}
    h = 1e-6
    for case in tempotron_cases():
        assert isinstance(case.neuron, MST)
        x = traces(case.trial.raster, kernel(case.neuron, case.trial.n_bins))

        def theta_star(weights: Floats, output: int, to: int, case: Case = case) -> float:
            U = hear(case.neuron, case.trial.raster, weights).U
            assert isinstance(case.neuron, MST)
            return critical_thresholds(case.neuron, U, output, to)[-1].theta

        output = len(hear(case.neuron, case.trial.raster, case.weights).times)
        for to in (output + 1, output - 1):
            k = max(output, to)
            U = hear(case.neuron, case.trial.raster, case.weights).U
            found = critical_thresholds(case.neuron, U, output, to) if 1 <= k <= 4 else []
            if not found:
                continue
            gradient = x[found[0].bin_] / found[0].C
            for i in range(0, len(case.weights), 3):
                step = h * (np.arange(len(case.weights)) == i)
                up = theta_star(case.weights + step, output, to)
                down = theta_star(case.weights - step, output, to)
                assert (up - down) / (2 * h) == pytest.approx(gradient[i], abs=1e-6)
            seen[k] = seen.get(k, 0) + 1
    assert all(seen.get(k, 0) >= 5 for k in (1, 2, 3, 4)), seen


def test_the_event_is_the_spike_that_comes_or_goes() -> None:
    """Settled point 12: the first spike present just below and absent just above ϑ* is at t*."""
    same = different = 0
    for case in tempotron_cases():
        assert isinstance(case.neuron, MST)
        heard = hear(case.neuron, case.trial.raster, case.weights)
        for to in (len(heard.times) + 1, len(heard.times) - 1):
            for one in critical_thresholds(case.neuron, heard.U, len(heard.times), max(to, 0)):
                below = spike_train(case.neuron, heard.U, one.theta * (1 - 1e-9)).spikes
                above = spike_train(case.neuron, heard.U, one.theta * (1 + 1e-9)).spikes
                gone = [t for t in below if t not in above]
                same += gone[0] == one.bin_
                different += gone[0] != one.bin_
    assert (same > 200, different) == (True, 0)


def test_the_critical_threshold_of_the_gnm_is_its_peak() -> None:
    """At η = 0: ϑ* is the height of the chosen peak where excursions neither split nor merge."""
    neuron = NEURONS["gnm"]
    checked = 0
    for case in cases(neuron, n=80, seed=4):
        heard = hear(neuron, case.trial.raster, case.weights)
        lesson = rules.critical_threshold(case.trial, neuron, case.weights, 1.0)
        if not lesson.teaches:
            continue
        assert lesson.y is not None
        (t,) = np.flatnonzero(lesson.y)
        sign, height = lesson.y[t], heard.V[t]
        for i in range(len(case.weights)):
            step = 1e-6 * (np.arange(len(case.weights)) == i)
            up = hear(neuron, case.trial.raster, case.weights + step).V[t]
            down = hear(neuron, case.trial.raster, case.weights - step).V[t]
            assert (up - down) / 2e-6 == pytest.approx(sign * lesson.change[i], abs=1e-8)
        # A threshold a hair beyond the peak does what a hair before it does not.
        assert isinstance(neuron, GNM)
        counts = [
            len(hear(replace(neuron, theta_r=height + e), case.trial.raster, case.weights).times)
            for e in (-1e-9, 1e-9)
        ]
        assert counts[0] == counts[1] + 1
        checked += 1
    assert checked > 40


def test_the_policy_gradient_is_that_of_the_log_likelihood() -> None:
    neuron = NEURONS["gnm"]
    assert isinstance(neuron, GNM)
    rng = np.random.default_rng(5)
    for case in cases(neuron, n=8, seed=6):
        policy = rules.policy_gradient(
            case.trial, neuron, case.weights, rng.random, 1.0, 0.2, baseline=0.5
        )
        advantage = -abs(case.trial.label - int(policy.spikes.sum())) - 0.5

        def likelihood(weights: Floats, case: Case = case, z: Any = policy.spikes) -> float:
            V = hear(case.neuron, case.trial.raster, weights).V
            s = (V - case.neuron.threshold) / 0.2
            return float(-np.sum(np.logaddexp(0.0, np.where(z, -s, s))))

        for i in range(len(case.weights)):
            step = 1e-6 * (np.arange(len(case.weights)) == i)
            slope = (likelihood(case.weights + step) - likelihood(case.weights - step)) / 2e-6
            assert policy.lesson.change[i] == pytest.approx(advantage * slope, abs=1e-5)


def test_the_error_traces_gradient_is_that_of_the_sum_of_E_times_V() -> None:
    """What SurrogateGradient and ET ascend, where V is linear in the weights; E and ψ held."""
    for case in cases(NEURONS["gnm"], n=8, seed=7):
        lesson = rules.surrogate_gradient(case.trial, case.neuron, case.weights, 1.0)
        assert lesson.y is not None
        for i in range(len(case.weights)):
            step = 1e-6 * (np.arange(len(case.weights)) == i)
            up = hear(case.neuron, case.trial.raster, case.weights + step).V @ lesson.y
            down = hear(case.neuron, case.trial.raster, case.weights - step).V @ lesson.y
            assert (up - down) / 2e-6 == pytest.approx(lesson.change[i], abs=1e-7)


def _policy(trial: Trial, neuron: Any, weights: Floats) -> Lesson:
    uniform = np.random.default_rng(8).random
    return rules.policy_gradient(trial, neuron, weights, uniform, baseline=-0.5).lesson


EVERY_RULE: dict[str, Callable[[Trial, Spec, Floats], Lesson]] = {
    "critical": rules.critical_threshold,
    "critical_amount": partial(rules.critical_threshold, amount=True),
    "critical_crossing": partial(rules.critical_threshold, at="crossing"),
    "mpdal": rules.mpdal,
    "peak_error": rules.peak_error,
    "peak_error_first": partial(rules.peak_error, first_only=True),
    "superspike": rules.surrogate_gradient,
    "triangle_on_count": partial(rules.surrogate_gradient, surrogate="triangle", on_count=True),
    "resume": rules.resume,
    "resume_even": partial(rules.resume, times="even"),
    "psd": rules.psd,
    "span": rules.span,
    "chronotron_e": partial(rules.chronotron, tau_q=5.0),
    "chronotron_i": partial(rules.chronotron, rule="I", times="even"),
    "stdp": rules.stdp,
    "mstdpet": rules.mstdpet,
}


@pytest.mark.parametrize("rule", EVERY_RULE)
@pytest.mark.parametrize("name", ["gnm", "gnm_recovers", "gnm_reads_D", "lif_pauses", "mst"])
def test_a_silent_channel_learns_nothing_whatever_the_label(name: str, rule: str) -> None:
    lessons = 0
    for case in cases(NEURONS[name], n=12, seed=9):
        raster = case.trial.raster.copy()
        raster[:, 5] = False
        for extra in (-1, 0, 1):  # an error in the label: one spike more or less in the first
            target = [*case.trial.target]
            target[1] = max(0, target[1] + extra)
            trial = Trial(raster, case.trial.edges, target)
            lesson = EVERY_RULE[rule](trial, NEURONS[name], case.weights)
            assert lesson.change[5] == 0.0
            lessons += lesson.teaches and bool(lesson.change.any())
    assert lessons > 5


def test_a_silent_channel_learns_nothing_from_the_policy_gradient_or_the_tempotron() -> None:
    for case in binary_cases(NEURONS["gnm"], n=20):
        raster = case.trial.raster.copy()
        raster[:, 5] = False
        trial = case.trial._replace(raster=raster)
        assert _policy(trial, case.neuron, case.weights).change[5] == 0.0
        assert rules.tempotron(trial, case.neuron, case.weights).change[5] == 0.0


@pytest.mark.parametrize("name", ["gnm", "gnm_forgets", "lif", "mst", "mst_slow"])
@pytest.mark.parametrize("amount", [False, True])
def test_learning_moves_the_count_the_right_way_on_the_very_trial(name: str, amount: bool) -> None:
    """The lesson is repeated with ever larger steps until the count moves: where it first does.

    Other peaks rise and fall with the chosen one, so a trial may disagree; few do.
    """
    right = wrong = 0
    for case in cases(NEURONS[name], n=40, seed=10):
        trial, neuron = case.trial, NEURONS[name]
        lesson = rules.critical_threshold(trial, neuron, case.weights, 1.0, amount)
        if not lesson.teaches:
            continue
        before = len(hear(neuron, trial.raster, case.weights).times)
        for size in np.geomspace(1e-4, 3.0, 60):
            after = len(hear(neuron, trial.raster, case.weights + size * lesson.change).times)
            if after != before:
                toward = (after - before) * (trial.label - before) > 0
                right, wrong = right + toward, wrong + (not toward)
                break
    assert right > 5 and right > 3 * wrong, (right, wrong)


def test_the_description_of_a_neuron_of_the_package_holds_its_fields() -> None:
    for neuron in (GNM(alpha=0.7, readout="D"), LIF(refractory=4), MST(tau_s=3.0)):
        named = SimpleNamespace(name=type(neuron).__name__.lower(), **asdict(neuron))
        assert spec(named) == neuron
