"""Between input spikes: the closed form, the Runge–Kutta steps, and what they agree with."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents import GNM, AggregateLabel, NeuronAgent, record
from agents.continuous import ContinuousGNM, InputSpikes, Trajectory, reference, simulate
from gnm_env import Task, Trial
from tests.agents.continuous.inputs import random_input


def deviation(a: Trajectory, b: Trajectory, variables: str) -> float:
    return max(np.abs(getattr(a, name) - getattr(b, name)).max() for name in variables)


def test_one_spike_decays_and_gives_what_pencil_and_paper_say() -> None:
    # V = 2 e^(−t/2) is above 1 until t = 2 ln 2; until then S = (2 − V) / 0.5, at the end 2.
    spikes = InputSpikes([0.5], [0], 6.0, 1)
    crossing = 0.5 + 2.0 * math.log(2.0)
    course = simulate(ContinuousGNM(alpha=0.5), [2.0], spikes, [0.25, 0.5, 1.5, crossing, 6.0])
    V = 2.0 * math.exp(-0.5)
    np.testing.assert_allclose(course.V, [0, 2, V, 1, 2 * math.exp(-2.75)], rtol=1e-14)
    np.testing.assert_allclose(course.S, [0, 0, (2.0 - V) / 0.5, 2, 2], rtol=1e-13)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 2.5])
def test_closed_form_agrees_with_scipy(alpha: float) -> None:
    spikes, weights = random_input(seed=1)
    at = np.linspace(0.0, spikes.duration, 100)
    neuron = ContinuousGNM(alpha=alpha)
    exact = simulate(neuron, weights, spikes, at)
    assert deviation(exact, reference(neuron, weights, spikes, at), "VS") < 1e-8


@pytest.mark.parametrize("h", [4.0, 33.3, 200.0, math.inf])
@pytest.mark.parametrize("eta", [0.5, 1.0])
def test_steps_agree_with_scipy(eta: float, h: float) -> None:
    spikes, weights = random_input(seed=2, duration=20.0)
    at = np.linspace(0.0, spikes.duration, 41)
    neuron = ContinuousGNM(eta=eta, h=h)
    exact = reference(neuron, weights, spikes, at)
    assert exact.S[-1] > 0.5  # the threshold is crossed, or nothing is tested
    assert exact.R.max() > 0.5
    assert deviation(simulate(neuron, weights, spikes, at), exact, "VRS") < 5e-5


def test_halving_the_steps_divides_the_error_by_sixteen() -> None:
    spikes, weights = random_input(seed=2, duration=20.0)
    neuron = ContinuousGNM(eta=0.7, h=math.inf)
    exact = reference(neuron, weights, spikes, rtol=1e-12, atol=1e-13)
    errors = [
        np.abs(simulate(neuron, weights, spikes, steps_per_bin=n).V - exact.V).max()
        for n in (4, 16)
    ]
    order = math.log2(errors[0] / errors[1]) / 2.0
    assert order == pytest.approx(4.0, abs=0.6)


@pytest.mark.parametrize("eta", [0.0, 0.5])
def test_the_discrete_neuron_is_the_limit_of_short_bins(eta: float) -> None:
    """First order: halving the bins halves the distance."""
    grid = 20  # bins in which spikes may fall; finer bins divide these
    rng = np.random.default_rng(3)
    raster = rng.random((grid, 12)) < 0.1
    bins, channels = np.nonzero(raster)
    weights = rng.uniform(0.0, 1.2, 12)
    neuron = ContinuousGNM(eta=eta, h=4.0)
    spikes = InputSpikes(bins.astype(float), channels, float(grid), 12)
    exact = simulate(neuron, weights, spikes, np.arange(grid, dtype=float), steps_per_bin=64)
    errors = []
    for finer in (20, 40, 80):
        V = discrete(neuron, weights, raster, finer)
        S = np.cumsum(np.where(neuron.theta_r < V, V, 0.0)) / finer
        S_before = np.concatenate([[0.0], S])[: grid * finer : finer]
        errors.append((np.abs(V[::finer] - exact.V).max(), np.abs(S_before - exact.S).max()))
    V_error, S_error = np.array(errors).T
    order = np.log2(V_error[:-1] / V_error[1:])
    np.testing.assert_allclose(order, 1.0, atol=0.1)
    # S changes by whole bins where V crosses the threshold: its error falls as the bins, unevenly.
    assert S_error[-1] < 0.6 * S_error[0]
    assert S_error[-1] < 4.0 / 80


def discrete(
    neuron: ContinuousGNM, weights: np.ndarray, raster: np.ndarray, finer: int
) -> np.ndarray:
    """V of the discrete GNM with bins 1/finer long, the rates scaled to them."""
    rates = {name: getattr(neuron, name) / finer for name in ("alpha", "beta", "gamma", "zeta")}
    task = Task(n_inputs=raster.shape[1], background_bins=1)
    agent = NeuronAgent(
        GNM(eta=neuron.eta, h=neuron.h, **rates), AggregateLabel(fraction=1.0), task.n_inputs
    )
    agent.weights = weights
    fine = np.zeros((len(raster) * finer, task.n_inputs), bool)
    fine[::finer] = raster
    return record(agent, Trial.from_dense(fine, [], [], task)).V


def test_spikes_of_a_trial_stand_at_the_beginning_of_their_bins() -> None:
    task = Task(n_inputs=3, background_bins=4)
    raster = np.array([[0, 1, 0], [0, 0, 0], [1, 0, 1], [0, 0, 0]])
    spikes = InputSpikes.from_trial(Trial.from_dense(raster, [], [], task))
    assert spikes.times.tolist() == [0.0, 2.0, 2.0]
    assert spikes.channels.tolist() == [1, 0, 2]
    assert spikes.duration == 4.0


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("alpha", 0.0, "alpha must be > 0"),
        ("alpha", -0.3, "alpha must be > 0"),
        ("beta", -1.0, "beta must be > 0"),
        ("gamma", -1.0, "gamma must be > 0"),
        ("zeta", math.nan, "zeta must be finite"),
        ("eta", 1.1, "eta must be in 0 … 1, got 1.1"),
        ("eta", -0.1, "eta must be in 0 … 1"),
        ("theta_r", 0.0, "theta_r must be > 0"),
        ("h", 0.5, "h must be >= 1"),
        ("max_output", math.inf, "max_output must be finite"),
    ],
)
def test_a_neuron_refuses_what_is_out_of_range(field: str, value: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ContinuousGNM(**{field: value})


def test_rates_above_one_are_allowed() -> None:
    assert ContinuousGNM(alpha=3.0, beta=2.0, gamma=5.0, zeta=4.0).alpha == 3.0


@pytest.mark.parametrize(
    ("times", "channels", "duration", "message"),
    [
        ([3.0, 1.0], [0, 0], 5.0, "in order of time.*spike 1 has 1"),
        ([1.0, 6.0], [0, 0], 5.0, "within the trial, 0 … 5; spike 1 has 6"),
        ([-0.5], [0], 5.0, "within the trial"),
        ([math.nan], [0], 5.0, "within the trial"),
        ([1.0], [2], 5.0, "channels must lie in 0 … 1"),
        ([1.0], [-1], 5.0, "channels must lie in 0 … 1"),
        ([1.0], [0.5], 5.0, "channels must be whole numbers"),
        ([1.0, 2.0], [0], 5.0, "one entry per input spike"),
        ([1.0], [0], 0.0, "duration must be > 0"),
    ],
)
def test_input_spikes_are_refused_out_of_order_or_out_of_range(
    times: list[float], channels: list[float], duration: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        InputSpikes(times, channels, duration, 2)


def test_weights_and_report_times_that_do_not_fit_are_refused() -> None:
    spikes = InputSpikes([1.0], [0], 5.0, 2)
    neuron = ContinuousGNM()
    with pytest.raises(ValueError, match=r"weights must have shape \(2,\)"):
        simulate(neuron, [1.0], spikes)
    with pytest.raises(ValueError, match="weights must be finite, channel 1 is not"):
        simulate(neuron, [1.0, math.nan], spikes)
    for at in ([2.0, 1.0], [6.0]):
        with pytest.raises(ValueError, match="times to report at"):
            simulate(neuron, [1.0, 1.0], spikes, at)
    with pytest.raises(ValueError, match="steps_per_bin must be >= 1"):
        simulate(neuron, [1.0, 1.0], spikes, steps_per_bin=0)
