"""Which code made a number: software version and git commit."""

from __future__ import annotations

import functools
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@functools.cache
def software() -> str:
    """Name and version of the installed package."""
    try:
        return f"gnm-env {version('gnm-env')}"
    except PackageNotFoundError:
        return "gnm-env (not installed)"


@functools.cache
def commit() -> str:
    """The checkout's git commit, "+" added where tracked files differ; "unknown" without git."""
    try:
        return _git("rev-parse", "HEAD") + ("+" if _git("status", "-s", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=True, timeout=10
    ).stdout.strip()
