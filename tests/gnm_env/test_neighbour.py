"""Somebody else's module `agents` is named in one sentence, not met as an ImportError."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENTRY = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
START = "import sys; sys.argv[0] = 'gnm'; import {0}; {0}.{1}()"  # what the installed `gnm` does
COMMAND = START.format(*ENTRY["gnm"].split(":"))
IMPORT = "import gnm_env; print(gnm_env.Task(n_classes=2).n_classes)"


def python(code: str, *words: str, first: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run Python with a folder before ours on the path."""
    folders = [str(first)] if first else []
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        capture_output=True, text=True, cwd=first,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*folders, str(ROOT)])},
    )  # fmt: skip


@pytest.fixture(params=["package", "module"])
def foreign(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A folder with a module `agents` that is not ours."""
    if request.param == "package":
        (tmp_path / "agents").mkdir()
        (tmp_path / "agents" / "__init__.py").write_text("class Agent: ...\n")
    else:
        (tmp_path / "agents.py").write_text("class Agent: ...\n")
    return tmp_path


def test_the_command_names_a_foreign_module_in_one_line(foreign: Path) -> None:
    ended = python(COMMAND, "--version", first=foreign)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert line.startswith("gnm: the module `agents` at ")
    assert str(foreign) in line and "openai-agents" in line


def test_the_environments_work_beside_a_foreign_module_and_warn_of_it(foreign: Path) -> None:
    ended = python(IMPORT, first=foreign)
    assert (ended.returncode, ended.stdout) == (0, "2\n")
    assert "UserWarning: the module `agents` at " in ended.stderr
    assert "is not the one of gnm-env" in ended.stderr


def test_a_package_that_was_written_over_is_foreign(tmp_path: Path) -> None:
    """As pip does when `openai-agents` comes after: its `__init__` among our files."""
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").write_text("class Agent: ...\n")
    (tmp_path / "agents" / "neuron_agent.py").write_text("class NeuronAgent: ...\n")
    assert python(COMMAND, "--version", first=tmp_path).returncode == 2


@pytest.mark.parametrize("code", [IMPORT, "import agents, gnm_env", "import gnm_env, agents"])
def test_our_own_is_not_complained_about(code: str) -> None:
    ended = python(code)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_command_runs() -> None:
    ended = python(COMMAND, "--version")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("gnm ")
