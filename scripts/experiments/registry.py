"""The experiments by name. Each is a function of the size and, if given, of the pattern seeds."""

from __future__ import annotations

from collections.abc import Callable

from experiments import constant_input, continuous, maps, methods, reactions
from experiments.design import Experiment

SIZES = ("quick", "paper")

BUILDERS: dict[str, Callable[[str, tuple[int, ...] | None], Experiment]] = {
    "F1": constant_input.two_levels,
    "F2": continuous.two_classes,
    "F3": maps.one_class,
    "F3-published": maps.one_class_published,
    "F4": maps.more_classes,
    "F6": methods.refractory,
    "F7": methods.comparison,
    "BP": methods.back_propagation,
    "F8": reactions.volumes,
    "table": methods.table,
}
NAMES = tuple(BUILDERS)


def experiment(name: str, size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The experiment `name` at `size`; ValueError if there is none of that name."""
    if name not in BUILDERS:
        raise ValueError(f"there is no experiment {name!r}: choose one of {', '.join(NAMES)}")
    return BUILDERS[name](size, seeds)
