"""Lent arrays: always empty when they are lent, and never altered while somebody has them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gnm_env.reused import ReusedRows


def test_rows_are_empty_whatever_was_written_before() -> None:
    reused = ReusedRows(2, 5)
    for places in ([0, 3], [], [4], [0, 1, 2, 3, 4], [2]):
        rows = reused.rows(places)
        assert [row.tolist() for row in rows] == [[None] * 5] * 2
        for row in rows:
            row[places] = "here"
        del rows, row


def test_rows_that_nobody_has_kept_are_used_again() -> None:
    reused = ReusedRows(2, 5)
    addresses = {reused.rows([k])[0].ctypes.data for k in range(5)}
    assert len(addresses) == 1


@pytest.mark.parametrize(
    "keep",
    [lambda rows: rows[0], lambda rows: rows[0][1:4], lambda rows: rows[0].reshape(5, 1)],
    ids=["a row", "a part", "another shape"],
)
def test_what_somebody_has_kept_stays_as_it_was(
    keep: Callable[[list[NDArray[Any]]], NDArray[Any]],
) -> None:
    reused = ReusedRows(2, 5)
    rows = reused.rows([2])
    rows[0][2] = ["mine"]
    kept = keep(rows)
    was = kept.tolist()
    del rows
    for _ in range(3):
        for row in reused.rows([2]):
            row[2] = ["another's"]
    assert kept.tolist() == was
    assert np.count_nonzero(kept != None) == 1  # noqa: E711, elementwise
