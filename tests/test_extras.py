"""An extra that a message or a page names can be installed, and the README's table has them all."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from agents.commands.terminal import EXTRAS

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OFFERED = set(PROJECT["optional-dependencies"])
NAMED = re.compile(r"gnm-env\[([a-z, ]+)\]")
TEXTS = [
    path
    for folder, pattern in (("gnm_env", "*.py"), ("agents", "*.py"), ("docs", "*.md"), ("", "*.md"))
    for path in (ROOT / folder).glob(f"**/{pattern}" if folder else pattern)
]


def named() -> dict[str, str]:
    """Every extra that a line to install names, with a file that names it."""
    return {
        extra.strip(): path.relative_to(ROOT).as_posix()
        for path in TEXTS
        for found in NAMED.finditer(path.read_text(encoding="utf-8"))
        for extra in found[1].split(",")
    }


def test_every_extra_that_is_named_exists() -> None:
    assert {"rl", "speech", "pictures"} <= set(named())
    assert {extra: file for extra, file in named().items() if extra not in OFFERED} == {}
    assert set(EXTRAS.values()) - OFFERED == set()


def test_the_readme_tells_what_each_extra_is_for() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    table = readme.split("| extra |")[1].split("\n\n")[0]
    assert OFFERED - set(re.findall(r"`([a-z0-9]+)`", table)) == set()


def test_the_readme_says_extra_of_none_that_does_not_exist() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    said = re.findall(r"\(extras? ([^)]*)\)", readme)
    assert said
    assert {name for text in said for name in re.findall(r"`([a-z0-9]+)`", text)} - OFFERED == set()
