"""F6, F7, BP and the reference table: neurons and rules side by side on the same streams."""

from __future__ import annotations

from typing import Any

from experiments.design import Axis, Experiment
from experiments.training import STARTS, class_counts, learners, pattern_seeds, training

REFRACTORY = tuple(range(26))
"""Refractory periods of F6, in bins."""

GNM_ALL: dict[str, Any] = {"neuron": "gnm", "rule": "all"}
GNM_ET = {"neuron": "gnm", "rule": "et"}
GNM_ET_MODULATED = {**GNM_ET, "modulate": True}
MST_ALL = {"neuron": "mst", "rule": "all"}
LIF_ALL = {"neuron": "lif", "rule": "all", "refractory": 0}
MODULATED = {"rule": "et", "modulate": True}

F7_LEARNERS = {
    "MST, ALL": MST_ALL,
    "GNM, ALL": GNM_ALL,
    "GNM, ET": GNM_ET,
    "GNM, ET modulated": GNM_ET_MODULATED,
}
_PUBLISHED = {"start": "published"}

TABLE_LEARNERS = {
    "GNM, ALL": GNM_ALL,
    "GNM, ET": GNM_ET,
    "GNM, ET modulated": GNM_ET_MODULATED,
    "LIF refractory 0, ALL": LIF_ALL,
    "LIF refractory 25, ALL": {**LIF_ALL, "refractory": 25},
    "LIF refractory 0, ET modulated": {**LIF_ALL, **MODULATED},
    "MST, ALL": MST_ALL,
    "MST, ET modulated": {**MST_ALL, **MODULATED},
    "published: GNM 0.3, ALL": {**GNM_ALL, **_PUBLISHED},
    "published: GNM 0.3, ET": {**GNM_ET, **_PUBLISHED},
    "published: GNM 0.3, ET modulated": {**GNM_ET_MODULATED, **_PUBLISHED},
    "published: MST 0.2, ALL": {**MST_ALL, **_PUBLISHED},
    "published: LIF 0.5 refractory 0, ALL": {**LIF_ALL, **_PUBLISHED},
    "published: LIF 0.5 refractory 25, ALL": {**LIF_ALL, "refractory": 25, **_PUBLISHED},
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
    "published: GNM 0.3, ALL": ((1576, 1400), (508, 428), (192, 154), (83, 62)),
    "published: GNM 0.3, ET": ((2953, 3279), (1262, 1110), (511, 425), (253, 212)),
    "published: GNM 0.3, ET modulated": ((3760, 3982), (1691, 1760), (686, 586), (269, 176)),
    "published: MST 0.2, ALL": ((962, 1026), (126, 119), (67, 66), (54, 53)),
    "published: LIF 0.5 refractory 0, ALL": ((710, 648), (181, 160), (93, 87), (61, 59)),
    "published: LIF 0.5 refractory 25, ALL": ((553, 597), (115, 110), (21, 22), (9, 8)),
}
"""Mean and median noisy performance for 1, 2, 3 and 4 classes from an independent prototype of the
same protocol, over 48 pattern seeds of its own streams."""

SEEDS = {
    "F6": {"quick": 6, "paper": 48},
    "F7": {"quick": 10, "paper": 50},
    "BP": {"quick": 4, "paper": 50},
    "table": {"quick": 6, "paper": 48},
}


def _seeds(name: str, size: str, seeds: tuple[int, ...] | None) -> Axis:
    return pattern_seeds(seeds or tuple(range(SEEDS[name][size])))


def _starts() -> Axis:
    return Axis("start", STARTS, chunk=0, long_name="initial weights")


def refractory(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """LIF neurons of every refractory period beside a GNM, one and three classes."""
    rows = {"GNM": GNM_ALL, **{f"LIF {n}": {**LIF_ALL, "refractory": n} for n in REFRACTORY}}
    axes = (class_counts(1, 3), _seeds("F6", size, seeds), _starts(), learners(rows))
    return training("F6", "LIF against GNM, by refractory period", axes)


def comparison(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """Neurons and rules on two classes, paired by pattern seed."""
    axes = (class_counts(2), _seeds("F7", size, seeds), _starts(), learners(F7_LEARNERS))
    return training("F7", "Neurons and learning rules, two classes", axes)


def back_propagation(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """A network with ten hidden neurons on the pattern seeds and streams of F7."""
    axes = (class_counts(2), _seeds("BP", size, seeds))
    return training("BP", "Backpropagation, two classes", axes, neuron="network", rule="bp")


def table(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """All neurons and rules on one to four classes."""
    axes = (class_counts(1, 2, 3, 4), _seeds("table", size, seeds), learners(TABLE_LEARNERS))
    return training("table", "Reference table", axes)
