"""Just-in-time compilation whose results are kept on disk and are never stale.

Numba's own cache looks at the file of the compiled function only: after an edit to a function that
it calls in another file, the old machine code would go on running. Here the cache also goes by the
source files of everything that the function calls, and by the constants that it uses.
"""

from __future__ import annotations

import hashlib
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` at its first call: without the GIL, kept on disk, IEEE arithmetic.

    No fast-math: the same operations in the same order give the same bits everywhere, which the
    tests of "same bits" rely on. Division by zero follows IEEE (infinity or NaN), as in NumPy.
    """
    dispatcher: Any = njit(nogil=True, error_model="numpy")(function)
    dispatcher._cache = _Cache(function)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """As `compiled`, but made a part of every compiled function that calls it.

    For what is called so often that the call itself costs something: numba counts references to
    each array that is handed over, and hands over a tuple field by field.
    """
    dispatcher: Any = njit(nogil=True, error_model="numpy", forceinline=True)(function)
    dispatcher._cache = _Cache(function)
    return dispatcher


def specialise(template: Callable[..., Any], label: str, **bindings: Any) -> Any:
    """Compile `template` with some of its global names bound to other functions or constants.

    This is how one loop serves every neuron and every rule: the template calls `step`, and each
    neuron binds its own. `label` names the combination and tells the results in the cache apart.
    """
    template = getattr(template, "py_func", template)
    function = types.FunctionType(
        template.__code__,
        {**template.__globals__, **bindings},
        f"{template.__name__}_{label}",
        template.__defaults__,
        template.__closure__,
    )
    function.__qualname__ = function.__name__
    function.__doc__ = template.__doc__
    return compiled(function)


class _Cache(FunctionCache):
    """Numba's cache of one function, valid only as long as nothing that it rests on has changed."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._function = function

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        self._cache_file._source_stamp = _digest(self._function)
        return super().load_overload(sig, target_context)


def _digest(function: Any) -> str:
    """A digest of the sources and constants that the compiled `function` rests on.

    Taken at the first call, when every name that the function uses has got its value. Compiled
    functions are followed wherever they lie; of what is not compiled, the source counts where it
    belongs to this package or to that of any function followed (NumPy's and Python's do not).
    """
    packages = {"gnm_env"}
    files: set[str] = set()
    constants: list[str] = []
    others: list[Any] = []
    seen: set[int] = set()
    waiting = [function]
    while waiting:
        current = waiting.pop()
        if id(current) in seen:
            continue
        seen.add(id(current))
        packages.add(current.__module__.partition(".")[0])
        if Path(current.__code__.co_filename).is_file():
            files.add(current.__code__.co_filename)
        else:  # typed in, in a notebook say
            constants.append(f"{current.__code__.co_code.hex()} {current.__code__.co_consts!r}")
        for name in sorted(set(_names(current.__code__)) & current.__globals__.keys()):
            value = current.__globals__[name]
            if isinstance(value, Dispatcher):
                waiting.append(value.py_func)
            elif isinstance(value, (bool, int, float, str)):
                constants.append(f"{current.__qualname__}.{name}={value!r}")
            else:
                others.append(value)
        if not waiting:
            # Only now is it known which packages have a part in it.
            left = []
            for value in others:
                module = str(getattr(value, "__module__", None) or "")
                if module.partition(".")[0] not in packages:
                    left.append(value)
                    continue
                source = getattr(sys.modules[module], "__file__", None)
                if source is not None:
                    files.add(source)
                if isinstance(value, types.FunctionType):
                    waiting.append(value)
            others = left
    digest = hashlib.sha1("\n".join(sorted(constants)).encode())
    for file in sorted(files):
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()


def _names(code: types.CodeType) -> Iterator[str]:
    """Global names that a function uses, those of functions inside it included."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _names(constant)
