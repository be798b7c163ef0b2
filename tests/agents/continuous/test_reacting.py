"""The neuron whose input takes time to react: its course, its bins, what it learns and refuses."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import AggregateLabel, load_checkpoint, train, train_many
from agents.continuous import (
    ContinuousAgent,
    ContinuousGNM,
    InputSpikes,
    ReactingGNM,
    reference,
    simulate,
)
from gnm_env import Patterns, Task, draw_trial
from tests.agents.continuous.inputs import random_input

TASK = Task(n_inputs=30, n_classes=2, rate=0.02, pattern_bins=20, background_bins=40)
PATTERNS = Patterns.draw(TASK, seed=4)


def make(seed: int = 0, **neuron: float) -> ContinuousAgent:
    return ContinuousAgent(
        ReactingGNM(**neuron), AggregateLabel(), TASK.n_inputs, seed, initial_weight=0.5
    )


@pytest.mark.parametrize(("alpha", "conversion"), [(0.2, 10.0), (0.3, 1.0), (2.0, 0.5)])
def test_the_course_agrees_with_scipy(alpha: float, conversion: float) -> None:
    from scipy.integrate import solve_ivp

    spikes, weights = random_input(seed=1, duration=25.0)
    neuron = ReactingGNM(alpha=alpha, conversion=conversion, theta_r=0.2)
    at = np.linspace(0.0, spikes.duration, 60)
    course = simulate(neuron, weights, spikes, at)
    assert course.S[-1] > 1.0  # the threshold is crossed, or nothing is tested

    def equations(t: float, y: np.ndarray) -> list[float]:
        V, J, _ = y
        return [conversion * J - alpha * V, -conversion * J, V if V > neuron.theta_r else 0.0]

    y, now, found = np.zeros(3), 0.0, []
    for stop in np.unique(np.concatenate([spikes.times, at])):
        if stop > now:
            # Short steps find where V passes the threshold.
            solution = solve_ivp(
                equations, (now, stop), y, "RK45", rtol=1e-8, atol=1e-10, max_step=2e-3
            )
            y, now = solution.y[:, -1].copy(), stop
        y[1] += weights[spikes.channels[spikes.times == stop]].sum()
        if stop in at:
            found.append(y.copy())
    V, J, S = np.array(found).T
    np.testing.assert_allclose(course.V, V, atol=1e-6)
    np.testing.assert_allclose(course.R, J, atol=1e-6)
    np.testing.assert_allclose(course.S, S, atol=1e-2)


def test_one_spike_gives_the_area_between_its_two_crossings() -> None:
    from scipy.integrate import quad
    from scipy.optimize import brentq

    neuron = ReactingGNM(alpha=0.5, conversion=4.0)

    def V(t: float) -> float:
        return float(2.0 * 4.0 / 3.5 * (np.exp(-0.5 * t) - np.exp(-4.0 * t)))

    up, down = (brentq(lambda t: V(t) - 1.0, *ends, xtol=1e-14) for ends in ((0, 0.6), (0.6, 9)))
    area, _ = quad(V, up, down, epsabs=1e-13)
    course = simulate(neuron, [2.0], InputSpikes([0.0], [0], 9.0, 1), [1.5, 9.0])
    np.testing.assert_allclose(course.V[0], V(1.5), rtol=1e-14)
    np.testing.assert_allclose(course.S[1], area, rtol=1e-12)


def test_with_a_fast_reaction_it_is_the_continuous_neuron() -> None:
    spikes, weights = random_input(seed=2, duration=20.0)
    at = np.arange(0.5, 20.0)
    exact = simulate(ContinuousGNM(alpha=0.2), weights, spikes, at)
    errors = [
        np.abs(simulate(ReactingGNM(alpha=0.2, conversion=C), weights, spikes, at).S - exact.S)
        for C in (1e3, 1e4)
    ]
    assert errors[1].max() < 1e-2
    assert errors[0].max() / errors[1].max() == pytest.approx(10.0, rel=0.2)


def test_amounts_handed_out_bin_by_bin_are_those_of_the_whole_course() -> None:
    agent, rng = make(alpha=0.15, conversion=3.0), np.random.default_rng(5)
    agent.weights = rng.uniform(-0.1, 0.8, TASK.n_inputs).clip(0.0)
    trial = draw_trial(TASK, PATTERNS, rng)
    at = np.arange(trial.n_bins + 1.0)
    S = simulate(agent.neuron, agent.weights, InputSpikes.from_trial(trial), at).S
    agent.begin_trial()
    handed = [agent.act(bits) for bits in trial.dense().astype(np.int8)]
    assert S[-1] > 1.0
    np.testing.assert_allclose(handed, np.diff(S), atol=1e-12)


def test_the_loop_and_the_compiled_trainer_end_with_the_same_bits() -> None:
    looped, others = make(), [make(seed) for seed in (5, 0)]
    env = gym.make("gnm/PatternTrial-v0", task=TASK, patterns=PATTERNS, output="graded")
    train(looped, env, trials=12, seed=3)
    train_many(others, TASK, PATTERNS, trials=12, seed=3)
    assert np.array_equal(looped.weights, others[1].weights)
    assert not np.array_equal(looped.weights, make().weights)


def test_a_checkpoint_keeps_the_reaction(tmp_path: Path) -> None:
    agent = make(conversion=7.0)
    agent.save(tmp_path / "agent.npz", task=TASK, patterns=PATTERNS)
    assert load_checkpoint(tmp_path / "agent.npz").agent.neuron == ReactingGNM(conversion=7.0)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"conversion": 0.0}, "conversion must be > 0"),
        ({"eta": 0.5}, "eta must be 0, got 0.5"),
        ({"alpha": 2.0, "conversion": 2.0}, "conversion must differ from alpha, got 2"),
    ],
)
def test_bad_numbers_are_refused(numbers: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ReactingGNM(**numbers)


def test_the_reference_is_for_input_that_acts_at_once() -> None:
    spikes, weights = random_input(seed=1)
    with pytest.raises(ValueError, match=r"reference takes a ContinuousGNM.* got ReactingGNM"):
        reference(ReactingGNM(), weights, spikes)
