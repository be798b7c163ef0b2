"""The teaching signal that is shown is the one that teaches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import GNM, MST, AggregateLabel, ErrorTrace, NeuronAgent
from agents.explorer.teaching import emitted, teaching_signal, undone
from agents.model import PSPKernel
from agents.registry import find_rule
from gnm_env import Trial, draw_trial
from gnm_env.trial_task.info import info_of
from tests.agents.worlds import BUSY, BUSY_PATTERNS

OWN_RULES = Path(__file__).parents[1] / "own" / "my_rules.py"
OwnTempotron: Any = find_rule(f"{OWN_RULES}:OwnTempotron")


def trial(seed: int) -> Trial:
    return draw_trial(BUSY, BUSY_PATTERNS, np.random.default_rng(seed))


def eligibility(heard: Trial, y: Any, kernel: PSPKernel) -> Any:
    """Σ_t x_i(t) y(t), by the definition, slowly."""
    lags = np.arange(heard.n_bins)
    response = kernel.slow**lags
    if kernel.biexponential:
        response = kernel.scale * (response - kernel.fast**lags)
    traces = [np.convolve(row, response)[: heard.n_bins] for row in heard.dense().T.astype(float)]
    return np.array([trace @ y for trace in traces])


@pytest.mark.parametrize(
    ("neuron", "rule"),
    [
        (GNM(), ErrorTrace(1e-3, momentum=0.0)),
        (MST(), ErrorTrace(1e-3, momentum=0.0, modulate=True)),
        (GNM(), OwnTempotron(1e-3, momentum=0.0)),
    ],
    ids=["GNM, ET", "MST, ET modulated", "GNM, a rule that sees the whole trial"],
)
def test_weights_change_by_the_sum_of_traces_times_the_signal(neuron: Any, rule: Any) -> None:
    taught = 0
    for seed in range(4):
        heard = trial(seed)
        agent = NeuronAgent(neuron, rule, BUSY.n_inputs, 0, 0.5, weight_bounds=None)
        y = teaching_signal(agent, heard)
        before = agent.weights.copy()
        given = emitted(agent, heard.dense())
        agent.learn(-abs(heard.label - given), info_of(heard, given))
        expected = 1e-3 * eligibility(heard, y, rule.kernel(neuron))
        np.testing.assert_allclose(agent.weights - before, expected, rtol=1e-6, atol=1e-9)
        taught += bool(np.any(expected))
    assert taught > 0


@pytest.mark.parametrize(("weight", "sign"), [(0.0, 1.0), (0.1, 1.0), (0.8, -1.0)])
def test_of_all_it_is_the_potential_with_the_sign_of_the_error(weight: float, sign: float) -> None:
    heard = next(one for one in map(trial, range(50)) if one.label > 2)
    agent = NeuronAgent(GNM(alpha=1.0), AggregateLabel(fraction=0.25), BUSY.n_inputs, 0, 0.0)
    agent.weights = weight if weight < 0.5 else 5.0
    if sign < 0:  # each input spike after a silent bin is an output spike: far too many
        assert emitted(agent, heard.dense()) > heard.label
    np.testing.assert_allclose(teaching_signal(agent, heard), sign * agent.record(heard).V)


def test_a_trial_that_is_answered_rightly_teaches_nothing() -> None:
    silence = Trial.from_dense(np.zeros((30, BUSY.n_inputs), bool), [], [], BUSY)
    agent = NeuronAgent(GNM(), ErrorTrace(), BUSY.n_inputs)
    y = teaching_signal(agent, silence)
    assert y is not None and not y.any()


@pytest.mark.parametrize("kernel", [PSPKernel(0.7), PSPKernel(0.95, 0.8, 2.0, True)])
def test_undoing_the_trace_gives_the_signal_back(kernel: PSPKernel) -> None:
    y = np.random.default_rng(0).normal(size=40)
    y[0] = 0.0  # teaches nothing where the trace begins at 0
    lags = np.arange(40)
    x = kernel.slow**lags
    if kernel.biexponential:
        x = kernel.scale * (x - kernel.fast**lags)
    sums = np.array([x[: 40 - t] @ y[t:] for t in range(40)])
    np.testing.assert_allclose(undone(sums, kernel), y, atol=1e-9)
