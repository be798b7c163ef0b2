"""The figures of a report, drawn from finished stores. Nothing is trained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from agents.experiments.store import StoreError, read
from agents.experiments.verdict import Results
from agents.plotting import save, styled

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

FORMATS = ("pdf", "png", "svg")


@dataclass(frozen=True)
class Picture:
    """One figure.

    Attributes:
        draw: draws it.
        needs: experiments whose stores it is drawn from.
        caption: what one sees.
        note: what the caption says besides about the data at hand.
    """

    draw: Callable[[Results], Figure]
    needs: tuple[str, ...]
    caption: str
    note: Callable[[Results], str] = lambda results: ""

    def full_caption(self, results: Results) -> str:
        """The caption of the figure that was drawn from `results`."""
        return self.caption + self.note(results)


def load(results: Path, names: Sequence[str]) -> tuple[dict[str, xr.Dataset], list[str]]:
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


def draw(
    pictures: Mapping[str, Picture], results: Results, folder: Path
) -> dict[str, dict[str, Path]]:
    """Draw each figure whose data are there; returns the paths by figure and format."""
    drawn = {}
    for name, picture in pictures.items():
        if all(need in results for need in picture.needs):
            with styled():
                figure = picture.draw(results)
            drawn[name] = save(figure, folder, name, FORMATS)
    return drawn
