from __future__ import annotations

import errno
import multiprocessing
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from agents.experiments.design import Axis, Experiment
from agents.experiments.former_names import current
from agents.experiments.journal import DATA, JOURNAL, StoreError
from agents.experiments.store import open_store, read, summarise
from tests.agents.experiments.toys import toy, work


def fill(folder: Path, experiment: Experiment, count: int | None = None) -> None:
    """Compute and write the first `count` pending blocks, all by default."""
    with open_store(folder, experiment) as store:
        for block in store.pending()[:count]:
            store.write(block, work(block), 0.01, "here")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "toy"


def test_what_is_written_is_read_with_names_units_and_protocol(folder: Path) -> None:
    fill(folder, toy())

    results = read(folder)

    assert results["survived"].dims == ("classes", "pattern_seed", "alpha", "run")
    assert results["survived"].attrs["units"] == "bins"
    assert results["alpha"].attrs["units"] == "1/bin"
    assert results.attrs["settings"] == toy().settings()
    assert results.attrs["settings"]["protocol"] == {"trials": 10}
    assert results.attrs["software"].startswith("gnm-env")
    assert len(results.attrs["commit"]) >= 7
    for cell in (results.sel(classes=3, pattern_seed=1, alpha=1.0),):
        expected = np.random.default_rng((3, 1, 100)).random(5)
        np.testing.assert_array_equal(cell["survived"], (expected[:4] * 1e4).astype(int))
        assert float(cell["error_rate"]) == expected[4]


def test_a_chunk_of_nothing_but_blanks_is_no_damage(folder: Path) -> None:
    with open_store(folder, toy()) as store:
        for block in store.pending():
            blank = {
                "survived": np.full((*block.shape, 4), -1),
                "error_rate": np.full(block.shape, np.nan),
            }
            store.write(block, blank, 0.0, "here")

    assert (read(folder)["survived"] == -1).all()


def test_names_on_an_axis_select(folder: Path) -> None:
    experiment = toy()
    names = Axis("learner", ("GNM, ALL", "η > 0"), settings=({"classes": 1}, {"classes": 2}))
    named = Experiment(
        "names", "", (names, *experiment.axes[1:]), experiment.common, work,
        experiment.variables, experiment.lengths,
    )  # fmt: skip
    fill(folder, named)

    assert int(read(folder)["survived"].sel(learner="η > 0").min()) >= 0


def test_a_store_goes_on_where_it_stopped(folder: Path) -> None:
    fill(folder, toy(), 4)
    assert (summarise(folder).done, summarise(folder).blocks) == (4, 18)

    with open_store(folder, toy()) as store:
        assert [block.number for block in store.pending()] == list(range(4, 18))


def test_an_unfinished_store_is_not_read(folder: Path) -> None:
    fill(folder, toy(), 4)

    with pytest.raises(StoreError, match=r"toy is not finished: 4 of 18 blocks"):
        read(folder)


def test_no_store_at_all_is_said(folder: Path) -> None:
    with pytest.raises(StoreError, match="there is no store at"):
        read(folder)


def test_other_settings_are_refused_and_the_difference_named(folder: Path) -> None:
    fill(folder, toy(), 1)

    with (
        pytest.raises(StoreError, match=r"common\.bonus is 0\.0 there and 1\.0 here"),
        open_store(folder, toy(bonus=1.0)),
    ):
        pass
    with (
        pytest.raises(
            StoreError, match=r"axes\.pattern_seed is \[0, 1, 2\] there and \[0, 1\] here"
        ),
        open_store(folder, toy(seeds=2)),
    ):
        pass


def test_a_folder_that_is_no_store_is_left_alone(folder: Path) -> None:
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")

    with pytest.raises(StoreError, match="is not a store"), open_store(folder, toy()):
        pass
    assert [path.name for path in folder.iterdir()] == ["thesis.txt"]


def test_a_journal_line_cut_short_costs_its_block_only(folder: Path) -> None:
    fill(folder, toy(), 3)
    journal = folder / JOURNAL
    journal.write_bytes(journal.read_bytes()[:-40])

    with open_store(folder, toy()) as store:
        assert [block.number for block in store.pending()] == list(range(2, 18))
        for block in store.pending():
            store.write(block, work(block), 0.0, "here")
    read(folder)


def test_a_creation_cut_short_is_done_again(folder: Path) -> None:
    partial = folder.with_name("toy.partial")
    (partial / DATA).mkdir(parents=True)

    fill(folder, toy())

    read(folder)
    assert not partial.exists()


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize("damage", [truncate, flip, Path.unlink])
@pytest.mark.parametrize("path", ["survived/c/1/2/1/0", "error_rate/c/1/2/1"])
def test_a_damaged_chunk_is_found_named_and_computed_again_on_request(
    folder: Path, damage: Callable[[Path], None], path: str
) -> None:
    fill(folder, toy())
    whole = read(folder)
    damage(folder / DATA / path)

    named = rf"{path} \(block 11: classes 2, pattern_seed 2, alpha 0\.75 … 1\.0\).*--repair"
    with pytest.raises(StoreError, match=named):
        read(folder)
    with pytest.raises(StoreError, match=named), open_store(folder, toy()):
        pass

    with open_store(folder, toy(), repair=True) as store:
        assert [block.number for block in store.pending()] == [11]
        store.write(store.pending()[0], work(store.pending()[0]), 0.0, "here")
    xr.testing.assert_identical(read(folder), whole)


@pytest.mark.parametrize("path", ["zarr.json", "survived/zarr.json", "alpha/c/0"])
def test_damaged_attributes_and_coordinates_are_mended_without_computing(
    folder: Path, path: str
) -> None:
    fill(folder, toy())
    whole = read(folder)
    truncate(folder / DATA / path)
    with pytest.raises(StoreError, match=path):
        read(folder)

    with open_store(folder, toy(), repair=True) as store:
        assert store.pending() == []
    xr.testing.assert_identical(read(folder), whole)


def test_a_block_of_another_shape_is_refused(folder: Path) -> None:
    with open_store(folder, toy()) as store:
        block = store.pending()[0]
        values = work(block) | {"error_rate": np.zeros(7)}
        with pytest.raises(ValueError, match=r"block 0 must give error_rate of shape \(1, 1, 3\)"):
            store.write(block, values, 0.0, "here")
        with pytest.raises(ValueError, match=r"survived .* got nothing"):
            store.write(block, {}, 0.0, "here")


def _hold(folder: Path, ready: Any, done: Any) -> None:
    with open_store(folder, toy()):
        ready.set()
        done.wait(30)


def test_a_second_process_is_refused_until_the_first_ends(folder: Path) -> None:
    context = multiprocessing.get_context("spawn")
    ready, done = context.Event(), context.Event()
    process = context.Process(target=_hold, args=(folder, ready, done))
    process.start()
    try:
        assert ready.wait(30)
        with (
            pytest.raises(StoreError, match=rf"in use by process {process.pid} on "),
            open_store(folder, toy()),
        ):
            pass
        process.kill()  # a lock outlives nobody, however they end
        process.join()
        with open_store(folder, toy()) as store:
            assert len(store.pending()) == 18
    finally:
        process.kill()
        process.join()


def test_a_full_disk_leaves_what_was_finished(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(folder, toy(), 2)

    def full(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with open_store(folder, toy()) as store:
        monkeypatch.setattr("zarr.storage._local._put", full)
        block = store.pending()[0]
        with pytest.raises(OSError, match="No space left"):
            store.write(block, work(block), 0.0, "here")
    monkeypatch.undo()
    assert summarise(folder).done == 2
    fill(folder, toy())
    read(folder)


def as_formerly(experiment: Experiment) -> Experiment:
    """The same experiment under the names that an earlier version gave."""
    names = Axis("start", ("matched", "published"), chunk=0)
    axes = (*experiment.axes[:2], names)
    common = {**experiment.common, "start": "published", "alpha": 0.0}
    return replace(experiment, name="F3-published", axes=axes, common=common)


def test_a_store_with_former_names_is_read_and_goes_on_under_those_of_today(tmp_path: Path) -> None:
    former = as_formerly(toy())
    today = replace(
        former,
        name="F3-wide",
        axes=(*former.axes[:2], Axis("start", ("matched", "wide"), chunk=0)),
        common={**former.common, "start": "wide"},
    )
    fill(tmp_path / "F3-published", former, 1)
    fill(tmp_path / "F3-wide", today)

    results = read(tmp_path / "F3-wide")
    assert not (tmp_path / "F3-wide").exists()
    assert results["start"].to_numpy().tolist() == ["matched", "wide"]
    assert results.attrs["settings"]["common"]["start"] == "wide"
    assert int(results["survived"].sel(start="wide").min()) >= 0
    assert summarise(tmp_path / "F3-wide").done == len(today.blocks())


def test_former_names_are_no_others() -> None:
    kept = ["GNM, ALL as published", "publisheds", "unpublished", 3, None]
    assert current(kept) == kept
    assert current({"published": ["published: GNM 0.3, ET", "GNM, ET, tuned λ, published"]}) == {
        "wide": ["wide: GNM 0.3, ET", "GNM, ET, tuned λ, wide"]
    }


def test_an_axis_with_no_value_but_zero_is_no_damage(folder: Path) -> None:
    fill(folder, toy(seeds=1))

    assert read(folder)["pattern_seed"].to_numpy().tolist() == [0]
