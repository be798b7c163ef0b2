"""Every command that README and site tell to run is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from agents.commands import VERBS
from tests.docs.pages import ROOT, blocks, name, pages

MAKE = re.compile(r"\bmake ([a-z][a-z-]*)")
GNM = re.compile(r"(?:^|\s|`)gnm ([a-z][a-z-]*)", re.MULTILINE)
SCRIPT = re.compile(r"\bpython (scripts/[\w./]+\.py)")
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def commands(page: Path) -> str:
    """What stands in blocks of shell and between backticks."""
    shell = "\n".join(block.code for block in blocks(page, "sh", "bash"))
    prose = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return shell + "\n" + "\n".join(re.findall(r"`([^`\n]+)`", prose))


@pytest.mark.parametrize("page", pages(), ids=name)
def test_targets_of_make_exist(page: Path) -> None:
    assert [t for t in MAKE.findall(commands(page)) if t not in TARGETS] == []


@pytest.mark.parametrize("page", pages(), ids=name)
def test_scripts_exist(page: Path) -> None:
    assert [s for s in SCRIPT.findall(commands(page)) if not (ROOT / s).exists()] == []


@pytest.mark.parametrize("page", pages(), ids=name)
def test_verbs_of_gnm_exist(page: Path) -> None:
    assert [verb for verb in GNM.findall(commands(page)) if verb not in VERBS] == []


def test_the_readme_has_a_way_without_make_for_every_target() -> None:
    readme = commands(ROOT / "README.md")
    told = set(MAKE.findall(readme))
    assert TARGETS - told <= {"help", "clean", "distclean"}
