"""What the scripts share: one clear line on bad input, and one JSON object for other programs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from typing import Any


def run(main: Callable[[], dict[str, Any]], *, as_json: bool, name: str) -> None:
    """Run `main` and end the process. With `as_json` the result is the last line of stdout.

    Bad input, a full disk, a missing package and the like end with exit code 2 and one line;
    Ctrl-C with 130.
    """
    try:
        result = main()
    except (ValueError, OSError, ImportError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        _leave(2)
    except KeyboardInterrupt:
        print(f"{name}: stopped; what is finished is kept, run it again to go on", file=sys.stderr)
        _leave(130)
    if as_json:
        print(json.dumps(result))


def _leave(code: int) -> None:
    """End at once: threads may still be at a block, whose result nobody waits for any more."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
