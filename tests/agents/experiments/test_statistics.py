from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

from agents.experiments.heat_maps import Line, best, optimal_line
from agents.experiments.residuals import residuals
from agents.experiments.statistics import (
    Interval,
    bootstrap,
    by_seed,
    improvements,
    interquartile_mean,
    mean,
    median,
    middle_means,
    mistake_rates,
    mistakes_per_thousand,
    score,
    stratified_bootstrap,
    typical_rate,
    wins,
)


def test_a_bootstrap_interval_covers_the_mean_as_often_as_it_says() -> None:
    """95 % intervals of 40 normal numbers cover the mean in 88 … 99 % of 200 samples, false alarm
    below 1e-4 for a method that covers 94 %."""
    rng = np.random.default_rng(0)
    covered = 0
    for _ in range(200):
        found = bootstrap(np.mean, rng.normal(size=40), resamples=300)
        covered += found.low <= 0 <= found.high
    assert 0.88 <= covered / 200 <= 0.99


def test_pairs_stay_pairs() -> None:
    first = np.random.default_rng(1).normal(size=30)
    found = bootstrap(lambda a, b: float(np.mean(a - b)), first, first - 2.0)

    assert found == pytest.approx((2.0, 2.0, 2.0))


def test_one_seed_has_no_interval() -> None:
    assert math.isnan(mean([3.0]).low)
    assert f"{median([3.0]):.1f}" == "3.0 [no interval]"


def test_an_interval_prints_its_ends() -> None:
    assert f"{Interval(1234.4, 999.6, 2000.2):,.0f}" == "1,234 [1,000 … 2,000]"


def test_wins_are_counted_with_an_exact_interval() -> None:
    found = wins(np.r_[np.ones(46), np.zeros(4)], np.full(50, 0.5))

    assert (found.wins, found.pairs, found.share) == (46, 50, 0.92)
    # Clopper and Pearson's interval of 46 of 50, from tables.
    assert (found.low, found.high) == pytest.approx((0.8077, 0.9778), abs=2e-4)
    assert found.p < 1e-8


def test_ties_decide_nothing() -> None:
    assert wins([1.0, 1.0], [1.0, 1.0]).p == 1.0
    assert wins([2.0, 1.0, 1.0], [1.0, 1.0, 1.0]).pairs == 3
    assert wins([2.0, 1.0, 1.0], [1.0, 1.0, 1.0]).high == 1.0


def plane(function: object, seeds: int = 1) -> xr.DataArray:
    eta, alpha = np.linspace(0, 1, 21), np.linspace(0, 1, 41)
    values = np.broadcast_to(function(eta[:, None], alpha[None, :]), (seeds, 21, 41))  # type: ignore[operator]
    return xr.DataArray(
        values,
        {"pattern_seed": np.arange(seeds), "eta": eta, "alpha": alpha},
        ["pattern_seed", "eta", "alpha"],
    )


def test_the_optimal_line_is_found_where_it_was_put() -> None:
    scores = plane(lambda eta, alpha: 1_000 * np.exp(-20 * ((1 - eta) * alpha - 0.3) ** 2))[0]
    line = optimal_line(scores)

    assert line.alpha == pytest.approx(0.3, abs=0.01)
    assert line.score == pytest.approx(1_000, rel=0.01)


def test_a_map_that_is_linear_is_looked_up_exactly() -> None:
    """On a + bα the mean along the line to α = 1 is a + b(1+α*)/2."""
    line = optimal_line(plane(lambda eta, alpha: 100 + 50 * alpha + 0 * eta)[0])

    assert line == pytest.approx(Line(0.5, 137.5))


def test_the_best_cell_names_its_place() -> None:
    cell = best(plane(lambda eta, alpha: -((eta - 0.25) ** 2) - (alpha - 0.6) ** 2)[0])

    assert (cell.eta, cell.alpha) == pytest.approx((0.25, 0.6))


def test_scores_are_means_over_runs_at_any_lower_cap() -> None:
    survived = xr.DataArray([[100, 10_000], [300, 500]], dims=["pattern_seed", "run"])
    data = xr.Dataset({"survived": survived})

    assert by_seed(score(data)).tolist() == [5_050.0, 400.0]
    assert by_seed(score(data, cap=400)).tolist() == [250.0, 350.0]


def test_residuals_compare_the_best_of_each_eta_with_the_best_at_zero() -> None:
    scores = plane(lambda eta, alpha: 1_000 + 100 * alpha - 200 * eta, seeds=2)
    runs = xr.concat([scores - 5, scores + 5], "run").transpose(..., "run")
    residual, error = residuals(xr.Dataset({"survived": runs}))

    np.testing.assert_allclose(residual.sel(pattern_seed=1), -200 * residual["eta"])
    assert float(residual["eta"].min()) == 0.05
    assert float(residual["eta"].max()) == pytest.approx(0.6)
    # sd of ±5 is √50, of the mean of two 5, of a difference of two means √50.
    np.testing.assert_allclose(error, math.sqrt(50))


def test_the_interquartile_mean_forgets_the_outer_quarters() -> None:
    assert interquartile_mean([-1e9, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1e9]) == 3.5
    assert interquartile_mean([[1.0, 2.0], [3.0, 100.0]]) == 2.5


def test_the_probability_of_improvement_compares_every_seed_with_every_other() -> None:
    # 1 beats none of {2, 2, 2}, 2 ties with all, 3 beats all: (0 + 3 · ½ + 3) / 9.
    ladder, flat = np.array([[1.0], [2.0], [3.0]]), np.full((3, 1), 2.0)
    assert improvements(ladder, flat) == pytest.approx(0.5)
    first = np.array([[1.0, 5.0], [1.0, 5.0]])
    second = np.array([[2.0, 4.0], [2.0, 4.0]])
    assert improvements(first, second) == 0.5  # the mean over both tasks
    assert improvements(second[:, :1], first[:, :1]) == 1.0


def test_a_stratified_bootstrap_never_mixes_tasks() -> None:
    sample = np.array([[1.0, 100.0]] * 5)
    assert stratified_bootstrap(middle_means, sample, resamples=50) == (50.5, 50.5, 50.5)
    assert math.isnan(stratified_bootstrap(middle_means, [[1.0, 2.0]]).low)
    with pytest.raises(ValueError, match=r"must have one shape .* take the seeds that all have"):
        stratified_bootstrap(improvements, [1.0, 2.0], [1.0, 2.0, 3.0])


def test_a_stratified_bootstrap_covers_as_often_as_it_says() -> None:
    """Of 200 samples of 40 normal numbers 88 … 99 % of the intervals hold 0, false alarm below
    1e-4 for a method that covers 94 %."""
    rng = np.random.default_rng(5)
    samples = rng.normal(size=(200, 40))
    found = [stratified_bootstrap(middle_means, sample, resamples=300) for sample in samples]
    assert 0.88 <= np.mean([one.low <= 0 <= one.high for one in found]) <= 0.99


def test_the_mistake_rate_of_capped_runs_is_that_of_the_stream() -> None:
    """Exponential survival at 1 mistake in 500 bins, cut at 400: the estimate from 20,000 runs
    has a standard deviation of 0.02; six of them, a false alarm below 1e-8."""
    bins = np.random.default_rng(3).geometric(1 / 500, 20_000) - 1
    assert mistakes_per_thousand(np.minimum(bins, 400), 400) == pytest.approx(2.0, abs=0.12)
    assert mistakes_per_thousand([400, 400], 400) == 0.0


def test_a_neuron_without_mistakes_has_a_rate_and_seeds_count_alike() -> None:
    survived = xr.DataArray(
        [[1_000, 1_000], [10, 30]], dims=("pattern_seed", "run"), name="survived"
    )
    results = xr.Dataset({"survived": survived}, attrs={"settings": {"common": {"cap": 1_000}}})
    rates = mistake_rates(results)
    # The bins of the two mistakes are heard as well: 10 + 30 + 2.
    assert rates.to_numpy() == pytest.approx([0.25, 2_500 / 42])
    assert float(typical_rate(rates)) == pytest.approx((0.25 * 2_500 / 42) ** 0.5)
