from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from agents.experiments.figures import FORMATS, draw
from agents.experiments.heat_maps import draw_one_class, sides
from agents.experiments.listing import claims, experiments, pictures
from agents.experiments.residuals import draw_residuals
from agents.plotting import MAP, save, styled
from tests.agents.experiments.worlds import as_in_the_paper, world

PICTURES = pictures()
SCORED = ("F1", "F3", "F3-wide", "F4", "F5", "LINES", "F6", "F7", "BP", "CONDITIONS", "NEURONS")


@pytest.fixture(scope="module")
def results() -> dict[str, xr.Dataset]:
    return world(as_in_the_paper, SCORED, 3)


DRAWABLE = [name for name, picture in PICTURES.items() if set(picture.needs) <= set(SCORED)]


@pytest.mark.parametrize("name", DRAWABLE)
def test_every_figure_is_drawn_as_vector_and_as_pixels(
    name: str, results: dict[str, xr.Dataset], tmp_path: Path
) -> None:
    paths = draw({name: PICTURES[name]}, results, tmp_path)[name]

    assert paths["pdf"].read_bytes().startswith(b"%PDF")
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert "<svg" in paths["svg"].read_text(encoding="utf-8")


def test_every_axis_has_a_label_with_units(results: dict[str, xr.Dataset]) -> None:
    with styled():
        figure = draw_one_class(results, "matched")
    labels = {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())}

    assert labels == {
        "η (model choice)",
        "α (decay per bin)",
        "noisy performance (bins)",
        "mistakes per 1,000 bins",
        "",
    }


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_papers_own_numbers_stand_beside_ours(results: dict[str, xr.Dataset]) -> None:
    with styled():
        one = PICTURES["F3"].draw(results)
        more = PICTURES["F4"].draw(results)
    assert texts(one).count("paper 377") == 2
    assert texts(more).count("paper 200") == 1
    # NEURONS has no four classes at quick size.
    assert sum(text.startswith("MST ") for text in texts(more)) == 4


def test_names_on_a_colour_bar_do_not_hide_each_other() -> None:
    assert sides([0.6, 0.8]) == ["right", "left"]
    assert sides([0.05, 0.9]) == ["left", "right"]
    assert sides([0.5]) == ["center"]


def test_a_best_line_at_the_end_of_the_range_is_said_in_the_caption(
    results: dict[str, xr.Dataset],
) -> None:
    assert PICTURES["F3"].full_caption(results) == PICTURES["F3"].caption
    rising = world(lambda setting: 1_000 * (1 - setting["eta"]) * setting["alpha"], ["F3"], 1)

    assert (
        PICTURES["F3"]
        .full_caption(rising)
        .endswith("the best may lie beyond: α* = 0.5 (one class).")
    )


def test_every_run_of_more_than_five_is_drawn() -> None:
    many = world(as_in_the_paper, ("F3", "F4"), 7)
    with styled():
        figure = draw_residuals(many)
    handles, labels = figure.axes[0].get_legend_handles_labels()

    assert labels == [str(seed) for seed in range(7)]
    looks = {(h.lines[0].get_marker(), h.lines[0].get_color()) for h in handles}
    assert len(looks) == 7


def test_neurons_in_continuous_time_are_those_of_the_first_stored_seed() -> None:
    weights = xr.DataArray(
        np.full((1, 2, 100), 0.05),
        {"classes": [2], "pattern_seed": [3, 7]},
        ("classes", "pattern_seed", "channel"),
    )
    stored = xr.Dataset({"weights": weights}, attrs={"settings": {"common": {"alpha": 0.3}}})
    figure = PICTURES["F2"].draw({"F2": stored})
    titles = [axes.get_title(loc="left") for axes in figure.axes]

    assert [title[:18] for title in titles] == ["pattern of class 0", "pattern of class 1"]


def test_a_figure_without_its_data_is_left_out(
    results: dict[str, xr.Dataset], tmp_path: Path
) -> None:
    assert draw({n: PICTURES[n] for n in ("F6", "F3")}, {"F7": results["F7"]}, tmp_path) == {}


def test_the_same_data_give_the_same_file(results: dict[str, xr.Dataset], tmp_path: Path) -> None:
    first = draw({"F5a": PICTURES["F5a"]}, results, tmp_path / "a")["F5a"]
    second = draw({"F5a": PICTURES["F5a"]}, results, tmp_path / "b")["F5a"]

    for kind in first:
        assert first[kind].read_bytes() == second[kind].read_bytes(), kind


def test_grey_printing_keeps_the_order_of_the_scores() -> None:
    """Cividis rises in lightness from end to end."""
    red, green, blue, _ = matplotlib.colormaps[MAP](np.linspace(0, 1, 64)).T
    lightness = 0.2126 * red + 0.7152 * green + 0.0722 * blue

    assert np.all(np.diff(lightness) > 0)


def test_every_experiment_is_drawn_or_judged() -> None:
    used = {need for one in (*PICTURES.values(), *claims()) for need in one.needs}

    assert set(experiments()) <= used


def test_a_folder_that_cannot_be_made_is_an_error(results: dict[str, xr.Dataset]) -> None:
    with styled():
        figure = PICTURES["F5a"].draw(results)
    with pytest.raises(ValueError, match="cannot write /proc/nowhere"):
        save(figure, Path("/proc/nowhere"), "F5a", FORMATS)
