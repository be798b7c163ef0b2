"""Runs the cases whose numbers come in, one a line, and writes what became of each, one line each.

A process of its own, since a case may end it: the one that started it sees how.
"""

from __future__ import annotations

import contextlib
import io
import json
import linecache
import os
import resource
import sys
import tempfile
import traceback
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from tests.campaign.inputs import (  # noqa: E402  after the path
    ForeignTraceback,
    Refused,
    cases,
    namespace,
)

MEMORY = 12 * 2**30
OWN = tuple(str(ROOT / name) + os.sep for name in ("gnm_env", "agents", "scripts"))
REFUSALS = (ValueError, TypeError, IndexError, NotImplementedError, ImportError)
CASE = "<case>"
USERS_FILE = "mine.py"
"""That cases write and have imported."""
PYTHONS = (CASE, "<string>")  # the latter is where a frozen dataclass refuses


def outcome(code: str, names: dict[str, Any]) -> tuple[str, str]:
    """What became of a case: refused, warned, accepted or foreign; and what was said."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            exec(compile(code, CASE, "exec"), dict(names))
        except Refused as refusal:
            return "refused", str(refusal)
        except ForeignTraceback as error:
            return "foreign", str(error)
        except BaseException as error:
            return judged(error)
    own = [w for w in said if str(w.filename).startswith((*OWN, CASE))]
    if own:
        return "warned", str(own[0].message)
    return "accepted", ""


def judged(error: BaseException) -> tuple[str, str]:
    """Whether the exception is a refusal of this package's, in a sentence, or someone else's."""
    text = f"{type(error).__name__}: {error}"
    frames = traceback.extract_tb(error.__traceback__)
    last = frames[-1]
    raised = linecache.getline(last.filename, last.lineno or 0).strip().startswith("raise")
    own_words = last.filename.startswith(OWN) or "/gymnasium/" in last.filename
    if last.filename in PYTHONS:
        # Python itself refused, at the user's own line: a keyword that is not there, an attribute
        # or an array that cannot be written to.
        return "refused", text
    if own_words and raised and isinstance(error, (*REFUSALS, gym.error.Error)):
        return "refused", text
    if any(Path(frame.filename).name == USERS_FILE for frame in frames):
        return "refused", text  # what a file of the user's raises is that file's
    own = next((f for f in reversed(frames) if f.filename.startswith(OWN)), last)
    place = f"{Path(own.filename).name}:{own.lineno}"
    return "foreign", f"{text} [at {place}: {own.line}]"


def main() -> None:
    """Until the input ends: read a number, run the case, say what became of it."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    everything = cases()
    namespace()  # imports everything
    print(json.dumps("ready"), file=answers, flush=True)
    for line in sys.stdin:
        case = everything[int(line)]
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            quiet = io.StringIO()
            with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
                # Names of its own for each: what one case does to an object is no other's matter.
                result = outcome(case.code, namespace())
        print(json.dumps(result), file=answers, flush=True)


if __name__ == "__main__":
    main()
