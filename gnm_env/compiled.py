"""Just-in-time compilation whose results are kept on disk and are never stale.

Numba's own cache looks at the file of the compiled function only: after an edit to a function that
it calls in another file, the old machine code would go on running. Here the cache also carries a
digest of every source file of the packages concerned, so that any edit compiles anew.
"""

from __future__ import annotations

import functools
import hashlib
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

_ROOT = Path(__file__).resolve().parent.parent


@functools.cache
def _digest(package: str) -> str:
    """A digest of all sources that code of `package` may call: its own and those of gnm_env."""
    digest = hashlib.sha1()
    for name in sorted({"gnm_env", package}):
        for path in sorted((_ROOT / name).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` at its first call: without the GIL, kept on disk, IEEE arithmetic.

    No fast-math: the same operations in the same order give the same bits everywhere, which the
    tests of "same bits" rely on. Division by zero follows IEEE (infinity or NaN), as in NumPy.
    """
    dispatcher: Any = njit(nogil=True, cache=True, error_model="numpy")(function)
    package = function.__module__.partition(".")[0]
    if package in ("gnm_env", "agents"):
        cache = dispatcher._cache
        cache._cache_file = IndexDataCacheFile(
            cache_path=cache._cache_path,
            filename_base=cache._impl.filename_base,
            source_stamp=_digest(package),
        )
    return dispatcher


def specialise(template: Callable[..., Any], label: str, **bindings: Any) -> Any:
    """Compile `template` with some of its global names bound to other functions or constants.

    This is how one loop serves every neuron and every rule: the template calls `step`, and each
    neuron binds its own. `label` names the combination and tells the results in the cache apart.
    """
    function = types.FunctionType(
        template.__code__,
        {**template.__globals__, **bindings},
        f"{template.__name__}_{label}",
        template.__defaults__,
    )
    function.__qualname__ = function.__name__
    function.__doc__ = template.__doc__
    return compiled(function)
