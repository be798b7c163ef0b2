"""The optional packages of the chemistry, asked for only where they are needed."""

from __future__ import annotations

import importlib
from typing import Any


def optional(module: str) -> Any:
    """The module of that name; ImportError with the remedy if it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(
            f"the chemistry needs {module}, which is not installed ({error}); "
            'install the extra: pip install "gnm-env[chemistry]"'
        ) from None
