from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from drawing import continuous, maps, style
from experiments.registry import NAMES
from figures import PICTURES, caption, draw, save
from tests.scripts.worlds import as_in_the_paper, world

SCORED = ("F1", "F3", "F3-published", "F4", "F6", "F7", "table")


@pytest.fixture(scope="module")
def results() -> dict[str, xr.Dataset]:
    return world(as_in_the_paper, SCORED, 3)


DRAWABLE = [name for name, picture in PICTURES.items() if set(picture.needs) <= set(SCORED)]


@pytest.mark.parametrize("name", DRAWABLE)
def test_every_figure_is_drawn_as_vector_and_as_pixels(
    name: str, results: dict[str, xr.Dataset], tmp_path: Path
) -> None:
    paths = draw(results, tmp_path, [name])[name]

    assert paths["pdf"].read_bytes().startswith(b"%PDF")
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert "<svg" in paths["svg"].read_text(encoding="utf-8")


def test_every_axis_has_a_label_with_units(results: dict[str, xr.Dataset]) -> None:
    with style.styled():
        figure = maps.one_class(results)
    labels = {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())}
    style.plt.close(figure)

    assert labels == {"η (model choice)", "α (decay per bin)", "noisy performance (bins)", ""}


def test_a_best_line_at_the_end_of_the_range_is_said_in_the_caption(
    results: dict[str, xr.Dataset],
) -> None:
    assert caption("F3", results) == PICTURES["F3"].caption
    rising = world(lambda setting: 1_000 * (1 - setting["eta"]) * setting["alpha"], ["F3"], 1)

    assert caption("F3", rising).endswith("the best may lie beyond: α* = 0.5 (one class).")


def test_every_run_of_more_than_five_is_drawn() -> None:
    many = world(as_in_the_paper, ("F3", "F4"), 7)
    with style.styled():
        figure = maps.residual_plot(many)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    style.plt.close(figure)

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
    with style.styled():
        figure = continuous.classes({"F2": stored})
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    style.plt.close(figure)

    assert [title[:18] for title in titles] == ["pattern of class 1", "pattern of class 2"]


def test_a_figure_without_its_data_is_left_out(
    results: dict[str, xr.Dataset], tmp_path: Path
) -> None:
    assert draw({"F7": results["F7"]}, tmp_path, ["F6", "F3"]) == {}


def test_the_same_data_give_the_same_file(results: dict[str, xr.Dataset], tmp_path: Path) -> None:
    first = draw(results, tmp_path / "a", ["F5a"])["F5a"]
    second = draw(results, tmp_path / "b", ["F5a"])["F5a"]

    for kind in first:
        assert first[kind].read_bytes() == second[kind].read_bytes(), kind


def test_grey_printing_keeps_the_order_of_the_scores() -> None:
    """Cividis rises in lightness from end to end."""
    red, green, blue, _ = style.plt.get_cmap(style.MAP)(np.linspace(0, 1, 64)).T
    lightness = 0.2126 * red + 0.7152 * green + 0.0722 * blue

    assert np.all(np.diff(lightness) > 0)


def test_every_experiment_is_in_a_figure_or_beside_one() -> None:
    drawn = {need for picture in PICTURES.values() for need in picture.needs}

    assert set(NAMES) - drawn == {"BP"}, "BP joins figure 7 when it is there"


def test_a_folder_that_cannot_be_made_is_an_error(results: dict[str, xr.Dataset]) -> None:
    with style.styled():
        figure = maps.against_alpha(results)
    with pytest.raises(OSError):
        save(figure, Path("/proc/nowhere"), "F5a")
