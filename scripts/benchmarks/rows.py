"""What a measurement gives: rows of the table, growth curves, and whether targets are reached."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from statistics import median
from typing import Any

from benchmarks.timing import Timing

BINS = "million neuron-bins/s"
MET, BEST_ONLY, MISSED = "met", "best repeat only", "not met"


@dataclass(frozen=True)
class Target:
    """What a row is to reach.

    Attributes:
        bound: the least (or, where less is better, the most) that is right.
        of: "value", or "ratio": how many times as fast as the row that it is compared with.
        aim: what would be better still.
    """

    bound: float
    of: str = "value"
    aim: float | None = None


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        section: heading that it belongs to.
        name: what was measured.
        unit: of `values`.
        values: one per repeat.
        more_is_better: False for times and sizes.
        against: name of the row that `ratios` compare with.
        ratios: per repeat, how many times as fast as that row in the same round.
        best_ratio: the same for the best repeats of both.
        targets: what to reach.
        cpu_share: CPU time over wall time, per repeat.
        note: what one has to know to read the number.
    """

    section: str
    name: str
    unit: str
    values: tuple[float, ...]
    more_is_better: bool = True
    against: str = ""
    ratios: tuple[float, ...] = ()
    best_ratio: float = 0.0
    targets: tuple[Target, ...] = ()
    cpu_share: tuple[float, ...] = ()
    note: str = ""

    @property
    def median(self) -> float:
        return median(self.values)

    @property
    def best(self) -> float:
        return max(self.values) if self.more_is_better else min(self.values)

    def reached(self, target: Target) -> str:
        """MET, BEST_ONLY (a disturbed machine hides it in the others) or MISSED."""
        if target.of == "ratio":
            typical, best, more = median(self.ratios), self.best_ratio, True
        else:
            typical, best, more = self.median, self.best, self.more_is_better
        if _within(typical, target.bound, more):
            return MET
        return BEST_ONLY if _within(best, target.bound, more) else MISSED


def _within(value: float, bound: float, more_is_better: bool) -> bool:
    return value >= bound if more_is_better else value <= bound


@dataclass(frozen=True)
class Curve:
    """Time per unit of work at several sizes.

    Attributes:
        name: what grows.
        symbol: label of the horizontal axis.
        unit: of `values`.
        sizes: at which it was measured.
        values: per size, one per repeat.
        flat: whether it is to be flat, within ±20 %.
        note: what else belongs to the setting.
        label: in a panel that holds several curves.
    """

    name: str
    symbol: str
    unit: str
    sizes: tuple[float, ...]
    values: tuple[tuple[float, ...], ...]
    flat: bool = False
    note: str = ""
    label: str = ""


@dataclass
class Findings:
    """All that was measured. `machine` and `settings` say where and how."""

    machine: dict[str, Any] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)
    rows: list[Row] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    def add(self, other: Findings) -> None:
        """Take over what another has measured."""
        self.rows += other.rows
        self.curves += other.curves
        self.skipped += other.skipped
        self.failed += other.failed

    def to_json(self) -> dict[str, Any]:
        """The same as plain lists and dictionaries, with median and verdicts for other programs."""
        plain = asdict(self)
        for row, shown in zip(self.rows, plain["rows"], strict=True):
            shown["median"] = row.median
            shown["best"] = row.best
            shown["verdicts"] = [row.reached(target) for target in row.targets]
        return plain

    @classmethod
    def from_json(cls, text: str) -> Findings:
        """What `to_json` gave; ValueError if it is anything else."""
        try:
            plain = json.loads(text)
            return cls(
                plain["machine"],
                plain["settings"],
                [_row(shown) for shown in plain["rows"]],
                [_curve(shown) for shown in plain["curves"]],
                plain["skipped"],
                plain["failed"],
            )
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"not the JSON of a benchmark: {error!r}") from None


def _row(shown: dict[str, Any]) -> Row:
    kept = {k: v for k, v in shown.items() if k not in ("median", "best", "verdicts")}
    kept["targets"] = tuple(Target(**target) for target in shown["targets"])
    for name in ("values", "ratios", "cpu_share"):
        kept[name] = tuple(shown[name])
    return Row(**kept)


def _curve(shown: dict[str, Any]) -> Curve:
    values = tuple(tuple(repeats) for repeats in shown["values"])
    return Curve(**{**shown, "sizes": tuple(shown["sizes"]), "values": values})


def rate_rows(
    section: str,
    timings: Mapping[str, Timing],
    unit: str = BINS,
    scale: float = 1e-6,
    *,
    against: str = "",
    targets: Mapping[str, Sequence[Target]] | None = None,
    notes: Mapping[str, str] | None = None,
) -> list[Row]:
    """Rows of speeds: units of work per second times `scale`, all compared with row `against`."""
    rows = []
    for name, timing in timings.items():
        ratios, best_ratio = compare(timing, timings[against]) if against else ((), 0.0)
        rows.append(
            Row(
                section,
                name,
                unit,
                tuple(scale / seconds for seconds in timing.seconds),
                against=against if name != against else "",
                ratios=ratios if name != against else (),
                best_ratio=best_ratio if name != against else 0.0,
                targets=tuple((targets or {}).get(name, ())),
                cpu_share=timing.cpu_share,
                note=(notes or {}).get(name, ""),
            )
        )
    return rows


def compare(timing: Timing, reference: Timing) -> tuple[tuple[float, ...], float]:
    """How many times as fast as `reference`: round by round, and best against best."""
    pairs = zip(reference.seconds, timing.seconds, strict=True)
    return tuple(r / s for r, s in pairs), min(reference.seconds) / min(timing.seconds)
