"""Files are whole or not there; a file that lies about itself costs no memory and no crash."""

from __future__ import annotations

import errno
import multiprocessing
import os
import pickle
import signal
import stat
import subprocess
import sys
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gnm_env import files
from gnm_env.files import ArraySpec, atomic_write, open_arrays, read_arrays, write_arrays

SPECS = {"a": ArraySpec("f8", (3,)), "b": ArraySpec("i4", (None, 2)), "c": ArraySpec("u1")}
ARRAYS = {"a": np.arange(3.0), "b": np.ones((4, 2), np.int32), "c": np.arange(9, dtype=np.uint8)}


def put(path: Path, content: bytes = b"new") -> None:
    with atomic_write(path) as file:
        file.write(content)


# --- writing --------------------------------------------------------------------------------------


def test_a_link_stays_a_link_and_its_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "file").write_bytes(b"old")
    (tmp_path / "link").symlink_to(Path("deep") / "file")
    (tmp_path / "dangling").symlink_to(Path("deep") / "other")
    put(tmp_path / "link")
    put(tmp_path / "dangling")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "dangling").is_symlink()
    assert (tmp_path / "deep" / "file").read_bytes() == b"new"
    assert (tmp_path / "deep" / "other").read_bytes() == b"new"


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666, 0o755])
def test_the_permissions_of_a_file_survive(mode: int, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    path.chmod(mode)
    with atomic_write(path) as file:
        file.write(b"new")
        part = next(p for p in tmp_path.iterdir() if p != path)
        assert stat.S_IMODE(part.stat().st_mode) == mode  # nobody reads along meanwhile
    assert stat.S_IMODE(path.stat().st_mode) == mode


@pytest.mark.parametrize("name", ["x" * 244, "y" * 255, "é" * 127, "." + "z" * 254])
def test_the_longest_names_that_a_folder_takes_work(name: str, tmp_path: Path) -> None:
    put(tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_name_that_is_too_long_is_blamed_itself(tmp_path: Path) -> None:
    with pytest.raises(
        ValueError, match=r"its name \(256 bytes\).*too long; choose a shorter name"
    ):
        put(tmp_path / ("x" * 256))


def test_what_is_no_place_for_a_file_is_refused_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    for path, message in (
        (tmp_path, "it is a folder; give the path of a file in it"),
        (tmp_path / "no" / "file", "there is no folder .*no; make it first"),
        (tmp_path / "file" / "file", "is not a folder; choose a folder"),
        (tmp_path / "loop", "symbolic links"),
        (tmp_path / "pipe", "it is no regular file"),
        (tmp_path / "zero\0byte", "null byte.*choose another name"),
        (None, "a path must be text or os.PathLike, got NoneType"),
        (3, "a path must be text or os.PathLike, got int"),
    ):
        with pytest.raises(ValueError, match=message):
            put(path)  # type: ignore[arg-type]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "loop", "pipe"]


def test_a_protected_file_or_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    with monkeypatch.context() as patch:  # the superuser may write everywhere
        patch.setattr(os, "access", lambda *_: False)
        with pytest.raises(ValueError, match="file is write-protected"):
            put(path)

    def denied(*args: Any, **keywords: Any) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    with monkeypatch.context() as patch:
        patch.setattr(os, "open", denied)
        with pytest.raises(ValueError, match="Permission denied; choose a folder that is writable"):
            put(path)
    assert path.read_bytes() == b"old"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a limit on file sizes")
def test_a_full_disk_is_told_and_leaves_the_old_file(tmp_path: Path) -> None:
    code = (
        "import resource, signal\n"
        "from gnm_env.files import atomic_write\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "try:\n"
        "    with atomic_write('file') as file:\n"
        "        file.write(bytes(10_000))\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    (tmp_path / "file").write_bytes(b"old")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True
    )
    assert "make room or choose another disk" in done.stdout, done.stderr
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("file", b"old")]


def hang_while_saving(path: Path) -> None:
    with atomic_write(path) as file:
        file.write(b"half a fi")
        file.flush()
        time.sleep(600)


def wait_for(condition: Any) -> None:
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_what_killed_savers_left_goes_at_the_next_save_and_a_living_one_is_left_alone(
    tmp_path: Path,
) -> None:
    path = tmp_path / "file"
    context = multiprocessing.get_context("spawn")
    savers = [context.Process(target=hang_while_saving, args=(path,)) for _ in range(3)]
    for saver in savers:
        saver.start()
    wait_for(lambda: [p.stat().st_size for p in tmp_path.iterdir()] == [9, 9, 9])
    for saver in savers[:2]:
        assert saver.pid is not None
        os.kill(saver.pid, signal.SIGKILL)
        saver.join()
    put(path, b"mine")
    assert path.read_bytes() == b"mine"
    assert len(list(tmp_path.iterdir())) == 2  # the file, and what the living saver writes
    savers[2].kill()
    savers[2].join()
    put(path, b"last")
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("file", b"last")]


def test_many_savers_at_once_leave_one_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "file"
    contents = [bytes([k]) * 100_000 for k in range(8)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: put(path, contents[k % 8]), range(200)))
    assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_planted_at_the_temporary_name_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "victim").write_bytes(b"precious")
    (tmp_path / ".file.part").symlink_to("victim")
    put(tmp_path / "file")
    assert (tmp_path / "victim").read_bytes() == b"precious"
    assert (tmp_path / "file").read_bytes() == b"new"


@pytest.mark.parametrize("missing", ["module", "support"])
def test_without_file_locks_saving_goes_on(
    missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsupported(*_: Any) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    if missing == "module":
        monkeypatch.setattr(files, "fcntl", None)
    else:
        monkeypatch.setattr(files.fcntl, "flock", unsupported)
    put(tmp_path / "file", b"old")
    (tmp_path / ".file.part").write_bytes(b"of a living saver, for all that is known")
    put(tmp_path / "file")
    assert (tmp_path / "file").read_bytes() == b"new"
    assert len(list(tmp_path.iterdir())) == 2


# --- reading --------------------------------------------------------------------------------------


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    path = tmp_path / "arrays.npz"
    write_arrays(path, ARRAYS)
    return path


def same(read: dict[str, Any]) -> bool:
    return read.keys() == ARRAYS.keys() and all(
        read[name].dtype == array.dtype and np.array_equal(read[name], array)
        for name, array in ARRAYS.items()
    )


def test_arrays_come_back_as_they_were_and_can_be_written_to(whole: Path) -> None:
    read = read_arrays(whole, SPECS)
    assert same(read)
    assert all(array.flags.writeable and array.flags.c_contiguous for array in read.values())


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_numpys_own_files_are_read_whatever_their_order(save: Any, tmp_path: Path) -> None:
    swapped = {name: array.astype(array.dtype.newbyteorder()) for name, array in ARRAYS.items()}
    save(tmp_path / "file.npz", **{n: np.asfortranarray(a) for n, a in swapped.items()})
    assert same(read_arrays(tmp_path / "file.npz", SPECS))


def test_large_arrays_come_back_in_one_piece(tmp_path: Path) -> None:
    array = np.random.default_rng(0).random(300_000)
    np.savez_compressed(tmp_path / "file.npz", array=array)
    read = read_arrays(tmp_path / "file.npz", {"array": ArraySpec("f8", (None,))})
    assert np.array_equal(read["array"], array)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": np.arange(4.0)}, r"'a' must have shape \(3\), got \(4,\)"),
        ({"a": np.arange(3)}, "'a' must be float64, got int64"),
        ({"b": np.ones((4, 3), np.int32)}, r"'b' must have shape \(any, 2\)"),
        ({"b": np.ones(4, np.int32)}, r"'b' must have shape \(any, 2\)"),
        ({"z": np.ones(2)}, "'z' that does not belong there"),
        ({"c": None}, r"no array 'c' \(it holds 'a', 'b'\)"),
    ],
)
def test_other_arrays_than_expected_are_refused(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    arrays = {name: array for name, array in {**ARRAYS, **change}.items() if array is not None}
    write_arrays(tmp_path / "file", arrays)
    with pytest.raises(ValueError, match=rf"file is not a readable file of arrays: .*{message}"):
        read_arrays(tmp_path / "file", SPECS)


def test_an_array_that_is_not_required_may_be_missing(whole: Path) -> None:
    assert same(read_arrays(whole, {**SPECS, "d": ArraySpec("f8", required=False)}))


def test_python_objects_are_neither_written_nor_read(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> Any:
            return os.mkdir, (str(tmp_path / "exploded"),)

    array = np.array([Bomb()], dtype=object)
    with pytest.raises(ValueError, match="Python objects"):
        write_arrays(tmp_path / "file", {"a": array})
    np.savez(tmp_path / "bomb.npz", a=array)
    with pytest.raises(ValueError, match="holds Python objects, which are never read") as refusal:
        read_arrays(tmp_path / "bomb.npz", SPECS)
    assert "pickle" not in str(refusal.value)
    assert not (tmp_path / "exploded").exists()


def test_what_another_file_is_is_said(tmp_path: Path) -> None:
    path = tmp_path / "file"
    np.save(tmp_path / "array.npy", np.arange(3))
    for content, kind in (
        (b"", "an empty file"),
        ("channel,zeit in ms, größe\n".encode() * 100, "a text file"),
        ((tmp_path / "array.npy").read_bytes(), "a single NumPy array"),
        (pickle.dumps([1, 2]), "a Python pickle"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "an HDF5 file"),
        (bytes(range(256)), "of an unknown kind, or damaged"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"not a readable checkpoint: it is {kind}") as refusal:
            read_arrays(path, SPECS, what="checkpoint")
        assert "pickle" not in str(refusal.value) or "pickle" in kind
    for path, message in (
        (tmp_path, "it is a folder"),
        (tmp_path / "missing", "there is no checkpoint .*missing"),
        (tmp_path / ("x" * 300), "too long"),
        (Path("/dev/null"), "it is no regular file"),
        (Path("zero\0byte"), "null byte"),
    ):
        with pytest.raises(ValueError, match=message):
            read_arrays(path, SPECS, what="checkpoint")


def claiming(path: Path, shape: str, *, body: bytes = b"", compressed: bool = False) -> Path:
    """A zip with one array whose header claims `shape`."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + body
    method = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr("a.npy", content)
    return path


@pytest.mark.parametrize(
    "shape",
    ["(400_000_000,)", "(2**40,)", "(10**30,)", "(-1,)", "(9" + "9" * 17 + ", 4)", "(3", "(3.0,)"],
)
def test_a_small_file_gets_no_memory_for_what_it_claims(shape: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not a readable"):
        read_arrays(claiming(tmp_path / "file", shape), {"a": ArraySpec("f8")})


def test_a_file_that_unpacks_to_more_than_the_limit_is_refused(tmp_path: Path) -> None:
    size = 3_000_000
    bomb = claiming(tmp_path / "f", f"({size},)", body=bytes(8 * size), compressed=True)
    assert bomb.stat().st_size < 100_000
    with pytest.raises(ValueError, match="more than 1,000,000 bytes of memory"):
        read_arrays(bomb, {"a": ArraySpec("f8")}, limit=1_000_000)
    assert len(read_arrays(bomb, {"a": ArraySpec("f8")})["a"]) == size


def test_every_flipped_bit_is_refused_or_without_effect(whole: Path) -> None:
    content = whole.read_bytes()
    refused = 0
    for place in range(len(content)):
        flipped = bytearray(content)
        flipped[place] ^= 1 << (place % 8)
        whole.write_bytes(flipped)
        try:
            assert same(read_arrays(whole, SPECS)), place
        except ValueError as refusal:
            assert "not a readable" in str(refusal) or "cannot read" in str(refusal)
            refused += 1
    assert refused > 0.6 * len(content)


def test_a_truncated_file_is_refused_wherever_it_ends(whole: Path) -> None:
    content = whole.read_bytes()
    for length in range(0, len(content), 7):
        whole.write_bytes(content[:length])
        with pytest.raises(ValueError, match="not a readable"):
            read_arrays(whole, SPECS)


def test_an_error_over_the_contents_is_told_of_the_file(whole: Path) -> None:
    with (
        pytest.raises(ValueError, match="not a readable thing: kind"),
        open_arrays(whole, what="thing") as file,
    ):
        assert file.names == ("a", "b", "c")
        {}["kind"]
