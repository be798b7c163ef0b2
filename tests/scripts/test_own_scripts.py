"""Scripts that are no verb of `gnm` take the same options, and refuse in one line as verbs do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
VERB = "from agents.commands import run\n"
OWN = sorted(path.stem for path in SCRIPTS.glob("*.py") if VERB not in path.read_text("utf-8"))


def start(name: str, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, SCRIPTS / f"{name}.py", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("name", OWN)
def test_help_is_told_and_nothing_is_done(name: str) -> None:
    told = start(name, "--help")
    assert told.returncode == 0 and "--json" in told.stdout


@pytest.mark.parametrize("name", OWN)
def test_an_unknown_option_is_refused_in_one_line(name: str) -> None:
    told = start(name, "--no-such-option")
    assert told.returncode == 2
    assert told.stderr.count("\n") == 1 and "--no-such-option" in told.stderr
