"""What the figures and the claims read off a map of noisy performance over η and α."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import RegularGridInterpolator

from experiments.statistics import score

LARGEST_ETA = 0.6
"""Residuals are looked at up to this η, as in the paper."""

LINES = np.arange(0.05, 0.501, 0.005)
"""Candidates for α*; each line runs from (η = 0, α = α*) to α = 1."""

_POINTS = 60
"""Points at which a line is looked up, evenly spaced in α."""


class Cell(NamedTuple):
    """A cell of the map, and its score in bins."""

    eta: float
    alpha: float
    score: float


class Line(NamedTuple):
    """The best line (1−η)α = α*, the mean score along it, and that at η = 0 for the same α."""

    alpha: float
    score: float
    uncorrected: float


def best(scores: xr.DataArray) -> Cell:
    """The best cell of a map (eta, alpha)."""
    at = scores.isel(scores.argmax(["eta", "alpha"]))
    return Cell(float(at["eta"]), float(at["alpha"]), float(at))


def optimal_line(scores: xr.DataArray) -> Line:
    """The line (1−η)α = α* with the highest mean score from α = α* to α = 1."""
    plane = scores.transpose("eta", "alpha")
    look_up = RegularGridInterpolator((plane["eta"], plane["alpha"]), plane.to_numpy())
    alphas = np.linspace(LINES, 1.0, _POINTS)
    along = look_up(np.stack([1 - LINES / alphas, alphas], axis=-1)).mean(axis=0)
    place = int(along.argmax())
    column = np.stack([np.zeros(_POINTS), alphas[:, place]], axis=-1)
    return Line(float(LINES[place]), float(along[place]), float(look_up(column).mean()))


def residuals(results: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray]:
    """Best over α at each 0 < η <= `LARGEST_ETA` minus best over α at η = 0, with standard errors.

    The errors, in bins, are those of a difference of two means over the evaluation runs.
    """
    scores = score(results)
    error = results["survived"].std("run", ddof=1) / np.sqrt(results.sizes["run"])
    top = scores.max("alpha")
    top_error = error.isel(alpha=scores.argmax("alpha")).drop_vars("alpha")
    residual = top - top.sel(eta=0.0)
    spread = np.hypot(top_error, top_error.sel(eta=0.0))
    apart = {"eta": (scores["eta"] > 0) & (scores["eta"] <= LARGEST_ETA)}
    return residual.isel(apart), spread.isel(apart)
