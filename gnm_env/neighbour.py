"""Is the package `agents` beside this one the one that it was installed with?

Other projects install a top-level module `agents` too, `openai-agents` among them, and a folder
`agents` further up the path hides ours. Python would then end in an ImportError deep inside, which
tells nobody what has happened; here one sentence does.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import warnings
from importlib.machinery import ModuleSpec
from pathlib import Path

OURS = "NeuronAgent"  # what the source of our `agents` exports, and no other has


def foreign_agents() -> str | None:
    """One sentence if `import agents` would find somebody else's package, else None.

    Nothing is imported: where only the environments are used, `agents` need not even exist.
    """
    try:
        spec = importlib.util.find_spec("agents")
    except ValueError:  # a module that was made by hand stands in its place
        return None
    if spec is None or _is_ours(spec):
        return None
    found = spec.origin or ", ".join(spec.submodule_search_locations or ["an unknown place"])
    return (
        f"the module `agents` at {found} is not the one of gnm-env: take it off the path, or "
        "install gnm-env in an environment of its own (openai-agents brings such a module; the two "
        "cannot live in one environment)"
    )


def _is_ours(spec: ModuleSpec) -> bool:
    read = getattr(spec.loader, "get_source", None)
    source = read("agents") if read else ""
    return source is None or OURS in source  # where there is no source, nothing speaks against it


def warn_of_foreign_agents() -> None:
    """A UserWarning if `import agents` would find somebody else's package.

    The environments work beside it, so that it is no error; `gnm`, which does not, says it itself.
    """
    told = foreign_agents()
    if told and Path(sys.argv[0] if sys.argv else "").stem != "gnm":
        warnings.warn(told, stacklevel=3)


def main() -> None:
    """The console command `gnm`: it begins here, so that it can say what would keep it away."""
    told = foreign_agents()
    if told:
        print(f"gnm: {told}", file=sys.stderr)
        sys.exit(2)
    importlib.import_module("agents.commands").main()
