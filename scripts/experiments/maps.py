"""F3 and F4: noisy performance over the whole plane of α and η."""

from __future__ import annotations

from experiments.design import Axis, Experiment
from experiments.training import class_counts, pattern_seeds, training

ALPHA = {
    "quick": (
        0.0,
        0.025,
        0.05,
        0.075,
        0.1,
        0.15,
        0.2,
        0.25,
        0.3,
        0.4,
        0.5,
        0.6,
        0.7,
        0.8,
        0.9,
        1.0,
    ),
    "paper": tuple(k / 40 for k in range(41)),
}
ETA = {"quick": tuple(k / 10 for k in range(11)), "paper": tuple(k / 40 for k in range(41))}
SEEDS = {"quick": (0, 1), "paper": (0, 1, 2, 3, 4)}

READOUT = Axis(
    "readout",
    ("V", "D"),
    # D = αV has to reach the threshold, which bounded weights would forbid at small α.
    settings=({"readout": "V"}, {"readout": "D", "weight_bounds": None}),
    long_name="variable that is compared with the readout threshold",
)


def _plane(size: str) -> tuple[Axis, Axis]:
    # Three columns of η a block: some ten seconds of work, and enough neurons side by side.
    return (
        Axis("eta", ETA[size], chunk=3, long_name="η, model choice"),
        Axis("alpha", ALPHA[size], chunk=0, units="1/bin", long_name="α, decay per bin"),
    )


def one_class(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The map for one class."""
    axes = (class_counts(1), pattern_seeds(seeds or SEEDS[size]), *_plane(size))
    return training("F3", "Noisy performance over α and η, one class", axes, keep_weights=True)


def one_class_published(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The same map from the initial weights of the published code."""
    axes = (class_counts(1), pattern_seeds(seeds or SEEDS[size]), *_plane(size))
    title = "Noisy performance over α and η, one class, published initial weights"
    return training("F3-published", title, axes, keep_weights=True, start="published")


def more_classes(size: str, seeds: tuple[int, ...] | None = None) -> Experiment:
    """The maps for two, three and four classes, read out by V and by D."""
    axes = (READOUT, class_counts(2, 3, 4), pattern_seeds(seeds or SEEDS[size]), *_plane(size))
    title = "Noisy performance over α and η, two to four classes, readouts V and D"
    return training("F4", title, axes, keep_weights=True)
