"""The GNM against SciPy, a plain transcription of its equations, and hand-worked numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from agents import GNM
from tests.agents import reference
from tests.agents.worlds import respond

N = 12


@pytest.fixture(scope="module")
def raster() -> NDArray[np.bool_]:
    return np.random.default_rng(4).random((600, N)) < 0.12


@pytest.fixture(scope="module")
def weights() -> NDArray[np.float64]:
    return np.random.default_rng(5).random(N) * 0.7


@pytest.mark.parametrize("alpha", [0.0, 0.05, 0.3, 1.0])
def test_without_spikiness_the_potential_is_an_exponential_filter_of_the_input(
    alpha: float, raster: NDArray[np.bool_], weights: NDArray[np.float64]
) -> None:
    heard = respond(GNM(alpha=alpha, eta=0.0), raster, weights)
    I = np.array(reference.drives(raster, weights))
    V = lfilter([1.0], [1.0, -(1.0 - alpha)], I)
    np.testing.assert_allclose(heard.V, V, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(heard.D, alpha * np.append(0.0, V[:-1]), rtol=1e-10, atol=1e-12)
    assert np.array_equal(heard.spikes, reference.crossings(V, 1.0))
    if alpha == 0.3:
        assert 20 < heard.spikes.sum() < 200


@pytest.mark.parametrize("readout", ["V", "D"])
@pytest.mark.parametrize("h", [200.0, np.inf, 7.3, 1.0, 5000.0])
@pytest.mark.parametrize(
    "parameters",
    [
        {"eta": 0.5},
        {"alpha": 0.2, "eta": 1.0, "beta": 0.15, "gamma": 0.6},
        {"alpha": 0.7, "eta": 0.3, "beta": 0.9, "gamma": 0.8, "zeta": 0.4, "theta_b": 1.4},
    ],
)
def test_with_spikiness_a_trace_is_that_of_the_plain_equations(
    parameters: dict[str, float],
    h: float,
    readout: str,
    raster: NDArray[np.bool_],
    weights: NDArray[np.float64],
) -> None:
    neuron = GNM(**parameters, h=h, readout=readout, theta_r=0.8 if readout == "V" else 0.3)  # type: ignore[arg-type]
    heard = respond(neuron, raster, weights)
    expected = reference.gnm(reference.drives(raster, weights), **asdict(neuron))
    # The flat parts of the Hill function are cut at 2⁻⁶⁰: absolute, not relative, below that.
    for name in ("V", "D", "R"):
        np.testing.assert_allclose(
            getattr(heard, name), getattr(expected, name), rtol=1e-9, atol=1e-13, err_msg=name
        )
    assert np.array_equal(heard.X, heard.V if readout == "V" else heard.D)
    assert np.array_equal(heard.spikes, expected.spikes)
    assert 10 < heard.spikes.sum() < 300, "the trace should cross the threshold now and then"
    assert heard.R.max() > 0.05, "the trace should exercise the reset"


def test_numbers_worked_out_by_hand() -> None:
    """α = β = η = ½, h = ∞: every number is a short binary fraction and must come out exactly.

    D = ½ R V + ¼ V; V += I − D; R += H(V) − ½ R, all from the bin before. The first V is *exactly*
    ϑ_B, where H is ½.
    """
    I = [1.0, 0.0, 0.5, 0.5, 2.0]
    raster = np.eye(5, dtype=np.bool_)
    heard = respond(GNM(alpha=0.5, eta=0.5, beta=0.5, h=np.inf), raster, I)
    # V(2): D = ½·½·¾ + ¼·¾ = 3/8, ¾ + ½ − 3/8 = 7/8.  V(3): D = ½·¼·7/8 + ¼·7/8 = 21/64.
    # V(4): D = ½·⅛·67/64 + ¼·67/64 = 335/1024, and R = ⅛ + H(67/64) − 1/16 = 17/16.
    assert heard.V.tolist() == [1.0, 3 / 4, 7 / 8, 67 / 64, 67 / 64 + 2 - 335 / 1024]
    assert heard.D.tolist() == [0.0, 1 / 4, 3 / 8, 21 / 64, 335 / 1024]
    assert heard.R.tolist() == [0.0, 1 / 2, 1 / 4, 1 / 8, 17 / 16]
    assert heard.spikes.tolist() == [True, False, False, True, False]


@pytest.mark.parametrize("h", [1.0, 3.0, 200.0, 7.3, 0.3e6])
def test_the_hill_function_is_one_half_at_its_threshold_whatever_the_exponent(h: float) -> None:
    neuron = GNM(alpha=0.0, eta=0.5, beta=0.0, h=h, theta_b=0.7)
    heard = respond(neuron, np.eye(2, dtype=np.bool_), [0.7, 0.0])
    assert heard.R[1] == 0.5


@pytest.mark.parametrize("theta_b", [0.7, 1.0, 1.3])
@pytest.mark.parametrize("h", [1.0, 3.0, 200.0])
def test_the_hill_function_has_the_bits_of_its_formula_where_it_turns_flat(
    h: float, theta_b: float
) -> None:
    neuron = GNM(alpha=0.0, eta=0.5, beta=0.0, h=h, theta_b=theta_b)
    flat_below, flat_above = 2.0 ** (-60.0 / h), 2.0 ** (54.0 / h)
    for centre in (flat_below * theta_b, theta_b, flat_above * theta_b):
        for ulps in range(-12, 13):
            V = centre + ulps * np.spacing(centre)
            u = V / theta_b
            H = 1.0 if u > 1.0 else 0.0
            if flat_below < u < flat_above:
                H = power_by_squaring(u, int(h)) / (1.0 + power_by_squaring(u, int(h)))
            assert respond(neuron, np.eye(2, dtype=np.bool_), [V, 0.0]).R[1] == H, (V, ulps)


def power_by_squaring(x: float, exponent: int) -> float:
    result = 1.0
    while exponent:
        if exponent & 1:
            result *= x
        x *= x
        exponent >>= 1
    return result


def test_the_reset_variable_stays_at_rest_below_zero() -> None:
    heard = respond(GNM(eta=0.5, h=2.0), np.eye(3, dtype=np.bool_), [-3.0, -3.0, 1.0])
    assert heard.V[0] == -3.0
    assert heard.R.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("drive", "spikes"),
    [
        ([1.0, 0.0, 0.0], [1, 0, 0]),  # exactly the threshold, in the very first bin
        ([0.999, 0.001, 0.0], [0, 1, 0]),  # risen to it
        ([2.0, 0.0, 3.0], [1, 0, 0]),  # above, and higher still: no second crossing
        ([2.0, -1.5, 0.5], [1, 0, 1]),  # down and up again
        ([-5.0, 2.0, 3.0], [0, 0, 0]),
    ],
)
def test_a_spike_is_an_upward_crossing_of_the_readout(
    drive: list[float], spikes: list[int]
) -> None:
    heard = respond(GNM(alpha=0.0), np.eye(3, dtype=np.bool_), drive)
    assert heard.V.tolist() == np.cumsum(drive).tolist()
    assert heard.spikes.astype(int).tolist() == spikes


def test_readout_d_fires_where_the_decay_crosses_a_bin_after_the_potential() -> None:
    neuron = GNM(alpha=0.5, readout="D", theta_r=1.0)
    heard = respond(neuron, np.eye(4, dtype=np.bool_), [2.0, 0.0, 1.0, 0.0])
    assert heard.V.tolist() == [2.0, 1.0, 1.5, 0.75]
    assert heard.X.tolist() == [0.0, 1.0, 0.5, 0.75]
    assert heard.spikes.tolist() == [False, True, False, False]


@pytest.mark.parametrize(
    ("field", "value", "remedy"),
    [
        ("alpha", -0.1, "in 0 … 1"),
        ("alpha", 1.1, "in 0 … 1"),
        ("eta", 1.5, "in 0 … 1"),
        ("eta", float("nan"), "finite"),
        ("beta", -1.0, "in 0 … 1"),
        ("gamma", -1.0, ">= 0"),
        ("zeta", float("inf"), "finite"),
        ("theta_b", 0.0, "> 0"),
        ("theta_r", -1.0, "> 0"),
        ("h", 0.5, ">= 1"),
        ("h", float("nan"), "finite"),
        ("h", "steep", "a number"),
        ("readout", "W", "'V', 'D'"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_remedy(
    field: str, value: Any, remedy: str
) -> None:
    with pytest.raises(ValueError, match=f"^{field} must be .*{value}") as refusal:
        GNM(**{field: value})
    assert remedy in str(refusal.value)
