"""The LIF against plain Python that resets and waits bin by bin."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from agents import LIF
from tests.agents import reference
from tests.agents.worlds import respond

N = 12


@pytest.mark.parametrize("refractory", [0, 1, 7, 25])
@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
def test_a_trace_is_that_of_the_plain_equations(alpha: float, refractory: int) -> None:
    rng = np.random.default_rng(refractory)
    raster, weights = rng.random((500, N)) < 0.12, rng.random(N)
    neuron = LIF(alpha=alpha, refractory=refractory, theta=1.2)
    heard = respond(neuron, raster, weights)
    expected = reference.lif(reference.drives(raster, weights), **asdict(neuron))
    np.testing.assert_allclose(heard.V, expected.V, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(heard.D, expected.D, rtol=1e-12, atol=1e-14)
    assert np.array_equal(heard.R, expected.R)
    assert np.array_equal(heard.spikes, expected.spikes)
    assert np.array_equal(heard.X, heard.V)
    assert heard.spikes.sum() > 10


def test_numbers_worked_out_by_hand() -> None:
    """α = ½, two refractory bins: a spike at 1.25, two inputs ignored, then a sum from rest."""
    I = [0.75, 0.875, 4.0, 4.0, 0.5, 0.25, 1.0, 9.0]
    heard = respond(LIF(alpha=0.5, refractory=2), np.eye(8, dtype=np.bool_), I)
    assert heard.V.tolist() == [0.75, 1.25, 0.0, 0.0, 0.5, 0.5, 1.25, 0.0]
    assert heard.D.tolist() == [0.0, 0.375, 0.0, 0.0, 0.0, 0.25, 0.25, 0.0]
    assert heard.R.tolist() == [0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 2.0]
    assert np.flatnonzero(heard.spikes).tolist() == [1, 6]


def test_the_potential_that_is_shown_is_the_one_before_the_reset() -> None:
    heard = respond(LIF(alpha=0.5), np.eye(3, dtype=np.bool_), [3.0, 0.0, 0.5])
    assert heard.V.tolist() == [3.0, 0.0, 0.5]
    assert heard.spikes.tolist() == [True, False, False]


def test_without_a_refractory_period_it_spikes_in_every_bin_that_is_driven_enough() -> None:
    heard = respond(LIF(), np.eye(4, dtype=np.bool_), [1.0, 1.0, 0.999, 1.0])
    assert heard.spikes.tolist() == [True, True, False, True]


@pytest.mark.parametrize(
    ("field", "value", "remedy"),
    [
        ("alpha", 1.5, "in 0 … 1"),
        ("alpha", float("nan"), "finite"),
        ("refractory", -1, ">= 0"),
        ("refractory", 2.5, "a whole number"),
        ("theta", 0.0, "> 0"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_remedy(
    field: str, value: Any, remedy: str
) -> None:
    with pytest.raises(ValueError, match=f"^{field} must be .*{value}") as refusal:
        LIF(**{field: value})
    assert remedy in str(refusal.value)


def test_the_pause_after_a_spike_has_an_upper_limit() -> None:
    with pytest.raises(ValueError, match="refractory must be at most 1,000,000,000"):
        LIF(refractory=2**62)
