"""The journal of a store: each line vouches for itself, and repair ends well."""

from __future__ import annotations

import json
import random
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from agents.experiments.journal import DATA, JOURNAL, StoreError, read_journal
from agents.experiments.listing import experiment, experiments
from agents.experiments.store import open_store, read
from tests.agents.experiments.toys import toy, work

STORES = Path(__file__).resolve().parents[3] / "docs" / "reproduction" / "quick" / "stores"


def fill(folder: Path, blocks: int | None = None, *, repair: bool = False) -> None:
    with open_store(folder, toy(seeds=2), repair=repair) as store:
        for block in store.pending()[:blocks]:
            store.write(block, work(block), 0.01, "here")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stores") / "toy"
    fill(folder)
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return shutil.copytree(whole, tmp_path / "toy")


def lines(folder: Path) -> list[str]:
    return (folder / JOURNAL).read_text().splitlines()


def write(folder: Path, text: list[str]) -> None:
    (folder / JOURNAL).write_text("".join(f"{line}\n" for line in text))


def unsealed(line: str) -> str:
    """A line as stores of format 1 have it."""
    entry = json.loads(line)
    del entry["check"]
    return json.dumps({**entry, **({"store": 1} if "store" in entry else {})})


def test_one_changed_digit_never_makes_a_missing_block_complete(folder: Path) -> None:
    write(folder, lines(folder)[:-1])
    renamed = lines(folder)
    renamed[3] = renamed[3].replace('"block": 2', '"block": 11')
    for text in (renamed, [*lines(folder), renamed[3]]):
        write(folder, text)
        with pytest.raises(StoreError, match=r"line \d+ of .* is damaged.*--repair"):
            read(folder)


def test_in_a_store_of_format_1_the_names_of_the_files_give_a_changed_number_away(
    folder: Path,
) -> None:
    old = [unsealed(line) for line in lines(folder)]
    write(folder, old)
    read(folder)
    write(folder, [*old[:-1], old[3].replace('"block": 2', '"block": 11')])
    with pytest.raises(StoreError, match=r"line 13 of .* is damaged"):
        read(folder)


def test_a_store_of_format_1_becomes_one_that_vouches_for_itself(folder: Path) -> None:
    write(folder, [unsealed(line) for line in lines(folder)])
    with open_store(folder, toy(seeds=2)) as store:
        assert store.pending() == []
    assert all("check" in json.loads(line) for line in lines(folder))
    assert json.loads(lines(folder)[0])["store"] == 2


@pytest.mark.parametrize("old", [False, True], ids=["format 2", "format 1"])
@pytest.mark.parametrize(
    "damage",
    [
        lambda line: "nonsense",
        lambda line: "",
        lambda line: line.replace('"experiment": "toy"', '"experiment": "toi"'),
        lambda line: line.replace('"blocks": 12', '"blocks": 11'),
        lambda line: line.replace('"alpha": [0.0', '"alpha": [0.1'),
        lambda line: line[:40],
    ],
)
def test_a_damaged_first_line_is_made_again_from_the_data(
    folder: Path, whole: Path, damage: Callable[[str], str], old: bool
) -> None:
    text = [unsealed(line) if old else line for line in lines(folder)]
    write(folder, [damage(text[0]), *text[1:]])
    xr.testing.assert_identical(read(folder), read(whole))
    with open_store(folder, toy(seeds=2)) as store:
        assert store.pending() == []
    assert json.loads(lines(folder)[0])["settings"] == toy(seeds=2).settings()


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: write(folder, ["[1]", *lines(folder)[1:5], "7", '"text"', "{}"]),
        lambda folder: write(folder, [*lines(folder)[:4], lines(folder)[4][:-20], "x"]),
        lambda folder: (folder / JOURNAL).write_bytes(b"\xff\x00" * 300 + b"\n"),
        lambda folder: (folder / JOURNAL).write_bytes(b""),
        lambda folder: (folder / JOURNAL).unlink(),
        lambda folder: (folder / DATA / "zarr.json").unlink(),
        lambda folder: [(folder / DATA / "zarr.json").unlink(), write(folder, lines(folder)[1:])],
        lambda folder: shutil.rmtree(folder / DATA),
        lambda folder: shutil.rmtree(folder / DATA / "survived"),
        lambda folder: (folder / DATA / "survived" / "zarr.json").write_text("{}"),
    ],
)
def test_whatever_is_damaged_is_refused_or_mended_and_repair_ends_well(
    folder: Path, whole: Path, damage: Callable[[Path], Any]
) -> None:
    damage(folder)
    try:
        with open_store(folder, toy(seeds=2)):
            pass
    except StoreError:
        pass
    fill(folder, repair=True)
    xr.testing.assert_equal(read(folder), read(whole))


def test_a_flipped_bit_anywhere_is_refused_mended_or_without_effect(
    whole: Path, tmp_path: Path
) -> None:
    sound, rng = read(whole), random.Random(1)
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    for number in range(60):
        folder = shutil.copytree(whole, tmp_path / str(number))
        path = folder / rng.choice([*files, Path(JOURNAL)])
        data = bytearray(path.read_bytes())
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        try:
            found = read(folder)
        except StoreError as error:
            assert "damaged" in str(error)
        else:
            xr.testing.assert_equal(found, sound)
        fill(folder, repair=True)
        xr.testing.assert_equal(read(folder), sound)


def test_a_line_cut_short_at_the_end_is_a_block_that_is_not_done(folder: Path) -> None:
    journal = folder / JOURNAL
    journal.write_bytes(journal.read_bytes()[:-1])
    assert len(read_journal(folder).blocks) == 11
    assert read_journal(folder).malformed == ()


@pytest.mark.parametrize("name", experiments())
def test_the_stores_in_the_repository_still_open_and_are_complete(
    name: str, tmp_path: Path
) -> None:
    with zipfile.ZipFile(STORES / f"{name}.zip") as archive:
        archive.extractall(tmp_path / name)
    read(tmp_path / name)
    with open_store(tmp_path / name, experiment(name, "quick")) as store:
        assert store.pending() == []
