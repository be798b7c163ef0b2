"""The MST against the direct double sum over all input spikes and all of its own."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from agents import MST
from tests.agents import reference
from tests.agents.worlds import respond

N = 12


@pytest.mark.parametrize(
    "parameters", [{}, {"tau_m": 7.5, "tau_s": 7.0}, {"tau_m": 50.0, "tau_s": 0.5, "theta": 2.0}]
)
def test_a_trace_is_the_double_sum_over_the_history(parameters: dict[str, float]) -> None:
    rng = np.random.default_rng(6)
    raster, weights = rng.random((400, N)) < 0.1, rng.random(N) * 0.25
    neuron = MST(**parameters)
    heard = respond(neuron, raster, weights)
    expected = reference.mst(raster, weights, **asdict(neuron))
    for name in ("V", "D", "R"):
        np.testing.assert_allclose(
            getattr(heard, name), getattr(expected, name), rtol=1e-9, atol=1e-11, err_msg=name
        )
    assert np.array_equal(heard.spikes, expected.spikes)
    assert heard.spikes.sum() > 5


def test_a_unit_spike_raises_the_potential_to_one_at_its_peak() -> None:
    """The peak of the response lies at ln(k) τ_m τ_s / (τ_m − τ_s); here that is a whole bin."""
    tau_m, peak = 20.0, 9
    tau_s = next(
        s for s in np.linspace(4.0, 6.0, 200_001)
        if abs(math.log(tau_m / s) * tau_m * s / (tau_m - s) - peak) < 1e-4
    )  # fmt: skip
    raster = np.zeros((60, 1), np.bool_)
    raster[0] = True
    heard = respond(MST(tau_m=tau_m, tau_s=float(tau_s), theta=2.0), raster, [1.0])
    assert heard.V[0] == 0.0
    assert np.argmax(heard.V) == peak
    assert heard.V[peak] == pytest.approx(1.0, abs=1e-9)


def test_its_own_spike_takes_the_threshold_off_and_decays_with_the_membrane() -> None:
    raster = np.zeros((40, 1), np.bool_)
    raster[0] = True
    heard = respond(MST(), raster, [1.5])
    spike = int(np.flatnonzero(heard.spikes)[0])
    assert heard.spikes.sum() == 1
    lags = np.arange(40 - spike - 1) + 1
    assert not heard.D[: spike + 1].any()
    np.testing.assert_allclose(heard.D[spike + 1 :], np.exp(-lags / 20.0), rtol=1e-12)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"tau_m": 0.0}, r"tau_m must be > 0, got 0.0"),
        ({"tau_s": -1.0}, r"tau_s must be > 0, got -1.0"),
        ({"tau_s": 20.0}, r"tau_s must be smaller than tau_m = 20, got 20"),
        ({"tau_m": 4.0}, r"tau_s must be smaller than tau_m = 4, got 5"),
        ({"theta": 0.0}, r"theta must be > 0, got 0.0"),
        ({"tau_m": float("inf")}, r"tau_m must be finite, got inf"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_remedy(
    parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        MST(**parameters)


@pytest.mark.parametrize(("tau_m", "tau_s"), [(1e308, 1e-308), (20.0, 5e-324), (1e20, 1e19)])
def test_time_constants_that_leave_no_response_are_refused(tau_m: float, tau_s: float) -> None:
    with pytest.raises(ValueError, match="must leave a response to a spike"):
        MST(tau_m=tau_m, tau_s=tau_s)
