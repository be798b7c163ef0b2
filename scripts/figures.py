"""Draw the figures from finished stores. Nothing is trained.

python scripts/figures.py                 every figure whose data are there
python scripts/figures.py F3 F7 --size paper
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("figures", "reproduce"):
    import xarray as xr
    from matplotlib.figure import Figure

    from drawing import constant_input, continuous, maps, methods, style
    from experiments.registry import NAMES, SIZES
    from experiments.verdict import Results
    from store import StoreError, read

RESULTS = Path("results")
FORMATS = ("pdf", "png", "svg")


@dataclass(frozen=True)
class Picture:
    """One figure: what it needs, what draws it, its caption, and what that adds on the data."""

    draw: Callable[[Results], Figure]
    needs: tuple[str, ...]
    caption: str
    note: Callable[[Results], str] = lambda results: ""


PICTURES: dict[str, Picture] = {
    "F1": Picture(
        constant_input.traces,
        ("F1",),
        "A neuron with η 0.8, α 0.3, β 0.1 under constant input. (c) Weak input (dashed) takes the "
        "membrane potential to a plateau below the threshold; strong input makes it cross the "
        "threshold, and R, which has opened, pulls it down again. (d) The decay D over V in "
        "one such "
        "cycle: at the same V the neuron decays far faster on the way down than on the way up, "
        "so it "
        "remembers that it has crossed. Under weak input (dashed) D is proportional to V.",
    ),
    "F2": Picture(
        continuous.classes,
        ("F2",),
        "A neuron in continuous time (the first pattern seed) under each of its two patterns "
        "alone. Shaded is the membrane potential above the threshold; its integral S is the "
        "output, and should be 1 for class 1 and 2 for class 2.",
    ),
    "F3": Picture(
        maps.one_class,
        ("F3", "table"),
        "One class, matched initial weights. Mean over pattern seeds of the noisy performance, "
        "counted up to 1,000 bins (a) and up to 10,000 (b). The cross marks the best cell, the "
        "blue "
        "line on the colour bar what the MST reaches on the same task, the dashed curve the "
        "best line "
        "(1−η)α = α*, sought in α* = 0.05 … 0.5. (c) The same numbers against α; red is η = 0.",
        lambda results: maps.edge_note(results["F3"]),
    ),
    "F3-published": Picture(
        maps.one_class_published,
        ("F3-published", "table"),
        "As the figure before, from the initial weights of the published code (GNM 0.3, MST 0.2).",
        lambda results: maps.edge_note(results["F3-published"]),
    ),
    "F4": Picture(
        maps.more_classes,
        ("F4", "table"),
        "Two, three and four classes, read out from the membrane potential V (upper row) and from "
        "the decay D with unbounded weights (lower row). Marks as before; every colour bar has its "
        "own scale.",
        lambda results: maps.edge_note(results["F4"].sel(readout="V")),
    ),
    "F5a": Picture(
        maps.against_alpha,
        ("F4",),
        "Noisy performance against α for two, three and four classes, readout V. Red is η = 0.",
    ),
    "F5b": Picture(
        maps.residual_plot,
        ("F3", "F4"),
        "For each η the best score over α, minus the best score at η = 0, for each pattern seed. "
        "Points above the dashed line have gained from η > 0; bars are standard errors over the "
        "evaluation streams.",
    ),
    "F6": Picture(
        methods.refractory,
        ("F6",),
        "Mean score of LIF neurons over that of the GNM, by refractory period, from both kinds of "
        "initial weights. Bands are 95 % bootstrap intervals over pattern seeds.",
    ),
    "F7": Picture(
        methods.comparison,
        ("F7",),
        "Two classes. (a, b) One point per pattern seed; bars are medians, diamonds means with "
        "95 % "
        "bootstrap intervals; dotted is what silence scores. (c, d) Differences between two "
        "methods "
        "on the same patterns and streams; above, how often the first was ahead.",
    ),
    "F8": Picture(
        continuous.volumes,
        ("F8",),
        "A trained neuron (the first pattern seed) as a chemical reaction network: V of one "
        "stochastic run with 25, 100 and 500 molecules per input spike, over the deterministic "
        "solution (black), all with the same input. Shaded are the patterns, with the S that they "
        "are given.",
    ),
    "F8-mistakes": Picture(
        continuous.mistakes,
        ("F8",),
        "Wrong outputs per trial (patterns answered with another rounded S than owed, and "
        "stretches "
        "of noise with more than one half) against the number of molecules per input spike, with "
        "95 % bootstrap intervals over trials.",
    ),
}


def caption(name: str, results: Results) -> str:
    """The caption of a figure that was drawn from `results`."""
    return PICTURES[name].caption + PICTURES[name].note(results)


def load(results: Path, names: Sequence[str] = NAMES) -> tuple[dict[str, xr.Dataset], list[str]]:
    """The finished stores under `results` by name, and a line on each that is not there.

    Raises StoreError for a damaged store: it has to be repaired, not left out.
    """
    found, absent = {}, []
    for name in names:
        try:
            found[name] = read(results / name)
        except StoreError as error:
            if "damaged" in str(error):
                raise
            absent.append(str(error))
    return found, absent


def save(figure: Figure, folder: Path, name: str) -> dict[str, Path]:
    """Write the figure in every format; returns the paths by format."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = {kind: folder / f"{name}.{kind}" for kind in FORMATS}
    for kind, path in paths.items():
        # No dates in the files: the same data give the same bytes.
        figure.savefig(
            path, metadata={"png": {}, "pdf": {"CreationDate": None}}.get(kind, {"Date": None})
        )
    style.plt.close(figure)
    return paths


def draw(results: Results, folder: Path, names: Sequence[str] = tuple(PICTURES)) -> dict[str, Any]:
    """Draw each named figure whose data are there; returns the paths by figure and format."""
    drawn = {}
    with style.styled():
        for name in names:
            picture = PICTURES[name]
            if all(need in results for need in picture.needs):
                drawn[name] = save(picture.draw(results), folder, name)
    return drawn


def main(arguments: argparse.Namespace) -> dict[str, Any]:
    """Draw what the command line asks for."""
    unknown = [name for name in arguments.names if name not in PICTURES]
    if unknown:
        raise ValueError(f"there is no figure {unknown[0]!r}: choose from {', '.join(PICTURES)}")
    names = arguments.names or list(PICTURES)
    needed = sorted({need for name in names for need in PICTURES[name].needs})
    results, absent = load(arguments.results or RESULTS / arguments.size, needed)
    folder = arguments.out or RESULTS / arguments.size / "figures"
    drawn = draw(results, folder, names)
    for line in absent:
        print(f"left out: {line}")
    for name, paths in drawn.items():
        print(f"{name}: {paths['pdf']}, {paths['png']}")
    if not drawn:
        raise ValueError("no figure could be drawn: run the sweeps first (make reproduce)")
    return {
        "figures": {name: {k: str(p) for k, p in paths.items()} for name, paths in drawn.items()}
    }


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", help="default: all of " + ", ".join(PICTURES))
    parser.add_argument("--size", choices=SIZES, default="quick", help="default: %(default)s")
    parser.add_argument("--results", type=Path, help=f"folder of stores; default: {RESULTS}/SIZE")
    parser.add_argument("--out", type=Path, help=f"default: {RESULTS}/SIZE/figures")
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    return parser.parse_args()


if __name__ == "__main__":
    options = parse()
    commandline.run(lambda: main(options), as_json=options.json, name="figures")
