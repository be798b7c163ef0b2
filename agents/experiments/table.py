"""The reference table: every neuron and rule on one to four classes, beside a prototype."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from agents import mistake_rate
from agents.experiments.design import Experiment
from agents.experiments.methods import (
    GNM_ALL,
    GNM_ET,
    GNM_ET_MODULATED,
    LIF_ALL,
    MODULATED,
    MST_ALL,
)
from agents.experiments.statistics import by_seed, mean, median, score
from agents.experiments.training import class_counts, learners, pattern_seeds, training
from agents.experiments.verdict import Results

if TYPE_CHECKING:
    import xarray as xr

_WIDE = {"start": "wide"}

TABLE_LEARNERS = {
    "GNM, ALL": GNM_ALL,
    "GNM, ET": GNM_ET,
    "GNM, ET modulated": GNM_ET_MODULATED,
    "LIF refractory 0, ALL": LIF_ALL,
    "LIF refractory 25, ALL": {**LIF_ALL, "refractory": 25},
    "LIF refractory 0, ET modulated": {**LIF_ALL, **MODULATED},
    "MST, ALL": MST_ALL,
    "MST, ET modulated": {**MST_ALL, **MODULATED},
    "wide: GNM 0.3, ALL": {**GNM_ALL, **_WIDE},
    "wide: GNM 0.3, ET": {**GNM_ET, **_WIDE},
    "wide: GNM 0.3, ET modulated": {**GNM_ET_MODULATED, **_WIDE},
    "wide: MST 0.2, ALL": {**MST_ALL, **_WIDE},
    "wide: LIF 0.5 refractory 0, ALL": {**LIF_ALL, **_WIDE},
    "wide: LIF 0.5 refractory 25, ALL": {**LIF_ALL, "refractory": 25, **_WIDE},
}

REFERENCE: dict[str, tuple[tuple[int, int], ...]] = {
    "GNM, ALL": ((8819, 9820), (3375, 3262), (471, 247), (98, 68)),
    "GNM, ET": ((7270, 8619), (2669, 1822), (734, 478), (268, 212)),
    "GNM, ET modulated": ((8992, 9760), (4585, 4966), (1230, 810), (326, 189)),
    "LIF refractory 0, ALL": ((9136, 9931), (4366, 4863), (723, 553), (220, 181)),
    "LIF refractory 25, ALL": ((9313, 9932), (310, 289), (28, 28), (11, 11)),
    "LIF refractory 0, ET modulated": ((9196, 9898), (4493, 4806), (1072, 838), (350, 319)),
    "MST, ALL": ((8388, 9881), (2217, 1179), (351, 285), (165, 160)),
    "MST, ET modulated": ((9850, 9984), (5413, 5809), (542, 448), (160, 162)),
    "wide: GNM 0.3, ALL": ((1576, 1400), (508, 428), (192, 154), (83, 62)),
    "wide: GNM 0.3, ET": ((2953, 3279), (1262, 1110), (511, 425), (253, 212)),
    "wide: GNM 0.3, ET modulated": ((3760, 3982), (1691, 1760), (686, 586), (269, 176)),
    "wide: MST 0.2, ALL": ((962, 1026), (126, 119), (67, 66), (54, 53)),
    "wide: LIF 0.5 refractory 0, ALL": ((710, 648), (181, 160), (93, 87), (61, 59)),
    "wide: LIF 0.5 refractory 25, ALL": ((553, 597), (115, 110), (21, 22), (9, 8)),
}
"""Mean and median noisy performance for 1, 2, 3 and 4 classes from an independent prototype of the
same protocol, over 48 pattern seeds of its own streams."""

SEEDS = {"quick": 6, "paper": 48}


def table(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """All neurons and rules on one to four classes."""
    seeds_axis = pattern_seeds(seeds or range(SEEDS[size]))
    axes = (class_counts(1, 2, 3, 4), seeds_axis, learners(TABLE_LEARNERS))
    return training("table", "Reference table", axes)


@dataclass(frozen=True)
class Cell:
    """One entry of the table."""

    mean: str
    median: str
    mistakes: str
    reference: str
    ratio: float


def reference(results: Results) -> dict[str, list[Cell]]:
    """The reference table: for each learner one cell per number of classes; empty without data."""
    if "table" not in results:
        return {}
    data = results["table"]
    return {
        name: [
            _cell(data.sel(classes=classes, learner=name), expected)
            for classes, expected in zip(data["classes"].to_numpy(), REFERENCE[name], strict=True)
        ]
        for name in REFERENCE
    }


def _cell(data: xr.Dataset, expected: tuple[int, int]) -> Cell:
    scores = by_seed(score(data))
    cap = data.attrs["settings"]["common"]["cap"]
    average, rate = mean(scores), mistake_rate(data["survived"], cap)
    return Cell(
        f"{average:,.0f}",
        f"{median(scores).value:,.0f}",
        f"{rate.rate:.2g} [{rate.low:.2g} … {rate.high:.2g}]",
        f"{expected[0]:,} / {expected[1]:,}",
        round(average.value / expected[0], 2),
    )


EXPERIMENTS = {"table": table}
