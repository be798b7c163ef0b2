"""Random generators in the form in which compiled code takes them quickly.

A compiled call that is given a NumPy Generator asks it for the addresses of its functions, which
costs 8 µs each time, as much as a whole trial. A numba list holds generators as compiled code needs
them, and costs 1 µs. They are the same generators: whoever draws from one moves both forms on.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from numba.typed import List
from numpy.random import Generator

from gnm_env.compiled import compiled


class Generators:
    """Some Generators; `held` is the list of them for compiled code."""

    def __init__(self, rngs: Iterable[Generator]) -> None:
        self.rngs = list(rngs)
        self.held = _hold(self.rngs[0])
        for rng in self.rngs[1:]:
            _append(self.held, rng)

    def replace(self, i: int, rng: Generator) -> None:
        """Put `rng` in the place of generator `i`."""
        self.rngs[i] = rng
        _put(self.held, i, rng)

    def __reduce__(self) -> tuple[Any, ...]:
        return Generators, (self.rngs,)


@compiled
def _hold(rng: Generator) -> Any:
    held = List()
    held.append(rng)
    return held


@compiled
def _append(held: Any, rng: Generator) -> None:
    held.append(rng)


@compiled
def _put(held: Any, i: int, rng: Generator) -> None:
    held[i] = rng
