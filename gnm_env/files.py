"""Files that are whole or not there, and arrays read from files that nobody vouches for.

`atomic_write` replaces a file in one step. `open_arrays` and `read_arrays` read NumPy's npz format
(a zip of plain arrays) without pickle, and ask for no memory that the file cannot account for.
"""

from __future__ import annotations

import codecs
import contextlib
import errno
import itertools
import os
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

MAX_BYTES = 8 * 2**30
"""Most bytes that `open_arrays` lets the arrays of one file take in memory, unless told."""

_DEFLATE_RATIO = 1032
"""No deflated byte stands for more: what a file claims beyond it is not in the file."""
_HEADER = re.compile(
    rb"\{'descr': '([<>|=]?[a-zA-Z]\d{0,9})', 'fortran_order': (True|False), "
    rb"'shape': \(((?:\d{1,18}, ?)*\d{0,18})\), ?\} *\n?"
)
_CHUNK = 2**20
_SWEPT = 8
"""Temporary names beside a file that each save looks through for what a killed one left."""
_DAMAGE = (
    zipfile.BadZipFile,
    struct.error,
    zlib.error,
    EOFError,
    LookupError,
    NotImplementedError,  # a compression or a version that there is none of
    OverflowError,
    RuntimeError,  # "encrypted"
    TypeError,
    ValueError,
)
"""What zipfile and zlib are known to raise over damaged bytes."""
_SHOWN = 100
"""Bytes of a file's name that show in the temporary name, which must not get too long itself."""
_OUT_OF_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


# --- writing --------------------------------------------------------------------------------------


@contextlib.contextmanager
def atomic_write(path: str | os.PathLike[str], *, durable: bool = True) -> Iterator[IO[bytes]]:
    """A binary file that takes the place of `path` once complete; a failure leaves the old one.

    Whatever ends the writing early (an exception, SIGKILL, a power cut), `path` is afterwards
    either the old file or the new one, whole. Once the block has been left without an exception the
    new file lies on the disk: it and its folder have been flushed with fsync, so that a power cut
    takes nothing unless the disk itself breaks its word. (With durable=False it is not flushed, and
    a power cut within the next minute may leave a file of the right name and wrong contents.)

    A symbolic link stays one, and the file that it points to is replaced. The permissions of an
    existing file are kept; a new file gets those of any new file. Several savers of one path may
    run at once, in threads, processes or on several machines: each writes a file of its own, the
    last to finish stays. What a killed saver left behind, `.NAME.part…` in the same folder, is
    removed by the next save to `path`, where the system can lock files (not on Windows).

    Raises ValueError, in one sentence, if `path` is a folder, a device or no path at all, if its
    name is too long, if the folder is missing or cannot be written, if the file is write-protected,
    or if there is no room on the disk.
    """
    target, mode = _checked_target(path)
    try:
        part, file = _open_part(target)
    except OSError as error:
        raise ValueError(
            f"cannot write {target}: {error.strerror}; choose a folder that is writable"
        ) from None
    with file:  # its lock is held until the file has its final name
        try:
            if mode is not None and hasattr(os, "fchmod"):
                os.fchmod(file.fileno(), mode)  # before a byte of it can be read by others
            yield file
            file.flush()
            if durable:
                os.fsync(file.fileno())
            if fcntl is None:
                file.close()  # Windows renames no file that is open
            os.replace(part, target)
        except BaseException as error:
            if fcntl is None:
                file.close()
            part.unlink(missing_ok=True)
            if isinstance(error, OSError) and error.errno in _OUT_OF_ROOM:
                raise ValueError(
                    f"cannot write {target}: {error.strerror}; make room or choose another disk "
                    "(a file that was there before is still there, as it was)"
                ) from None
            raise
    if durable:
        _sync_folder(target.parent)


def write_arrays(path: str | os.PathLike[str], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays as one npz file, as `atomic_write` does; `read_arrays` reads it back.

    Raises ValueError as `atomic_write` does, and for arrays of Python objects.
    """
    for name, array in arrays.items():
        if array.dtype.hasobject:
            raise ValueError(f"array {name!r} holds Python objects; give numbers or text")
    with atomic_write(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)


def _checked_target(path: Any) -> tuple[Path, int | None]:
    """The file to replace, links followed, and its permissions if it exists; or ValueError."""
    target = path_of(path, "write")
    try:
        target = Path(os.path.realpath(target))
        status = os.stat(target)
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise ValueError(
                f"cannot write {path}: there is no folder {target.parent}; "
                "make it first, or choose a folder that exists and is writable"
            ) from None
        return target, None
    except NotADirectoryError:
        raise ValueError(
            f"cannot write {path}: {target.parent} is not a folder; choose a folder that exists "
            "and is writable"
        ) from None
    except (OSError, ValueError) as error:
        raise ValueError(f"cannot write {_shortened(path)}: {_blame(target, error)}") from None
    if stat.S_ISDIR(status.st_mode):
        raise ValueError(f"cannot write {path}: it is a folder; give the path of a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError(f"cannot write {path}: it is no regular file; choose another name")
    if not os.access(target, os.W_OK):
        raise ValueError(
            f"cannot write {path}: the file is write-protected; choose another name or allow it"
        )
    return target, stat.S_IMODE(status.st_mode)


def path_of(path: Any, verb: str) -> Path:
    """`path` as a Path; ValueError, "cannot `verb` …", if it is none."""
    try:
        return Path(os.fsdecode(path))
    except TypeError:
        raise ValueError(
            f"cannot {verb} {_shortened(repr(path))}: a path must be text or os.PathLike, "
            f"got {type(path).__name__}"
        ) from None


def _shortened(text: Any) -> str:
    text = str(text)
    return text if len(text) <= 300 else f"{text[:140]} … {text[-140:]}"


def _blame(path: Path, error: OSError | ValueError) -> str:
    """What is wrong with a path that the system does not take, and the remedy."""
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        size = len(os.fsencode(path.name))
        return f"its name ({size} bytes) or its path is too long; choose a shorter name"
    if isinstance(error, OSError):
        return f"{error.strerror}; choose another path"
    return f"{error}; choose another name"  # a zero byte in it


def _open_part(target: Path) -> tuple[Path, IO[bytes]]:
    """A new, locked file beside `target` to write into; files that killed savers left are removed.

    A saver holds the lock of its file as long as it lives, hence a file that can be locked belongs
    to nobody. Files are removed and made anew, never taken over: what lies there may be a link.
    """
    shown = os.fsencode(target.name)[:_SHOWN].decode(errors="ignore")
    found: tuple[Path, IO[bytes]] | None = None
    for k in itertools.count():
        part = target.with_name(f".{shown}.part{k or ''}")
        _remove_if_left_behind(part)
        if found is None:
            found = _create_locked(part)
        if found is not None and k + 1 >= _SWEPT:
            return found
    raise AssertionError  # the count has no end


def _create_locked(part: Path) -> tuple[Path, IO[bytes]] | None:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    try:
        file = os.fdopen(os.open(part, flags, 0o666), "wb")
    except FileExistsError:
        return None
    if _locked(file.fileno()) is False or not _is_at(file.fileno(), part):
        file.close()  # another saver took it for one left behind, before it was locked
        return None
    return part, file


def _remove_if_left_behind(part: Path) -> None:
    if fcntl is None:
        return
    try:
        handle = os.open(part, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:  # mostly: there is none
        return
    try:
        if _locked(handle) and _is_at(handle, part):
            part.unlink()
    except OSError:
        pass  # another user's, in a folder for all: the next name will do
    finally:
        os.close(handle)


def _locked(handle: int) -> bool | None:
    """Whether the file could be locked; None if this system or file system has no locks."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_at(handle: int, path: Path) -> bool:
    """Whether the open file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(handle), os.lstat(path))
    except FileNotFoundError:
        return False


def _sync_folder(folder: Path) -> None:
    """Bring the new name itself to the disk, where a folder can be opened and flushed."""
    if fcntl is None:
        return
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


# --- reading --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ArraySpec:
    """What an array in a file has to be.

    Attributes:
        dtype: its type, say "f8"; the order of bytes is the machine's after reading.
        shape: its shape, None standing for any length; None as a whole: any shape.
        required: whether a file without it is refused.
    """

    dtype: DTypeLike
    shape: tuple[int | None, ...] | None = None
    required: bool = True

    def check(self, name: str, dtype: np.dtype[Any], shape: tuple[int, ...]) -> None:
        """Raise ValueError if an array of this type and shape is not what is expected."""
        wanted = np.dtype(self.dtype)
        if dtype.newbyteorder("=") != wanted:
            raise ValueError(f"array {name!r} must be {wanted}, got {dtype}")
        if self.shape is None:
            return
        fits = len(shape) == len(self.shape) and all(
            expected is None or size == expected
            for size, expected in zip(shape, self.shape, strict=True)
        )
        if not fits:
            wanted_shape = ", ".join("any" if n is None else str(n) for n in self.shape)
            raise ValueError(f"array {name!r} must have shape ({wanted_shape}), got {shape}")


class ArrayFile:
    """An npz file that is open for reading; `open_arrays` makes one.

    Attributes:
        names: the arrays that it holds.
    """

    def __init__(self, archive: zipfile.ZipFile, size: int, limit: int) -> None:
        self._archive = archive
        self._left = limit
        self._limit = limit
        self._members: dict[str, zipfile.ZipInfo] = {}
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            if name in self._members or name == member.filename:
                raise ValueError(f"it holds {member.filename!r}, which is not an array of its own")
            stored = member.compress_type == zipfile.ZIP_STORED
            most = member.compress_size * (1 if stored else _DEFLATE_RATIO)
            if member.compress_size > size or member.file_size > most:
                raise ValueError(f"array {name!r} claims more bytes than the file has")
            self._members[name] = member

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._members)

    def read(self, name: str, spec: ArraySpec) -> NDArray[Any]:
        """The array `name`, a new one, after its type and shape have been found to be as expected.

        Raises ValueError if it is missing, other than expected, damaged, or if all arrays read so
        far would take more memory than the limit.
        """
        if name not in self._members:
            held = ", ".join(map(repr, self._members)) or "none"
            raise ValueError(f"it has no array {name!r} (it holds {held})")
        member = self._members[name]
        with self._archive.open(member) as stream:
            dtype, shape, fortran_order = _array_header(stream, name)
            spec.check(name, dtype, shape)
            count = 1
            for length in shape:
                count *= length
            size = count * dtype.itemsize
            if stream.tell() + size != member.file_size:
                raise ValueError(
                    f"array {name!r} of shape {shape} does not fill its {member.file_size} bytes"
                )
            if size > self._left:
                raise ValueError(f"its arrays take more than {self._limit:,} bytes of memory")
            self._left -= size
            array = np.empty(count, dtype)
            for start in range(0, size, _CHUNK):
                part = stream.read(min(_CHUNK, size - start))
                array.view(np.uint8)[start : start + len(part)] = np.frombuffer(part, np.uint8)
            if stream.tell() != member.file_size or stream.read(1):  # compares the checksum, too
                raise ValueError(f"array {name!r} ends early")
        if not dtype.isnative:
            array = array.astype(dtype.newbyteorder("="))
        return array.reshape(shape, order="F" if fortran_order else "C")


def _array_header(stream: IO[bytes], name: str) -> tuple[np.dtype[Any], tuple[int, ...], bool]:
    """Type, shape and order of the array that follows in the stream.

    Read by a pattern, where NumPy would parse the text as Python: it comes from anywhere.
    """
    magic = stream.read(8)
    if magic[:6] != b"\x93NUMPY" or magic[6:] not in (b"\x01\x00", b"\x02\x00"):
        raise ValueError(f"array {name!r} is not in version 1 or 2 of NumPy's format")
    text = stream.read(int.from_bytes(stream.read(2 * magic[6]), "little"))
    match = _HEADER.fullmatch(text)
    if match is None:
        raise ValueError(f"array {name!r} does not begin as a plain array does")
    dtype = np.dtype(match[1].decode())
    if dtype.hasobject:
        raise ValueError(f"array {name!r} holds Python objects, which are never read")
    shape = tuple(int(length) for length in match[3].replace(b",", b" ").split())
    return dtype, shape, match[2] == b"True"


class NotDefinedError(ValueError):
    """A file is whole, but names a class that this process has not defined."""


@contextlib.contextmanager
def open_arrays(
    path: str | os.PathLike[str], *, limit: int = MAX_BYTES, what: str = "file of arrays"
) -> Iterator[ArrayFile]:
    """Open an npz file whose arrays are then read one by one; what was read is in plain arrays.

    Nothing in the file is run (there is no pickle), and no memory is asked for before the file has
    been found to hold as many bytes; all arrays together take at most `limit` bytes. `what` is the
    name of such a file in the sentence that refuses another: "checkpoint", "file of trials".

    Raises ValueError, in one sentence that says what the file is instead, if it is missing, cannot
    be read, is no npz file or is damaged; and makes a sentence about the file of any error that
    its contents cause within the block: LookupError, TypeError, ValueError, OverflowError.
    """
    place = path_of(path, "read")
    try:
        mode = os.stat(place).st_mode
        file = open(place, "rb") if stat.S_ISREG(mode) else None  # noqa: SIM115
    except FileNotFoundError:
        raise ValueError(f"there is no {what} {place}; give the path of a saved one") from None
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        blame = _blame(place, error)
        raise ValueError(f"cannot read the {what} {_shortened(place)}: {blame}") from None
    if file is None:
        raise _of_another_kind(place, what, _described(place))
    with file:
        try:
            size = os.fstat(file.fileno()).st_size
            with zipfile.ZipFile(file) as archive:
                yield ArrayFile(archive, size, limit)
        except OSError as error:
            raise _damaged(place, what, error) from None
        except NotDefinedError as error:
            raise ValueError(f"{place}: {error}") from None
        except _DAMAGE as error:
            kind = _described(place)
            if kind != _ZIP:
                raise _of_another_kind(place, what, kind) from None
            raise _damaged(place, what, error) from None


def read_arrays(
    path: str | os.PathLike[str],
    expected: Mapping[str, ArraySpec],
    *,
    limit: int = MAX_BYTES,
    what: str = "file of arrays",
) -> dict[str, NDArray[Any]]:
    """The arrays of an npz file, each as expected; those that are not required may be missing.

    Raises ValueError as `open_arrays` does, and if the file holds an array that is not expected.
    """
    with open_arrays(path, limit=limit, what=what) as file:
        unknown = sorted(set(file.names) - set(expected))
        if unknown:
            raise ValueError(f"it holds an array {unknown[0]!r} that does not belong there")
        return {
            name: file.read(name, spec)
            for name, spec in expected.items()
            if spec.required or name in file.names
        }


_ZIP = "a zip file"
_SIGNS = (
    (b"PK", _ZIP),
    (b"\x93NUMPY", "a single NumPy array (.npy)"),
    (b"\x89HDF", "an HDF5 file"),
    (b"\x89PNG", "a picture (PNG)"),
    (b"\x1f\x8b", "a gzip file"),
    *((b"\x80" + bytes([protocol]), "a Python pickle") for protocol in (2, 3, 4, 5)),
)
_UNKNOWN = "of an unknown kind, or damaged"


def _described(path: Path) -> str:
    """What lies at `path`, in words, by its first bytes."""
    mode = os.stat(path).st_mode
    if stat.S_ISDIR(mode):
        return "a folder"
    if not stat.S_ISREG(mode):
        return "no regular file"
    with open(path, "rb") as file:
        start = file.read(1024)
    if not start:
        return "an empty file"
    for sign, kind in _SIGNS:
        if start.startswith(sign):
            return kind
    try:
        text = codecs.getincrementaldecoder("utf-8")().decode(start)  # may end within a character
    except UnicodeDecodeError:
        return _UNKNOWN
    return "a text file" if all(c.isprintable() or c.isspace() for c in text) else _UNKNOWN


def _of_another_kind(path: Path, what: str, kind: str) -> ValueError:
    return ValueError(
        f"{path} is not a readable {what}: it is {kind}; give the path of a file that was saved "
        "as one"
    )


def _damaged(path: Path, what: str, error: Exception) -> ValueError:
    reason = str(error).strip("'\" ") or type(error).__name__
    return ValueError(
        f"{path} is not a readable {what}: {reason}; it is damaged or of another kind: save again"
    )
