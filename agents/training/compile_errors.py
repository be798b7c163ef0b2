"""What numba says of code that it cannot compile, in a sentence that names the line."""

from __future__ import annotations

import linecache
import re
from pathlib import Path
from typing import Any

from numba.core.errors import NumbaError

from agents.learning.teaching import HeardTrial

COMPILING = (NumbaError, NotImplementedError)
"""What numba raises where it cannot compile a function."""

_OURS = Path(__file__).resolve().parent.parent
_PLACE = re.compile(r'(?:File "| at )([^"\s]+)(?:", line | \()(\d+)')
_STEPS = (
    "+ - * / **, comparisons, and, or, not, x if condition else y, abs, min, max, "
    "and exp, log, sqrt of math or NumPy"
)
_RETURNS = "a step returns its new state and a Response(V, D, R, X, above, spike)"
_REASONS = (
    (r"function truth", "a condition of many neurons has no one truth value"),
    (r"Cannot unify .* for '(\w+)[.\d]*'", "the name {0} has values of two kinds"),
    (
        r"Unknown attribute '(\w+)' of type HeardTrial",
        f"a trial has no {{0}}; it has {', '.join(HeardTrial._fields)}",
    ),
    (
        r"Unknown attribute '(\w+)' of type Parameters",
        "there is no parameter {0}; parameters are the numeric fields of the class",
    ),
    (r"response\.\w+|>>> fitted\(|has not the fields of", _RETURNS),
    (r"Unknown attribute '_replace'", "name every field of the new state, State(V=…)"),
    (
        r">>> clip\(|Call to clip|in function clip",
        "clip is for arrays; write min(max(x, low), high)",
    ),
    (r"Unknown attribute '(\w+)'", "there is no {0}"),
    (
        r"No definition for lowering (\w+)\(.*\)\.(\w+) =",
        "nothing can be written into a {0}; make a new one, {0}({1}=…)",
    ),
    (r">>> (max|min)imum\(", "{0}imum is for arrays; write {0}(a, b)"),
    (r">>> where\(", "where is for arrays; write new if condition else x"),
    (r"name '(\w+)' is not defined", "the name {0} is not known"),
    (
        r"Untyped global name '(\w+)'",
        "{0} is not compiled: from agents.portable import portable, and write @portable before "
        "its def",
    ),
    (
        r"Type of variable '(\w+)' cannot be determined",
        "the kind of {0} is not known; give names their values in lines of their own, with no :=",
    ),
    (r">>> invert\(", "~ is for whole numbers; write not condition"),
    (r">>> (?:and|or)_\(", "and, or join conditions; write x != 0.0 in place of a number x"),
    (
        r">>> ([\w.]+)\(.*(?:Lanes|Mask)\(",
        f"{{0}} does not work on many at once; write it with {_STEPS}",
    ),
    (r">>> ([\w.]+)\(", "{0} does not take what it is given here"),
)
"""Patterns in what numba says, the most telling first, and what they mean."""


def _is_ours(path: Path) -> bool:
    return path.resolve().is_relative_to(_OURS)


def _own_step(parts: Any) -> str:
    """Where the user's step begins, for what goes wrong only where it is called."""
    for part in parts:
        function = getattr(type(part), "step", None)
        code = getattr(getattr(function, "py_func", function), "__code__", None)
        if code is not None and not _is_ours(Path(code.co_filename)):
            return f"{code.co_filename}, line {code.co_firstlineno}, `{code.co_name}`"
    return ""


def explained(error: Exception, *parts: Any) -> ValueError:
    """A ValueError that says which line of the classes of `parts` cannot be compiled, and why."""
    text = re.sub(r"\x1b\[\d+m", "", str(error))
    where = _own_step(parts) or "a step, teaching signal or rule"
    for file, line in reversed(_PLACE.findall(text)):
        path = Path(file) if Path(file).is_absolute() else Path.cwd() / file
        if path.is_file() and not _is_ours(path) and "numba" not in path.parts:
            source = linecache.getline(str(path), int(line)).strip()
            where = f"{file}, line {line}, `{source}`"
            break
    found = ((re.search(pattern, text), words) for pattern, words in _REASONS)
    reasons = (words.format(*match.groups()) for match, words in found if match)
    said = (line for line in text.splitlines() if "Failed in" not in line)
    reason = next(reasons, next(said, type(error).__name__))
    names = ", ".join(type(part).__name__ for part in parts)
    return ValueError(
        f"{names}: {where} cannot be compiled for neurons side by side: {reason}; "
        "agents.simd lists what a step may use"
    )
