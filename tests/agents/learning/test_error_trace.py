"""ET: Δ_i = λ Σ_t x_i(t) E(t), with E(t) worked out directly from the spikes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from agents import GNM, LIF, MST, AggregateLabel, ErrorTrace, NeuronAgent
from agents.neurons.neuron import Neuron
from gnm_env import Task, Trial, draw_trial
from tests.agents import reference
from tests.agents.worlds import BUSY, BUSY_PATTERNS, BUSY_WEIGHT, play

LAMBDA = 0.003

SATURATED = GNM(alpha=0.1)
"""In the busy world it is above threshold for many bins on end."""


@pytest.mark.parametrize("modulate", [False, True], ids=["plain", "modulated"])
@pytest.mark.parametrize(
    ("neuron", "trace_decay"),
    [
        (GNM(), None),
        (GNM(), 0.0),
        (GNM(), 0.3),
        (SATURATED, None),
        (GNM(alpha=0.5, readout="D", theta_r=0.3), None),
        (LIF(refractory=4), None),
        (MST(), None),
    ],
    ids=str,
)
def test_weights_follow_the_error_trace(
    neuron: Neuron, trace_decay: float | None, modulate: bool
) -> None:
    rule = ErrorTrace(LAMBDA, modulate=modulate, trace_decay=trace_decay)
    rng, noise_errors, missing, spare = np.random.default_rng(1), 0, 0, 0
    for _ in range(25):
        trial = draw_trial(BUSY, BUSY_PATTERNS, rng)
        raster = trial.dense()
        agent = NeuronAgent(neuron, rule, BUSY.n_inputs, weight_bounds=None)
        weights = agent.weights = rng.random(BUSY.n_inputs) * BUSY_WEIGHT[neuron.name]
        spikes = play(agent, trial)

        drive = reference.drives(raster, weights)
        if isinstance(neuron, GNM):
            expected = reference.gnm(drive, **asdict(neuron))
            kernel = reference.decay_kernel(1.0 - neuron.alpha, trial.n_bins)
            X = expected.V if neuron.readout == "V" else expected.D
        elif isinstance(neuron, LIF):
            expected = reference.lif(drive, **asdict(neuron))
            kernel = reference.decay_kernel(1.0 - neuron.alpha, trial.n_bins)
            X = expected.V
        else:
            assert isinstance(neuron, MST)
            expected = reference.mst(raster, weights, **asdict(neuron))
            kernel = reference.mst_kernel(np.arange(trial.n_bins), neuron.tau_m, neuron.tau_s)
            X = expected.V
        assert np.array_equal(spikes, expected.spikes)
        if trace_decay is not None:
            kernel = reference.decay_kernel(trace_decay, trial.n_bins)
        above = neuron.threshold <= X
        E = reference.error_trace(spikes, above, trial.onsets, trial.targets, trial.pattern_bins)
        signal = E * expected.V if modulate else E
        change = LAMBDA * reference.eligibilities(raster, kernel, signal)
        np.testing.assert_allclose(agent.velocity, change, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(agent.weights, weights + change, rtol=1e-9)

        in_noise = trial.owner() < 0
        noise_errors += int((E[in_noise] != 0).sum())
        missing += int((E > 0).any())
        spare += int((E[~in_noise] < 0).any())
    assert min(noise_errors, missing) > 0, "the trials should hold errors in noise and in patterns"
    assert spare > 0 or neuron == SATURATED, "… and too many spikes as well as too few"


TASK = Task(n_inputs=2, pattern_bins=5)


def quiet_trial(spikes_of_one: list[int], onset: int = 10) -> Trial:
    """30 bins in which channel 1 spikes where it is told; the occurrence owes one output spike."""
    raster = np.zeros((30, 2), np.bool_)
    raster[spikes_of_one, 1] = True
    return Trial.from_dense(raster, [onset], [0], TASK)


def agent_with(rule: Any, **keywords: Any) -> NeuronAgent:
    agent = NeuronAgent(GNM(alpha=1.0), rule, 2, weight_bounds=None, **keywords)
    agent.weights = [0.0, 2.0]
    return agent


def test_a_trial_whose_sum_is_right_but_whose_timing_is_not_does_teach() -> None:
    """One spike is owed and one is given, but in noise: E is +1 in the pattern, −1 there."""
    trial = quiet_trial([2])
    agent = agent_with(ErrorTrace(LAMBDA))
    assert play(agent, trial).sum() == trial.label == 1
    # α = 1: a spike's trace is one bin long, and that bin holds E = −1.
    assert agent.velocity.tolist() == [0.0, -LAMBDA]

    by_label = agent_with(AggregateLabel(LAMBDA, fraction=0.5))
    play(by_label, trial)
    assert not by_label.velocity.any()


def test_every_noise_bin_above_threshold_counts_not_only_the_crossing() -> None:
    agent = agent_with(ErrorTrace(LAMBDA))
    spikes = play(agent, quiet_trial([2, 3, 4, 11]))
    assert np.flatnonzero(spikes).tolist() == [2, 11]
    assert agent.velocity.tolist() == [0.0, -3 * LAMBDA]


def test_exactly_at_threshold_is_an_error_in_noise() -> None:
    agent = agent_with(ErrorTrace(LAMBDA))
    agent.weights = [0.0, 1.0]
    play(agent, quiet_trial([2, 11]))
    assert agent.velocity.tolist() == [0.0, -LAMBDA]


def test_nothing_changes_where_every_answer_is_right_the_momentum_included() -> None:
    agent = agent_with(ErrorTrace(LAMBDA))
    agent.velocity[:] = 0.5
    play(agent, quiet_trial([11]))
    assert agent.weights.tolist() == [0.0, 2.0]
    assert agent.velocity.tolist() == [0.5, 0.5]


def test_modulated_it_learns_nothing_from_a_potential_of_zero_but_plain_it_does() -> None:
    plain, modulated = (
        NeuronAgent(GNM(), ErrorTrace(LAMBDA, modulate=m), 2, initial_weight=0.0)
        for m in (False, True)
    )
    for agent in (plain, modulated):
        play(agent, quiet_trial([2, 11]))
    assert plain.weights[1] > 0
    assert not modulated.weights.any()


def test_occurrences_that_touch_are_told_apart() -> None:
    """Two occurrences side by side: the first is answered, the second is not."""
    raster = np.zeros((30, 2), np.bool_)
    raster[[6, 12], [1, 0]] = True
    agent = agent_with(ErrorTrace(LAMBDA))
    play(agent, Trial.from_dense(raster, [5, 10], [0, 0], TASK))
    assert agent.velocity.tolist() == [LAMBDA, 0.0]


def test_whether_to_modulate_must_be_true_or_false() -> None:
    with pytest.raises(ValueError, match="modulate must be True or False, got 'V'"):
        ErrorTrace(modulate="V")  # type: ignore[arg-type]
