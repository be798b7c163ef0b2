"""Whose models these are: SB3's zips hold pickled objects, which may run anything when opened.

Every model that is saved here is sealed with a key that only this user on this machine has, in a
small file beside it. A model without a fitting seal was written elsewhere, or changed since.
"""

from __future__ import annotations

import hashlib
import hmac
import os
from pathlib import Path

KEY_BYTES = 32


def seal(path: str | os.PathLike[str]) -> None:
    """Write the seal of the model at `path`. Without a place for the key there is none."""
    key = _key()
    if key is not None:
        _seal_of(path).write_text(_digest(Path(path), key), encoding="ascii")


def is_own(path: str | os.PathLike[str]) -> bool:
    """Whether this user's own run wrote the model at `path`, and nobody has changed it since."""
    key = _key()
    try:
        told = _seal_of(path).read_text(encoding="ascii")
        return key is not None and hmac.compare_digest(told, _digest(Path(path), key))
    except (OSError, ValueError):
        return False


def require_trust(trust: bool, *paths: Path) -> None:
    """ValueError for a model that another wrote, unless the user says that it is to be trusted."""
    foreign = [path for path in paths if path.exists() and not is_own(path)]
    if foreign and not trust:
        raise ValueError(
            f"{foreign[0]} was not written by a run of yours on this machine, and it holds pickled "
            "objects, which may run any program when they are opened: give --trust if you trust "
            "where it comes from"
        )


def _seal_of(path: str | os.PathLike[str]) -> Path:
    return Path(f"{os.fspath(path)}.seal")


def _digest(path: Path, key: bytes) -> str:
    return hmac.new(key, path.read_bytes(), hashlib.sha256).hexdigest()


def _key() -> bytes | None:
    """The user's key, made when it is first wanted; None where it cannot be kept."""
    try:
        base = os.environ.get("APPDATA") or os.environ.get("XDG_CONFIG_HOME")
        path = (Path(base) if base else Path.home() / ".config") / "gnm-env" / "key"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh = path.with_name(f"key.{os.getpid()}")
            with open(os.open(fresh, os.O_CREAT | os.O_WRONLY, 0o600), "wb") as file:
                file.write(os.urandom(KEY_BYTES))
            fresh.replace(path)
        key = path.read_bytes()
        return key if len(key) == KEY_BYTES else None
    except (OSError, RuntimeError):
        return None
