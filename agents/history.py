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

from gnm_env.files import atomic_write

BLOCK = 1_000
"""Trials per entry of a learning curve, unless told otherwise."""


@dataclass(eq=False)
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
        """Add a block of `trials` trials, `wrong` of them wrong, with Σ |label − emitted|."""
        if trials == 0:
            return
        before = int(self.trials[-1]) if len(self.trials) else 0
        self.trials = np.append(self.trials, before + trials)
        self.error_rate = _with_row(self.error_rate, np.asarray(wrong) / trials)
        self.mean_error = _with_row(self.mean_error, np.asarray(absolute) / trials)

    def __len__(self) -> int:
        return len(self.trials)

    def of(self, agent: int) -> History:
        """The learning curve of one agent of `train_many`."""
        return History(
            self.trials,
            self.error_rate[:, agent],
            self.mean_error[:, agent],
            np.array(self.overflowed[agent]),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the learning curve of one agent as CSV: trials, error_rate, mean_error."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["trials", "error_rate", "mean_error"])
        rows = zip(self.trials, self.error_rate, self.mean_error, strict=True)
        writer.writerows([int(t), float(e), float(m)] for t, e, m in rows)
        with atomic_write(path) as file:
            file.write(text.getvalue().encode())


Callback = Callable[[int, History], Any]
"""Called after each block with the number of trials done and the history; False ends training."""


def _with_row(table: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([table.reshape(-1, *row.shape), row[None]])
