"""Compiled code is kept on disk, and an edit anywhere below it compiles anew."""

from __future__ import annotations

import os
import pickle
import stat
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gnm_env.compiled import _Files, compiled, specialise

FACTOR = 2.0


def template(x: float) -> float:
    return FACTOR * x


def test_specialise_binds_names_of_the_template() -> None:
    assert specialise(template, "three", FACTOR=3.0)(2.0) == 6.0
    assert compiled(template)(2.0) == 4.0


def ran(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The code in a process of its own, run in `folder`."""
    # The folder of this checkout, wherever the tests run: the working folder is another.
    found = {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, **found, **environment},
        capture_output=True,
        text=True,
        check=True,
    )


def printed(code: str, folder: Path, **environment: str) -> tuple[str, ...]:
    """The words that the code prints."""
    return tuple(ran(code, folder, **environment).stdout.split())


def test_an_edit_to_a_called_function_in_another_file_is_noticed(tmp_path: Path) -> None:
    package = tmp_path / "growing"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "outer.py").write_text(
        "from gnm_env.compiled import compiled\n"
        "from growing.inner import inner\n"
        "@compiled\n"
        "def outer(x):\n"
        "    return inner(x) + 1\n"
    )

    def answer(increment: int) -> tuple[str, ...]:
        (package / "inner.py").write_text(
            "from gnm_env.compiled import compiled\n"
            f"STEP = {increment}\n"
            "@compiled\n"
            "def inner(x):\n"
            "    return x + STEP\n"
        )
        code = (
            "from growing.outer import outer\n"
            "print(outer(10), sum(outer.stats.cache_hits.values()))"
        )
        return printed(code, tmp_path)

    assert answer(1) == ("12", "0")
    assert answer(1) == ("12", "1")
    assert answer(5) == ("16", "0")


def test_an_edit_to_a_bound_function_of_another_package_is_noticed(tmp_path: Path) -> None:
    """As of a neuron of one's own, whose `step` the kernels bind."""
    (tmp_path / "templates.py").write_text("def template(x):\n    return step(x) + 1\n")

    def answer(increment: int) -> tuple[str, ...]:
        (tmp_path / "mine.py").write_text(
            "from gnm_env.compiled import compiled\n"
            f"def plain(x):\n    return x + {increment}\n"
            "helper = compiled(plain)\n"
            "@compiled\n"
            "def step(x):\n"
            "    return helper(x)\n"
        )
        code = (
            "import mine, templates\n"
            "from gnm_env.compiled import specialise\n"
            "bound = specialise(templates.template, 'mine', step=mine.step)\n"
            "print(bound(10), sum(bound.stats.cache_hits.values()))"
        )
        return printed(code, tmp_path)

    assert answer(1) == ("12", "0")
    assert answer(1) == ("12", "1")
    assert answer(5) == ("16", "0")


@pytest.mark.parametrize(
    ("first", "second"), [("(1, 2)", "(5, 2)"), ("np.dtype([('a', 'i8')])", "np.dtype('i2')")]
)
def test_an_edit_to_a_constant_in_another_file_is_noticed(
    tmp_path: Path, first: str, second: str
) -> None:
    """Of a file of which nothing else is used: a tuple, the type of a record."""
    (tmp_path / "user.py").write_text(
        "import numpy as np\n"
        "from gnm_env.compiled import compiled\n"
        "from constants import VALUE\n"
        "@compiled\n"
        "def taken():\n"
        + ("    return VALUE[0]\n" if "(1" in first else "    return np.zeros(3, VALUE).nbytes\n")
    )

    def answer(value: str) -> tuple[str, ...]:
        (tmp_path / "constants.py").write_text(f"import numpy as np\nVALUE = {value}\n")
        code = "from user import taken\nprint(taken(), sum(taken.stats.cache_hits.values()))"
        return printed(code, tmp_path)

    before = answer(first)
    assert answer(first) == (before[0], "1")
    after = answer(second)
    assert after[1] == "0" and after[0] != before[0]


def test_a_bound_function_that_was_typed_in_needs_no_file(tmp_path: Path) -> None:
    (tmp_path / "templates.py").write_text("def template(x):\n    return step(x) + 1\n")
    code = (
        "import templates\n"
        "from numba import njit\n"
        "from gnm_env.compiled import specialise\n"
        "step = njit(lambda x: x + 1)\n"
        "print(specialise(templates.template, 'typed', step=step)(10))"
    )
    assert printed(code, tmp_path) == ("12",)


# --- the cache never stops work -------------------------------------------------------------------

SOURCE = """
from gnm_env.compiled import compiled
@compiled
def third(x):
    return x[2]
"""
CALL = (
    "import sys\n"
    "sys.path.insert(0, '')\n"
    "import numpy as np\n"
    "from small import third\n"
    "print(third(np.arange(5.0)), sum(third.stats.cache_hits.values()))"
)


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder with a module of one compiled function, in the cache by now."""
    (tmp_path / "small.py").write_text(SOURCE)
    assert printed(CALL, tmp_path) == ("2.0", "0")
    return tmp_path


def cached(folder: Path) -> list[Path]:
    return sorted(folder.glob("**/*third*.nb?"))


def flip(place: float) -> Callable[[bytes], bytes]:
    def change(content: bytes) -> bytes:
        flipped = bytearray(content)
        flipped[int(place * (len(content) - 1))] ^= 16
        return bytes(flipped)

    return change


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(lambda content: b"", id="empty"),
        pytest.param(lambda content: content[:-1], id="cut short"),
        pytest.param(flip(0.5), id="a bit of the machine code"),
    ],
)
def test_damaged_files_are_compiled_anew_and_mended(
    damage: Callable[[bytes], bytes], small: Path
) -> None:
    (file,) = cached(small)
    content = file.read_bytes()
    file.write_bytes(damage(content))
    assert printed(CALL, small) == ("2.0", "0")
    assert len(file.read_bytes()) > 0.9 * len(content)
    assert cached(small) == [file]


def test_no_flipped_bit_gets_past_the_checksum(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file,) = cached(small)
    content = file.read_bytes()
    files = _Files(small, "base")
    monkeypatch.setattr(_Files, "_path", lambda self, key: file)
    monkeypatch.setattr(pickle, "load", lambda stream: pytest.fail("looked at damaged contents"))
    for place in range(0, len(content), 97):
        flipped = bytearray(content)
        flipped[place] ^= 1 << place % 8
        file.write_bytes(flipped)
        assert files.load("key") is None


def test_one_overload_in_the_place_of_another_is_not_taken_for_it(small: Path) -> None:
    """As two processes would mix them up that count files, or keep an index, at the same time."""
    (first,) = cached(small)
    other = CALL.replace("5.0", "5")
    assert printed(other, small) == ("2", "0")
    (second,) = set(cached(small)) - {first}
    first.write_bytes(second.read_bytes())
    assert printed(CALL, small) == ("2.0", "0")


def test_processes_that_compile_at_the_same_time_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "small.py").write_text(SOURCE)
    calls = [CALL.replace("5.0", "5, dtype=np." + dtype) for dtype in ("int8", "float32") * 2]
    with ThreadPoolExecutor(len(calls)) as pool:
        answers = list(pool.map(lambda call: printed(call, tmp_path)[0], calls))
    assert [float(answer) for answer in answers] == [2.0] * len(calls)
    assert [printed(call, tmp_path)[1] for call in calls[:2]] == ["1", "1"]
    assert len(list((tmp_path / "__pycache__").glob("*.nb?"))) == 2


def test_code_that_checks_bounds_is_kept_apart(small: Path) -> None:
    beyond = CALL.replace("print(third(np.arange(5.0))", "third(np.arange(2.0)); print(0")
    assert printed(beyond, small) == ("0", "1")
    for switch in ("GNM_CHECKED", "NUMBA_BOUNDSCHECK"):
        with pytest.raises(subprocess.CalledProcessError) as failure:
            ran(beyond, small, **{switch: "1"})
        assert "IndexError" in failure.value.stderr
    assert printed(CALL, small, GNM_CHECKED="0") == ("2.0", "1")


@pytest.fixture
def closed(tmp_path: Path) -> dict[str, str]:
    """A module with no place for its cache but the folder for temporary files."""
    (tmp_path / "small.py").write_text(SOURCE)
    (tmp_path / "__pycache__").write_text("no folder, as if it could not be written")
    (tmp_path / "temporary").mkdir()
    return {
        "HOME": "/dev/null",
        "XDG_CACHE_HOME": "/dev/null",
        "LOCALAPPDATA": "/dev/null",
        "TMPDIR": str(tmp_path / "temporary"),
        # Everything else of the package stays where it is.
        "NUMBA_CACHE_DIR": "",
    }


def test_the_cache_moves_to_a_folder_of_this_users_own(
    closed: dict[str, str], tmp_path: Path
) -> None:
    assert printed(CALL, tmp_path, **closed) == ("2.0", "0")
    assert printed(CALL, tmp_path, **closed) == ("2.0", "1")
    (folder,) = (tmp_path / "temporary").iterdir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    folder.chmod(0o777)  # anybody may have put code there
    assert printed(CALL, tmp_path, **closed) == ("2.0", "0")


def test_without_any_place_for_the_cache_one_warning_says_so(
    closed: dict[str, str], tmp_path: Path
) -> None:
    folder = tmp_path / "temporary" / f"gnm_env-compiled-{os.getuid()}"
    folder.write_text("in the way")
    both = SOURCE + SOURCE.replace("third", "another")
    (tmp_path / "small.py").write_text(both)
    done = ran(CALL, tmp_path, **closed)
    assert done.stdout.split() == ["2.0", "0"]
    assert done.stderr.count("RuntimeWarning") == 1
    assert "let NUMBA_CACHE_DIR name a folder that can be written" in done.stderr


def test_a_full_disk_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "small.py").write_text(SOURCE)
    limit = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
    done = ran(limit + CALL, tmp_path)
    assert done.stdout.split() == ["2.0", "0"]
    assert done.stderr.count("RuntimeWarning") == 1
    assert cached(tmp_path) == []
    assert printed(CALL, tmp_path) == ("2.0", "0")


def test_a_source_that_has_gone_since_it_was_imported_stops_nothing(small: Path) -> None:
    gone = CALL.replace("import third\n", "import third\nimport os; os.remove('small.py')\n")
    done = ran(gone, small)
    assert done.stdout.split() == ["2.0", "0"]


def test_a_class_whose_module_has_a_new_name_is_compiled_anew(tmp_path: Path) -> None:
    (tmp_path / "inner_a.py").write_text(
        "from gnm_env.compiled import compiled\n"
        "@compiled\n"
        "def inner(x):\n"
        "    if x > 100.0:\n"
        "        raise ValueError\n"
        "    return 2.0 * x\n"
    )
    (tmp_path / "outer.py").write_text(
        "from gnm_env.compiled import specialise\n"
        "inner = None\n"
        "def outer(x):\n"
        "    return inner(x) + 1.0\n"
        "def bound(to):\n"
        "    return specialise(outer, 'own', inner=to)\n"
    )
    ask = "import outer, {0}; print(outer.bound({0}.inner)(1.0))"
    assert printed(ask.format("inner_a"), tmp_path) == ("3.0",)
    (tmp_path / "inner_a.py").rename(tmp_path / "inner_b.py")
    again = ran(ask.format("inner_b"), tmp_path)
    assert (again.stdout, again.stderr) == ("3.0\n", "")
