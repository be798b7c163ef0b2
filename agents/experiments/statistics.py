"""Numbers with their uncertainty.

The sample is the first axis: the pattern seeds, except in F8, whose runs and trials are pooled over
the seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from agents import bootstrap_interval

if TYPE_CHECKING:
    import xarray as xr

RESAMPLES = 2_000


class Interval(NamedTuple):
    """An estimate with its 95 % interval; the ends are NaN where one seed leaves none."""

    value: float
    low: float
    high: float

    def __format__(self, spec: str) -> str:
        ends = (
            f"{self.low:{spec}} … {self.high:{spec}}" if math.isfinite(self.low) else "no interval"
        )
        return f"{self.value:{spec}} [{ends}]"

    def below(self, bound: float) -> bool:
        """Whether the interval, or without one the value, lies below the bound."""
        return (self.high if math.isfinite(self.high) else self.value) < bound

    def above(self, bound: float) -> bool:
        """Whether the interval, or without one the value, lies above the bound."""
        return (self.low if math.isfinite(self.low) else self.value) > bound


class Wins(NamedTuple):
    """How often one of two paired methods was ahead."""

    wins: int
    pairs: int
    low: float
    """Ends of the exact 95 % interval of the share of wins, ties left out …"""
    high: float
    p: float
    """… and p of the two-sided sign test."""

    @property
    def share(self) -> float:
        """Wins per pair."""
        return self.wins / self.pairs

    @property
    def interval(self) -> Interval:
        """The share with its interval."""
        return Interval(self.share, self.low, self.high)

    def __str__(self) -> str:
        return (
            f"{self.wins} of {self.pairs} ({self.share:.0%} [{self.low:.0%} … {self.high:.0%}], p "
            f"= {self.p:.2g})"
        )


def score(results: xr.Dataset, cap: int | None = None) -> xr.DataArray:
    """Noisy performance: bins survived, averaged over the runs; `cap` may lower the run's."""
    survived = results["survived"]
    return (survived if cap is None else survived.clip(max=cap)).mean("run")


def by_seed(values: xr.DataArray, *others: str) -> NDArray[np.float64]:
    """The numbers with the pattern seeds as first axis, and the others in the order given."""
    return values.transpose("pattern_seed", *(others or (...,))).to_numpy()


def counts_of(results: xr.Dataset) -> list[int]:
    """The numbers of classes of a store."""
    return [int(count) for count in results["classes"].to_numpy()]


def counted(classes: int) -> str:
    """A number of classes in words."""
    return f"{classes} class{'es' if classes > 1 else ''}"


def bootstrap(
    statistic: Callable[..., Any], *samples: ArrayLike, resamples: int = RESAMPLES
) -> Interval:
    """`statistic` of samples that share their first axis, with its percentile bootstrap interval.

    The entries along that axis are drawn again together, so that pairs stay pairs.
    """
    arrays = [np.asarray(sample) for sample in samples]
    n = len(arrays[0])
    value = float(statistic(*arrays))
    if n < 2:
        return Interval(value, math.nan, math.nan)
    draws = np.random.default_rng(0).integers(0, n, (resamples, n))
    again = [statistic(*(array[draw] for array in arrays)) for draw in draws]
    low, high = np.percentile(again, (2.5, 97.5))
    return Interval(value, float(low), float(high))


def mean(sample: ArrayLike) -> Interval:
    """The mean with its interval."""
    values = np.asarray(sample)
    ends = bootstrap_interval(values) if len(values) > 1 else (math.nan, math.nan)
    return Interval(float(values.mean()), *ends)


def means(samples: NDArray[Any]) -> NDArray[np.float64]:
    """The mean of each column with its interval, (columns, 3)."""
    return np.array([mean(column) for column in samples.T])


def ratio_of_means(above: ArrayLike, below: ArrayLike, *, least: float = 0.0) -> Interval:
    """The mean of one sample over that of another, which counts as `least` where it is smaller."""
    return bootstrap(lambda a, b: float(a.mean() / max(b.mean(), least)), above, below)


def median(sample: ArrayLike) -> Interval:
    """The median with its interval."""
    return bootstrap(np.median, sample)


def share(found: ArrayLike) -> Interval:
    """Share of the true values, with its exact binomial interval."""
    values = np.asarray(found, bool)
    exact = stats.binomtest(int(values.sum()), len(values)).proportion_ci(method="exact")
    return Interval(float(values.mean()), float(exact.low), float(exact.high))


def interquartile_mean(values: ArrayLike) -> float:
    """Mean of the middle half: robust to the few pattern seeds on which everything fails."""
    return float(middle_means(np.ravel(values)[:, None]))


def middle_means(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interquartile mean of each sample (…, seeds, tasks), seeds and tasks taken together."""
    values = np.sort(samples.reshape(*samples.shape[:-2], -1), axis=-1)
    cut = values.shape[-1] // 4
    middle: NDArray[np.float64] = values[..., cut : values.shape[-1] - cut].mean(-1)
    return middle


def improvements(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """How often a score of `first` is above one of `second`, ties counting half.

    Both are (…, seeds, tasks); every score is compared with every other one of the same task, and
    the share averaged over the tasks: the probability of improvement of Agarwal et al. (NeurIPS
    2021).
    """
    x, y = first[..., :, None, :], second[..., None, :, :]
    share: NDArray[np.float64] = ((x > y) + 0.5 * (x == y)).mean((-3, -2, -1))
    return share


def stratified_bootstrap(
    statistic: Callable[..., NDArray[np.float64]], *samples: ArrayLike, resamples: int = RESAMPLES
) -> Interval:
    """`statistic` of samples (seeds, tasks) with its interval: seeds are drawn again task by task.

    The statistic works along the last two axes, as `middle_means` and `improvements` do. A sample
    (seeds,) is of one task. Samples that share their seeds stay pairs. Raises ValueError if they
    differ in shape.
    """
    arrays = [np.asarray(sample, float) for sample in samples]
    arrays = [array[:, None] if array.ndim == 1 else array for array in arrays]
    shapes = {array.shape for array in arrays}
    if len(shapes) > 1:
        raise ValueError(
            f"samples must have one shape (seeds, tasks), got {sorted(shapes)}: take the "
            "seeds that all have"
        )
    value = float(statistic(*arrays))
    n, tasks = arrays[0].shape
    if n < 2:
        return Interval(value, math.nan, math.nan)
    draws = np.random.default_rng(0).integers(0, n, (resamples, n, tasks))
    again = statistic(*(array[draws, np.arange(tasks)] for array in arrays))
    low, high = np.percentile(again, (2.5, 97.5))
    return Interval(value, float(low), float(high))


PER_THOUSAND = "mistakes per 1,000 bins"


def mistake_rates(results: xr.Dataset) -> xr.DataArray:
    """Mistakes in 1,000 bins of each neuron, its evaluation runs taken together.

    Runs that reached the cap made no mistake. Half a mistake is added, so that a neuron that made
    none has a rate, and the rate a logarithm.
    """
    survived = results["survived"]
    cap = results.attrs["settings"]["common"]["cap"]
    return rate((survived < cap).sum("run"), survived.sum("run"))


def rate(mistakes: Any, survived: Any, added: float = 0.5) -> Any:
    """Mistakes in 1,000 bins heard: those survived, and those of the mistakes themselves.

    `added` mistakes are added, so that who made none has a rate too.
    """
    return 1_000.0 * (mistakes + added) / (survived + mistakes).clip(1)


def goodness(survived: NDArray[Any], cap: int) -> NDArray[np.float64]:
    """−log10 of the mistakes per bin survived, runs (…, runs) taken together.

    Half a mistake is added, so that a neuron without any has a value. Unlike in `rate` the bins of
    the mistakes are left out: so were the findings judged that are kept.
    """
    rates = ((survived < cap).sum(-1) + 0.5) / np.maximum(survived.sum(-1), 1)
    return np.asarray(-np.log10(rates))


def typical_rate(rates: xr.DataArray) -> xr.DataArray:
    """Geometric mean over the pattern seeds."""
    logarithms: Any = np.log(rates)
    found: xr.DataArray = np.exp(logarithms.mean("pattern_seed"))
    return found


def mistakes_per_thousand(survived: ArrayLike, cap: int) -> float:
    """Mistakes in 1,000 bins of the stream, from the bins that runs survived.

    Runs that reached the cap made none, and their bins count all the same: for mistakes at a
    constant rate this is the maximum-likelihood estimate. Unlike the mean of the capped runs it
    goes on telling good from better.
    """
    bins = np.asarray(survived)
    return float(rate(np.sum(bins < cap), bins.sum(), added=0.0))


def wins(first: ArrayLike, second: ArrayLike) -> Wins:
    """How often `first` was ahead of `second`, seed by seed."""
    difference = np.asarray(first) - np.asarray(second)
    ahead, decided = int(np.sum(difference > 0)), int(np.sum(difference != 0))
    if decided == 0:
        return Wins(0, len(difference), 0.0, 1.0, 1.0)
    test = stats.binomtest(ahead, decided, 0.5)
    ends = test.proportion_ci(method="exact")
    return Wins(ahead, len(difference), float(ends.low), float(ends.high), float(test.pvalue))
