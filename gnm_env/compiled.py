"""Just-in-time compilation whose results are kept on disk and are never stale.

Numba's own cache looks at the file of the compiled function only: after an edit to a function that
it calls in another file, the old machine code would go on running. Here the cache also goes by the
source files of everything that the function calls, and by the constants that it uses.

The cache never stops work. It lies where numba puts it (NUMBA_CACHE_DIR, `__pycache__` beside the
source, the user's cache folder) or, where none of these can be written, in a folder of this user's
own among the temporary files; failing that too, or on a full disk, work goes on without, after one
warning. Files that are damaged, cut short or out of date are compiled anew.

With GNM_CHECKED=1 in the environment every access to an array is checked and raises IndexError
outside its bounds, those of `agents.simd` included: slower, for tests. It is read at import;
checked and unchecked code lie in different files.
"""

from __future__ import annotations

import glob
import hashlib
import io
import os
import pickle
import re
import stat
import sys
import tempfile
import types
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import njit
from numba import types as numba_types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserWideCacheLocator
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from gnm_env.files import atomic_write

_config: Any = numba.config  # its names come from the environment
CHECKED = bool(_config.BOUNDSCHECK) or os.environ.get("GNM_CHECKED", "0") not in ("", "0")
"""Whether compiled code checks the bounds of every access to an array."""


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` at its first call: without the GIL, kept on disk, IEEE arithmetic.

    No fast-math: the same operations in the same order give the same bits everywhere, which the
    tests of "same bits" rely on. Division by zero follows IEEE (infinity or NaN), as in NumPy.
    """
    return _dispatcher(function)


def inlined(function: Callable[..., Any]) -> Any:
    """As `compiled`, but made a part of every compiled function that calls it.

    For what is called so often that the call itself costs something: numba counts references to
    each array that is handed over, and hands over a tuple field by field.
    """
    return _dispatcher(function, inline="always")


def _dispatcher(function: Callable[..., Any], **options: Any) -> Any:
    """Numba's dispatcher, with our cache, and with less to compile than by default.

    Numba compiles a function anew for each constant that it is called with, and an entry for C
    beside the one for Python. Nothing here needs either, and both take seconds at the first start.
    """
    decorate: Any = njit  # whose annotations lack one of the options
    dispatcher = decorate(
        nogil=True, error_model="numpy", boundscheck=CHECKED, no_cfunc_wrapper=True, **options
    )(function)
    resolve = dispatcher.get_call_template

    def by_type(args: Any, kws: Any) -> Any:
        return resolve(
            tuple(numba_types.unliteral(type_) for type_ in args),
            {name: numba_types.unliteral(type_) for name, type_ in kws.items()},
        )

    dispatcher.get_call_template = by_type
    try:
        dispatcher._cache = _Cache(function)
    except RuntimeError as error:  # there is no place to keep it
        _warn(f"compiled code cannot be kept on disk ({error})")
    return dispatcher


def is_kept(dispatcher: Any) -> bool:
    """Whether what is compiled of a function is kept on disk, as far as can be told beforehand."""
    return isinstance(dispatcher._cache, _Cache)


def specialise(
    template: Callable[..., Any], label: str, *, inline: bool = False, **bindings: Any
) -> Any:
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
    return inlined(function) if inline else compiled(function)


class _Folder(UserWideCacheLocator):
    """The last resort: this user's own folder among the temporary files, closed to others.

    What is loaded from a cache is run, hence a folder that somebody else may write to is none.
    """

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._place = Path(tempfile.gettempdir(), f"gnm_env-compiled-{_user()}")
        self._cache_path = str(self._place / self.get_suitable_cache_subpath(py_file))

    def ensure_cache_path(self) -> None:
        self._place.mkdir(mode=0o700, exist_ok=True)
        status = os.lstat(self._place)
        if not stat.S_ISDIR(status.st_mode) or (
            hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022)
        ):
            raise OSError(f"{self._place} is not a folder of this user's alone")
        super().ensure_cache_path()


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else "user"


class _Implementation(CompileResultCacheImpl):
    """Where numba would keep a function, and one place more."""

    _locator_classes = [*CompileResultCacheImpl._locator_classes, _Folder]


class _Cache(FunctionCache):
    """Numba's cache of one function, valid only as long as nothing that it rests on has changed."""

    _impl_class = _Implementation
    _cache_file: Any

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._function = function
        self._cache_file = _Files(Path(self._cache_path), self._impl.filename_base)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            self._cache_file.stamp = f"{_BUILD} {_digest(self._function)}"
        except OSError as error:  # a source file has gone since it was imported
            self.disable()
            _warn(f"what {self._function.__qualname__} rests on cannot be read ({error})")
            return None
        try:
            return super().load_overload(sig, target_context)
        except ImportError:  # a user's class, whose module had another name when it was compiled
            return None
        except Exception as error:  # whatever a file says that was whole, and yet is of no use
            _warn(f"compiled code in {self._cache_path} could not be used ({error!r})")
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except (OSError, ValueError) as error:
            _warn(f"compiled code could not be kept on disk ({error})")


class _Files:
    """The files of one function's overloads, one each: a checksum, what it is, and the code.

    Nothing in a file is looked at before its checksum has been found to be right, for a flipped bit
    in machine code, or in a pickle, ends the process. Each file says itself what it holds, so that
    no order in which several processes write can mix two overloads up.
    """

    def __init__(self, folder: Path, base: str) -> None:
        self._folder = folder
        self._base = base
        self.stamp = ""

    def load(self, key: Any) -> Any:
        """The code that was saved under `key`, or None: never saved, damaged, or out of date."""
        try:
            content = self._path(key).read_bytes()
        except OSError:
            return None
        if content[:_CHECKSUM_BYTES] != _checksum(content[_CHECKSUM_BYTES:]):
            return None
        stream = io.BytesIO(content)
        stream.seek(_CHECKSUM_BYTES)
        if pickle.load(stream) != self.stamp or pickle.load(stream) != key:
            return None
        return pickle.load(stream)

    def save(self, key: Any, code: Any) -> None:
        """Keep `code` under `key`; ValueError or OSError if it cannot be."""
        content = pickle.dumps(self.stamp) + dumps(key) + dumps(code)
        # Not flushed to the disk: what a power cut leaves behind has a wrong checksum.
        with atomic_write(self._path(key), durable=False) as file:
            file.write(_checksum(content) + content)

    def flush(self) -> None:
        """Remove all overloads."""
        for path in self._folder.glob(f"{glob.escape(self._base)}.*.nbc"):
            path.unlink(missing_ok=True)

    def _path(self, key: Any) -> Path:
        # The stamp is not part of the name: new code takes the place of what is out of date.
        text = re.sub("0x[0-9a-f]+", "", f"{_BUILD} {key}")  # where in memory something lies
        name = hashlib.sha256(text.encode()).hexdigest()[:16]
        return self._folder / f"{self._base}.{name}.nbc"


_CHECKSUM_BYTES = 32
_BUILD = " ".join(
    map(str, (numba.__version__, llvmlite.__version__, CHECKED, _config.BOUNDSCHECK, _config.OPT))
)
"""What else the code depends on; each has files of its own."""
_warned = False


def _checksum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_CHECKSUM_BYTES).digest()


def _warn(reason: str) -> None:
    """Say once that things go on, but slower."""
    global _warned
    if not _warned:
        _warned = True
        warnings.warn(
            f"{reason}: it is compiled anew in each process; let NUMBA_CACHE_DIR name a folder "
            "that can be written",
            RuntimeWarning,
            stacklevel=2,
        )


_CONSTANTS = (bool, int, float, complex, str, bytes, tuple, np.dtype, np.generic)
"""What compiled code takes over from a global name, and `repr` tells whole."""


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
            elif isinstance(value, _CONSTANTS):
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
