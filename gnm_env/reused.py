"""Arrays of Python objects that are used again once nobody else holds them."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ReusedRows:
    """Rows of objects, None but where somebody writes, lent anew at every call of `rows`.

    To make and to free object arrays of a thousand entries takes as long as a sixth of a step of a
    thousand environments. So the last ones are lent again if nobody has kept any of them, not even
    a part; whoever keeps one has it for good.

    Args:
        n_rows, length: shape of what is lent.
    """

    def __init__(self, n_rows: int, length: int) -> None:
        self._shape = (n_rows, length)
        self._written: list[int] = []
        self._renew()
        self._unlent = self._references()

    def _renew(self) -> None:
        self._block = np.empty(self._shape, object)

    def _references(self) -> int:
        """References to the block; every row that is lent, and every part of one, has one more."""
        return sys.getrefcount(self._block)

    def rows(self, places: list[int]) -> list[NDArray[Any]]:
        """The rows, each of them None everywhere; the caller will write to `places` only."""
        if self._references() > self._unlent:
            self._renew()
        elif self._written:
            self._block[:, self._written] = None
        self._written = places
        return list(self._block)
