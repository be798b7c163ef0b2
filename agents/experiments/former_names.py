"""Names that earlier versions gave to what is called otherwise today, translated when read.

The wide start was called "published", which says more than is so: the initial weights alone were
those of the authors' code. Results and chosen settings made under that name keep their numbers.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

_FORMER = re.compile(r"^published(?=$|: )|(?<=^F3-)published$|(?<=, tuned λ, )published$")
_NOW = "wide"


def current(value: Any) -> Any:
    """`value` with former names as those of today, in all that it holds, keys included."""
    if isinstance(value, str):
        return _FORMER.sub(_NOW, value)
    if isinstance(value, dict):
        return {current(key): current(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [current(inner) for inner in value]
    return value


def standing(folder: Path) -> Path:
    """Where the store of that name is: `folder`, or if only that is there, its former name's."""
    former = folder.with_name(folder.name.replace(f"F3-{_NOW}", "F3-published"))
    return former if former.exists() and not folder.exists() else folder
