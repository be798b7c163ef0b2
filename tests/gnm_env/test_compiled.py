"""Compiled code is kept on disk, and an edit anywhere below it compiles anew."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from gnm_env.compiled import compiled, specialise

FACTOR = 2.0


def template(x: float) -> float:
    return FACTOR * x


def test_specialise_binds_names_of_the_template() -> None:
    assert specialise(template, "three", FACTOR=3.0)(2.0) == 6.0
    assert compiled(template)(2.0) == 4.0


def printed(code: str, folder: Path) -> tuple[str, ...]:
    """The words that the code prints in a process of its own, run in `folder`."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True
    )
    return tuple(done.stdout.split())


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
