"""A verb asks for no extra but those that README and its message name."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from agents.commands import VERBS
from agents.commands.terminal import EXTRAS

ROOT = Path(__file__).parents[3]

WITHOUT = """
import importlib, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[2].split():
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Missing())
for verb in sys.argv[1].split():
    try:
        importlib.import_module("agents.commands." + verb.replace("-", "_"))
    except ModuleNotFoundError as error:
        sys.exit(f"{verb} needs {error.name}")
"""

CORE = ("train", "evaluate", "show", "watch", "card", "speech", "check-report")
NEEDS = {
    "core": (CORE, ()),
    "explore": (("explore",), ("explore",)),
    "rl": (("train-rl",), ("rl",)),
    "reproduce": (
        ("sweep", "figures", "findings", "forensics", "reference-table", "report", "publish"),
        ("reproduce",),
    ),
    "two": (("chemistry", "reproduce"), ("chemistry", "reproduce")),
    "league": (("league",), ("reproduce", "rl")),
}


def test_every_verb_is_tried() -> None:
    assert {verb for verbs, _ in NEEDS.values() for verb in verbs} == set(VERBS)


@pytest.mark.parametrize("kind", NEEDS)
def test_verbs_start_with_the_extras_that_are_told(kind: str) -> None:
    """Whatever else may be missing: nothing of the other extras is imported."""
    verbs, extras = NEEDS[kind]
    missing = {module for module, extra in EXTRAS.items() if extra not in extras}
    if extras:
        missing -= {"matplotlib"}  # the extra `reproduce` brings it too
    else:
        missing |= {"pygame", "pandas"}
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    ended = subprocess.run(
        [sys.executable, "-c", WITHOUT, " ".join(verbs), " ".join(sorted(missing))],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
