"""The network in the engine, against the linear theory that it must obey."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from agents.chemistry import Course, ReactionNetwork, Reactor
from agents.continuous import ContinuousGNM, InputSpikes, ReactingGNM, simulate
from tests.marks import timed

pytest.importorskip("roadrunner")
pytest.importorskip("libsbml")

NETWORK = ReactionNetwork(np.array([0.3, 0.9, 0.5, 0.0]), alpha=0.2)
SPIKES = InputSpikes([0.0, 1.0, 1.0, 2.3, 4.0, 4.0, 7.0], [1, 0, 0, 2, 1, 3, 2], 12.0, 4)


def chance(network: ReactionNetwork, t: np.ndarray) -> np.ndarray:
    """For each time and spike: the chance that a molecule of that spike is a V by then.

    It leaves I at rate C, becomes V with chance w, and V decays at rate α.
    """
    C, alpha = network.conversion, network.alpha
    age = np.maximum(t[:, None] - SPIKES.times, 0.0)
    waves = (np.exp(-alpha * age) - np.exp(-C * age)) * C / (C - alpha)
    return network.weights[SPIKES.channels] * waves


def test_the_deterministic_network_is_the_solution_of_its_linear_equations() -> None:
    course = Reactor(NETWORK).deterministic(SPIKES, points_per_bin=10)
    assert course.V.shape == course.t.shape == (121,)
    np.testing.assert_allclose(course.V, chance(NETWORK, course.t).sum(1), atol=1e-7)


def test_the_deterministic_network_is_the_neuron_that_reacts_as_it_does() -> None:
    course = Reactor(NETWORK).deterministic(SPIKES, points_per_bin=500)
    neuron = ReactingGNM(alpha=NETWORK.alpha, conversion=NETWORK.conversion, theta_r=0.5)
    exact = simulate(neuron, NETWORK.weights, SPIKES, course.t)
    np.testing.assert_allclose(course.V, exact.V, atol=1e-7)
    fine = replace(course, theta_r=0.5).S()
    assert fine[-1] > 0.5
    np.testing.assert_allclose(fine, exact.S, atol=0.01)


def test_the_network_approaches_the_neuron_as_one_over_C() -> None:
    neuron = ContinuousGNM(alpha=NETWORK.alpha)
    ends = np.arange(1.0, 13.0)  # of the bins: just before the next spikes
    exact = simulate(neuron, NETWORK.weights, SPIKES, np.nextafter(ends, 0.0))
    errors = []
    for C in (20.0, 40.0, 80.0):
        course = Reactor(replace(NETWORK, conversion=C)).deterministic(SPIKES, 10)
        errors.append(np.abs(course.V[10::10] - exact.V).max())
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(order, 1.0, atol=0.1)


def test_molecules_are_counted_exactly() -> None:
    """Mean and variance of 1,000 runs: each molecule is a V or not, independently of the others.

    Both are tested at three times; a test of five standard errors is wrong once in 10^5.
    """
    molecules, runs = 20, 1_000
    course = Reactor(NETWORK).stochastic(SPIKES, molecules, runs, seed=1, points_per_bin=1)
    assert course.V.shape == (runs, 13)
    at = [2, 5, 9]
    p = chance(NETWORK, course.t[at])
    mean, variance = p.sum(1), (p * (1.0 - p)).sum(1) / molecules
    V = course.V[:, at]
    assert np.all(np.abs(V.mean(0) - mean) < 5.0 * np.sqrt(variance / runs))
    assert np.all(np.abs(V.var(0, ddof=1) / variance - 1.0) < 5.0 * np.sqrt(2.0 / runs))
    assert np.array_equal(np.rint(course.V * molecules), course.V * molecules)


def test_the_mean_of_many_runs_is_the_deterministic_solution() -> None:
    """1,000 runs of fixed seed: within three standard errors, the time average too."""
    reactor = Reactor(NETWORK)
    course = reactor.stochastic(SPIKES, 25, 1_000, seed=3, points_per_bin=1)
    expected = reactor.deterministic(SPIKES, 1).V
    error = course.V.std(0, ddof=1) / np.sqrt(1_000)
    assert np.all(np.abs(course.V.mean(0) - expected) <= 3.0 * error)
    average = course.V.mean(1)
    within = 3.0 * average.std(ddof=1) / np.sqrt(1_000)
    assert abs(average.mean() - expected.mean()) <= within


def test_more_molecules_make_less_noise() -> None:
    reactor = Reactor(NETWORK)
    few, many = (reactor.stochastic(SPIKES, m, 200, points_per_bin=1).V[:, 5] for m in (4, 400))
    assert few.std() / many.std() == pytest.approx(10.0, rel=0.35)


def test_a_run_depends_on_its_seed_and_number_alone() -> None:
    reactor = Reactor(NETWORK)
    three = reactor.stochastic(SPIKES, 50, 3, seed=5, points_per_bin=2)
    again = Reactor(NETWORK).stochastic(SPIKES, 50, 2, seed=5, points_per_bin=2)
    assert np.array_equal(three.V[:2], again.V)
    assert not np.array_equal(three.V[0], three.V[1])
    assert not np.array_equal(three.V, reactor.stochastic(SPIKES, 50, 3, 6, 2).V)


def test_S_is_the_area_under_V_above_the_threshold() -> None:
    t = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    V = np.array([[0.5, 1.5, 2.5, 1.5, 0.5], [1.0, 1.0, 1.0, 1.0, 1.0]])
    S = Course(t, V, theta_r=1.0).S()
    np.testing.assert_allclose(S[0], [0.0, 0.375, 1.375, 2.375, 2.75])
    np.testing.assert_allclose(S[1], 0.0)


def test_S_of_a_fine_course_is_that_of_the_neuron() -> None:
    neuron = ContinuousGNM(alpha=0.2, theta_r=0.5)
    network = replace(NETWORK, theta_r=0.5, conversion=2_000.0)
    course = Reactor(network).deterministic(SPIKES)
    exact = simulate(neuron, network.weights, SPIKES).S[-1]
    assert exact > 1.0
    assert course.S()[-1] == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"molecules": 0}, "molecules must be >= 1"),
        ({"molecules": 2.5}, "molecules must be a whole number"),
        ({"molecules": 5, "runs": 0}, "runs must be >= 1"),
        ({"molecules": 5, "seed": -1}, "seed must be >= 0"),
        ({"molecules": 5, "points_per_bin": 0}, "points_per_bin must be >= 1"),
    ],
)
def test_bad_numbers_are_refused(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Reactor(NETWORK).stochastic(SPIKES, **arguments)


def full_size(bins: int = 250) -> tuple[Reactor, InputSpikes]:
    """100 channels with weights as training leaves them, and a trial of that many bins."""
    rng = np.random.default_rng(0)
    times, channels = np.nonzero(rng.random((bins, 100)) < 0.005)
    spikes = InputSpikes(times.astype(float), channels, float(bins), 100)
    return Reactor(ReactionNetwork(0.3 * rng.random(100), alpha=0.2)), spikes


@timed
def test_a_hundred_runs_of_500_molecules_take_half_a_minute_at_most() -> None:
    reactor, spikes = full_size()
    began = time.process_time()
    reactor.stochastic(spikes, 500, 100)
    assert time.process_time() - began < 30.0


@pytest.mark.slow
def test_the_mean_of_a_thousand_full_runs_is_the_deterministic_solution() -> None:
    """At full size, 25 molecules. Of 250 bins, which are far from independent, 98 % at least lie
    within three standard errors (99.7 % are expected), and so does the average over time."""
    reactor, spikes = full_size()
    course = reactor.stochastic(spikes, 25, 1_000, seed=1, points_per_bin=1)
    expected = reactor.deterministic(spikes, 1).V
    error = course.V.std(0, ddof=1) / np.sqrt(1_000)
    within = np.abs(course.V.mean(0) - expected) <= 3.0 * error
    assert within.mean() >= 0.98
    average = course.V.mean(1)
    assert abs(average.mean() - expected.mean()) <= 3.0 * average.std(ddof=1) / np.sqrt(1_000)
