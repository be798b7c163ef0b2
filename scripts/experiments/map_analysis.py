"""What the figures and the claims read off a map of noisy performance over η and α."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.statistics import score

LARGEST_ETA = 0.6
"""The optimal line and the residuals are looked at up to this η, as in the paper."""

LINES = np.arange(0.02, 0.401, 0.005)
"""Candidates for α*: at the largest η, α*/(1−η) is still at most 1."""


class Cell(NamedTuple):
    """A cell of the map, and its score in bins."""

    eta: float
    alpha: float
    score: float


class Line(NamedTuple):
    """The best line (1−η)α = α*, and the mean score along it."""

    alpha: float
    score: float


def best(scores: xr.DataArray) -> Cell:
    """The best cell of a map (eta, alpha)."""
    at = scores.isel(scores.argmax(["eta", "alpha"]))
    return Cell(float(at["eta"]), float(at["alpha"]), float(at))


def optimal_line(scores: xr.DataArray) -> Line:
    """The α* whose line (1−η)α = α* has the highest mean score over η up to `LARGEST_ETA`."""
    etas, rows, alphas = _rows(scores)
    return _highest(
        LINES,
        [
            np.mean(
                [np.interp(a / (1 - eta), alphas, row) for eta, row in zip(etas, rows, strict=True)]
            )
            for a in LINES
        ],
    )


def optimal_constant(scores: xr.DataArray) -> Line:
    """The α with the highest mean score over the same η: what the line has to beat."""
    _, rows, alphas = _rows(scores)
    candidates = np.union1d(LINES, alphas)
    return _highest(
        candidates, [np.mean([np.interp(a, alphas, r) for r in rows]) for a in candidates]
    )


def residuals(results: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Best over α at each 0 < η <= `LARGEST_ETA` minus best over α at η = 0, with standard errors.

    The errors, in bins, are those of a difference of two means over the evaluation runs.
    """
    scores = score(results)
    error = results["survived"].std("run", ddof=1) / np.sqrt(results.sizes["run"])
    place = scores.argmax("alpha")
    top, top_error = scores.isel(alpha=place), error.isel(alpha=place)
    apart = {"eta": (scores["eta"] > 0) & (scores["eta"] <= LARGEST_ETA)}
    residual = top - top.sel(eta=0.0, drop=True)
    spread = np.hypot(top_error, top_error.sel(eta=0.0, drop=True))
    return residual.isel(apart).drop_vars("alpha"), spread.isel(apart).drop_vars("alpha")


def _rows(scores: xr.DataArray) -> tuple[NDArray[np.float64], ...]:
    low = scores.sel(eta=scores["eta"] <= LARGEST_ETA).transpose("eta", "alpha")
    return low["eta"].to_numpy(), low.to_numpy(), low["alpha"].to_numpy()


def _highest(candidates: NDArray[np.float64], means: list[np.floating]) -> Line:
    place = int(np.argmax(means))
    return Line(float(candidates[place]), float(means[place]))
