"""What the figures and the claims read off a map of noisy performance over η and α."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.statistics import score

LARGEST_ETA = 0.6
"""Residuals are looked at up to this η, as in the paper."""

LINES = np.arange(0.05, 0.501, 0.005)
"""Candidates for α*, 0.05 … 0.5; each line runs from (η = 0, α = α*) to α = 1.

A best line at either end says only that α* lies there or beyond.
"""

Weights = NDArray[np.float64]

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

    @property
    def at_edge(self) -> bool:
        """Whether α* is the smallest or the largest candidate: the best may lie beyond."""
        return self.alpha in (float(LINES[0]), float(LINES[-1]))


def best(scores: xr.DataArray) -> Cell:
    """The best cell of a map (eta, alpha)."""
    at = scores.isel(scores.argmax(["eta", "alpha"]))
    return Cell(float(at["eta"]), float(at["alpha"]), float(at))


def optimal_line(scores: xr.DataArray) -> Line:
    """The line (1−η)α = α* with the highest mean score from α = α* to α = 1."""
    plane = scores.transpose("eta", "alpha")
    along, uncorrected = line_means(plane["eta"].to_numpy(), plane["alpha"].to_numpy())
    return best_line(along, uncorrected, plane.to_numpy())


def best_line(along: Weights, uncorrected: Weights, plane: Weights) -> Line:
    """The same from the weights that `line_means` gives, for scores (η, α) as an array."""
    means = np.tensordot(along, plane, 2)
    place = int(means.argmax())
    return Line(float(LINES[place]), float(means[place]), float((uncorrected[place] * plane).sum()))


def line_means(etas: Weights, alphas: Weights) -> tuple[Weights, Weights]:
    """Weights (lines, η, α) with which a map's cells make the mean along each line, and at η = 0.

    Scores between cells are interpolated linearly, so that a mean along a line is a sum over cells.
    """
    points = np.linspace(LINES, 1.0, _POINTS, axis=1)
    on_line = 1 - LINES[:, None] / points
    at_alpha = _interpolation(points, alphas)
    return (
        np.einsum("lpe,lpa->lea", _interpolation(on_line, etas), at_alpha) / _POINTS,
        np.einsum("lpe,lpa->lea", _interpolation(0 * on_line, etas), at_alpha) / _POINTS,
    )


def _interpolation(at: Weights, grid: Weights) -> Weights:
    """Weights (…, grid) of linear interpolation between grid values."""
    right = np.clip(np.searchsorted(grid, at), 1, len(grid) - 1)
    share = (at - grid[right - 1]) / (grid[right] - grid[right - 1])
    weights = np.zeros((*at.shape, len(grid)))
    np.put_along_axis(weights, right[..., None], share[..., None], -1)
    np.put_along_axis(weights, right[..., None] - 1, 1 - share[..., None], -1)
    return weights


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
    apart = {"eta": (scores["eta"] > 0) & (scores["eta"] <= LARGEST_ETA + 1e-9)}
    return residual.isel(apart), spread.isel(apart)
