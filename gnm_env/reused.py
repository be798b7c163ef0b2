"""Arrays of Python objects that are used again once nobody else holds them.

Rests on CPython, which counts references and tells the count: `sys.getrefcount`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ReusedRows:
    """Rows of objects, None but where their owner writes, lent read-only and used again.

    To make and to free object arrays of a thousand entries takes as long as a sixth of a step of a
    thousand environments. So the last ones are used again if nobody has kept any of them, not even
    a part; whoever keeps one has it for good.

    Args:
        n_rows, length: shape of what is lent.
    """

    def __init__(self, n_rows: int, length: int) -> None:
        self._shape = (n_rows, length)
        self._renew()
        self._unlent = self._references()

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy lends rows of its own."""
        return ReusedRows, self._shape

    def _renew(self) -> None:
        self._block = np.empty(self._shape, object)
        self._rows = list(self._block)
        self._views = list(self._block)
        for view in self._views:
            view.setflags(write=False)
        self._written: Sequence[int] = ()

    def _references(self) -> int:
        """References to what is lent, and to the block, which every part of what is lent holds."""
        return sum(map(sys.getrefcount, self._views), sys.getrefcount(self._block))

    def rows(self, places: Sequence[int]) -> list[NDArray[Any]]:
        """The rows, each of them None everywhere, for their owner to write to `places` only."""
        if self._references() > self._unlent:
            self._renew()
        else:
            for row in self._rows:
                for place in self._written:
                    row[place] = None
        self._written = places
        return self._rows

    def lent(self) -> list[NDArray[Any]]:
        """The same rows for others, who can keep them but not write to them."""
        return self._views
