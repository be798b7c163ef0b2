"""The learning curve: how wrong the answers were, block of trials by block of trials."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gnm_env.checks import shown, whole
from gnm_env.files import atomic_write

BLOCK = 1_000
"""Trials per entry of a learning curve, unless told otherwise."""


@dataclass(eq=False, repr=False)
class History:
    """Learning curve of one agent, or of many. B is the number of blocks.

    Attributes:
        trials: int64 (B,), number of trials at the end of each block.
        error_rate: float64 (B,), fraction of the block's trials whose sum of output spikes was not
            the aggregate label; (B, agents) from `train_many`.
        mean_error: float64, same shape, mean |label − emitted| in spikes.
        overflowed: int64 () or (agents,), the trial in which learning ended because a weight would
            have overflowed, or −1.
    """

    trials: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    error_rate: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    mean_error: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    overflowed: NDArray[np.int64] = field(default_factory=lambda: np.array(-1))

    def append(self, trials: int, wrong: ArrayLike, absolute: ArrayLike) -> None:
        """Add a block of `trials` trials, `wrong` of them wrong, with Σ |label − emitted|.

        Raises ValueError for what is no number, is below 0, or is not one for each agent.
        """
        trials = whole("trials", trials, low=0)
        columns = self.error_rate.shape[1:]
        wrong = _one_each("wrong", wrong, columns)
        absolute = _one_each("absolute", absolute, columns)
        if trials == 0:
            return
        before = int(self.trials[-1]) if len(self.trials) else 0
        self.trials = np.append(self.trials, before + trials)
        self.error_rate = _with_row(self.error_rate, wrong / trials)
        self.mean_error = _with_row(self.mean_error, absolute / trials)

    def __len__(self) -> int:
        return len(self.trials)

    def __repr__(self) -> str:
        if not len(self):
            return "History(no trials yet)"
        agents = self.error_rate[-1].size
        return (
            f"History({self.trials[-1]:,} trials in {len(self):,} blocks, "
            f"{agents:,} agent{'s' * (agents != 1)}: "
            f"{self.error_rate[-1].mean():.1%} of the trials wrong in the last block)"
        )

    def of(self, agent: int) -> History:
        """The learning curve of one agent of `train_many`; negative numbers count from the end.

        Raises ValueError if there is no such agent.
        """
        if self.error_rate.ndim != 2:
            raise ValueError(
                "this is the learning curve of one agent already; of(k) is for those of train_many"
            )
        n_agents = self.error_rate.shape[1]
        agent = whole("the number of the agent", agent, low=-n_agents, high=n_agents - 1)
        return History(
            self.trials,
            self.error_rate[:, agent],
            self.mean_error[:, agent],
            np.array(self.overflowed[agent]),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the learning curve as CSV: trials, error_rate, mean_error.

        Of many agents, a column for each: trials, error_rate_0, error_rate_1, …, mean_error_0, …
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        several = self.error_rate.shape[1:]
        endings = [f"_{k}" for k in range(several[0])] if several else [""]
        names = ("error_rate", "mean_error")
        writer.writerow(["trials", *(name + ending for name in names for ending in endings)])
        rows = zip(self.trials, self.error_rate, self.mean_error, strict=True)
        writer.writerows([int(t), *np.ravel(e).tolist(), *np.ravel(m).tolist()] for t, e, m in rows)
        with atomic_write(path) as file:
            file.write(text.getvalue().encode())


Callback = Callable[[int, History], Any]
"""Called after each block with the number of trials done and the history; False ends training."""


def _with_row(table: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([table.reshape(-1, *row.shape), row[None]])


def checked_callback(callback: Any) -> Callback | None:
    """`callback` if it can be called, or None; else ValueError."""
    if callback is not None and not callable(callback):
        raise ValueError(
            "callback must be a function of the trials done and the history, or None, "
            f"got {shown(callback)}"
        )
    return callback


def _one_each(name: str, values: Any, columns: tuple[int, ...]) -> NDArray[np.float64]:
    """`values` as numbers >= 0: one, or one for each of the agents that have columns."""
    try:
        array = np.asarray(values)
    except ValueError:
        array = np.array(None)
    if array.dtype.kind not in "fiu" or np.any(array < 0):
        raise ValueError(f"{name} must be numbers >= 0, got {shown(values)}")
    if array.ndim > 1 or (columns and array.shape != columns):
        raise ValueError(
            f"{name} must be one number for each of {columns[0] if columns else 1} agents, "
            f"got shape {array.shape}"
        )
    return array.astype(np.float64)
