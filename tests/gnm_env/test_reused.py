"""Lent arrays: always empty when they are lent, and never altered while somebody has them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gnm_env.reused import ReusedRows


def lend(reused: ReusedRows, places: list[int], entry: Any = "here") -> list[NDArray[Any]]:
    for row in reused.rows(places):
        for place in places:
            row[place] = entry
    return reused.lent()


def test_what_is_lent_is_empty_but_where_it_was_written_to() -> None:
    reused = ReusedRows(2, 5)
    for places in ([0, 3], [], [4], [0, 1, 2, 3, 4], [2]):
        expected = ["here" if place in places else None for place in range(5)]
        assert [row.tolist() for row in lend(reused, places)] == [expected] * 2


def test_rows_that_nobody_has_kept_are_used_again() -> None:
    reused = ReusedRows(2, 5)
    addresses = {lend(reused, [k])[0].ctypes.data for k in range(5)}
    assert len(addresses) == 1


def test_what_is_lent_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        lend(ReusedRows(2, 5), [1])[0][:] = "mine"


@pytest.mark.parametrize(
    "keep",
    [
        lambda rows: rows[0],
        lambda rows: rows[0][1:4],
        lambda rows: rows[0][1:][:2],
        lambda rows: rows[0].reshape(5, 1),
    ],
    ids=["a row", "a part", "a part of a part", "another shape"],
)
def test_what_somebody_has_kept_stays_as_it_was(
    keep: Callable[[list[NDArray[Any]]], NDArray[Any]],
) -> None:
    reused = ReusedRows(2, 5)
    kept = keep(lend(reused, [2], ["mine"]))
    was = kept.tolist()
    for _ in range(3):
        lend(reused, [2], ["another's"])
    assert kept.tolist() == was
    assert np.count_nonzero(kept != None) == 1  # noqa: E711, elementwise
