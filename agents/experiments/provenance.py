"""Which code made a number: software version and git commit."""

from __future__ import annotations

import functools
import subprocess
from pathlib import Path

from gnm_env import __version__

ROOT = Path(__file__).resolve().parents[2]


@functools.cache
def software() -> str:
    """Name and version of the package."""
    return f"gnm-env {__version__}"


@functools.cache
def commit() -> str:
    """The checkout's git commit, "+" added where tracked files differ; "unknown" outside one."""
    if not (ROOT / ".git").exists():  # installed: a repository around it would be another's
        return "unknown"
    try:
        return _git("rev-parse", "HEAD") + ("+" if _git("status", "-s", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=True, timeout=10
    ).stdout.strip()
