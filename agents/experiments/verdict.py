"""A claim of the paper or a hypothesis of our own, the rule that judges it, and what came out.

Rules are fixed before the runs that they judge, and a verdict follows from the numbers alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from agents.experiments.statistics import Interval
from agents.experiments.training import STARTS

if TYPE_CHECKING:
    import xarray as xr

REPRODUCED = "reproduced"
NOT_REPRODUCED = "not reproduced"
MISSING = "missing"
HOLDS = "holds"
DOES_NOT_HOLD = "does not hold"

Results: TypeAlias = "Mapping[str, xr.Dataset]"
"""Finished stores by the name of their experiment."""


class Mark(NamedTuple):
    """One number of ours beside the paper's: under what, the interval, and whether it agrees.

    `at` is the paper's own number where it has one of its own for this row.
    """

    label: str
    value: Interval
    holds: bool
    at: float | None = None


class Forest(NamedTuple):
    """Ours under each condition beside the paper's: what a small forest plot shows.

    `low` and `high` are the ends of the band in which the claim holds, `at` the paper's own number.
    """

    unit: str
    low: float
    high: float
    marks: tuple[Mark, ...]
    at: float | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Finding:
    """What a rule found.

    Attributes:
        holds: whether the claim holds as it stands, under every protocol that it was tried under.
        conditions: what it holds under, where it does not hold as it stands.
        numbers: ours with their intervals, in words.
        judged: False where the stores are there and yet leave nothing to compare.
        forest: ours under each condition beside the paper's, where that can be drawn.
    """

    holds: bool
    conditions: Mapping[str, bool]
    numbers: tuple[str, ...]
    judged: bool = True
    forest: Forest | None = None

    @classmethod
    def of(
        cls,
        held: Mapping[Any, bool],
        numbers: Iterable[str],
        named: str = "{}",
        forest: Forest | None = None,
    ) -> Finding:
        """What holds if each of `held` does, which are its conditions; `named` puts them in words.

        Such as "the task has {} classes".
        """
        conditions = {named.format(name): holds for name, holds in held.items()}
        return cls(all(held.values()), conditions, tuple(numbers), forest=forest)

    @property
    def verdict(self) -> str:
        """Reproduced, reproduced if …, not reproduced, or missing."""
        return self.worded(REPRODUCED, NOT_REPRODUCED)

    def worded(self, yes: str, no: str) -> str:
        """The verdict in the words `yes`, `yes` with its conditions, `no`, or missing."""
        if not self.judged:
            return MISSING
        if self.holds:
            return yes
        kept = [condition for condition, holds in self.conditions.items() if holds]
        return f"{yes} if {', or '.join(kept)}" if kept else no


class Judged:
    """What is judged by a rule, from the stores that the rule reads."""

    needs: tuple[str, ...]
    judge: Callable[[Results], Finding]

    def finding(self, results: Results) -> Finding | None:
        """What the rule finds; None if a store that it needs is not there."""
        return self.judge(results) if all(name in results for name in self.needs) else None


@dataclass(frozen=True)
class Claim(Judged):
    """One row of the report.

    Attributes:
        id: such as "F7b".
        where: in the paper.
        words: what the paper says.
        protocol: what we ran.
        rule: when it counts as reproduced, in words.
        needs: experiments whose stores the rule reads.
        environment: the task.
        judge: the rule.
    """

    id: str
    where: str
    words: str
    protocol: str
    rule: str
    needs: tuple[str, ...]
    environment: str
    judge: Callable[[Results], Finding]


@dataclass(frozen=True)
class Hypothesis(Judged):
    """What we expect beyond the paper, written down with its rule before the run.

    Attributes:
        id: such as "M1".
        words: what is expected.
        because: on what grounds, known before the run.
        protocol: what is run.
        rule: when it counts as holding, in words.
        needs: experiments whose stores the rule reads.
        judge: the rule.
    """

    id: str
    words: str
    because: str
    protocol: str
    rule: str
    needs: tuple[str, ...]
    judge: Callable[[Results], Finding]

    def verdict(self, results: Results) -> str:
        """Holds, holds if …, does not hold, or missing."""
        finding = self.finding(results)
        return finding.worded(HOLDS, DOES_NOT_HOLD) if finding else MISSING


class Tried(NamedTuple):
    """What a rule found from one kind of initial weights: whether the claim holds, ours in words,
    whether a weaker form of it does, and the number that a forest plot shows."""

    holds: bool
    words: str
    weaker: bool = False
    value: Interval | None = None


def from_both_starts(
    judge: Callable[[str], Tried], weaker: str = "", forest: Forest | None = None
) -> Finding:
    """The finding of a rule that `judge` tries from each kind of initial weights.

    The start is a condition, and so is the weaker form (named by `weaker`) where the claim itself
    does not hold. `forest`, without marks, says where the values of what was tried are drawn.
    """
    tried = {start: judge(start) for start in STARTS}
    conditions = {f"the initial weights are the {s} ones": one.holds for s, one in tried.items()}
    if weaker:
        conditions |= {
            f"{weaker} ({start} initial weights)": one.weaker and not one.holds
            for start, one in tried.items()
        }
    if forest:
        marks = (Mark(s, one.value, one.holds) for s, one in tried.items() if one.value)
        forest = forest._replace(marks=tuple(marks))
    return Finding(
        all(one.holds for one in tried.values()),
        conditions,
        tuple(one.words for one in tried.values()),
        forest=forest,
    )
