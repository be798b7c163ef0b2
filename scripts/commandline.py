"""What the scripts share: one clear line on bad input, and one JSON object for other programs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def imports(name: str, extra: str) -> Iterator[None]:
    """Around the imports of a script that needs an extra: without it, one line and exit code 2."""
    try:
        yield
    except ModuleNotFoundError as error:
        print(
            f'{name}: {error.name} is not installed: pip install -e ".[{extra}]"', file=sys.stderr
        )
        sys.exit(2)


def run(
    main: Callable[[], dict[str, Any]], *, as_json: bool, name: str, resumes: bool = False
) -> None:
    """Run `main` and end the process. With `as_json` the result is the last line of stdout.

    `resumes` says of a script that it keeps what is finished and goes on from there.

    Bad input, a full disk, a missing package and the like end with exit code 2 and one line;
    Ctrl-C with 130.
    """
    try:
        result = main()
    except (ValueError, OSError, ImportError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        _leave(2)
    except KeyboardInterrupt:
        hint = "; what is finished is kept, run it again to go on" if resumes else ""
        print(f"{name}: stopped{hint}", file=sys.stderr)
        _leave(130)
    if as_json:
        print(json.dumps(result))


def _leave(code: int) -> None:
    """End at once: threads may still be at a block, whose result nobody waits for any more."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
