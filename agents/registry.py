"""Every class of neurons, rules and agents, by name.

A class registers itself when it is defined, in this package, in a module of yours or in a notebook.
Checkpoints and command lines know it by that name from then on.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from importlib.abc import SourceLoader
from pathlib import Path
from typing import Any

from gnm_env.files import NotDefinedError

_REGISTERED: dict[str, dict[str, type]] = {
    "neuron": {},
    "network": {},
    "rule": {},
    "agent": {},
}


def register(kind: str, cls: type, step: tuple[str, ...] = ()) -> None:
    """Enter `cls`, which has just been defined, under its `name`.

    A class without a name, whose bases have none either, is a base of others and is not entered.

    Args:
        kind: "neuron", "network", "rule" or "agent".
        cls: the class; defining one of the same module and name again replaces the earlier one, as
            running the cell of a notebook again does.
        step: attributes that make the class differ from its parent.

    Raises:
        ValueError: if another class has the name, or if `cls` keeps the name of its parent.
    """
    name = getattr(cls, "name", None)
    if name is None:
        return
    if "name" not in vars(cls):
        changed = [attribute for attribute in step if attribute in vars(cls)]
        what = f"its own {changed[0]}" if changed else "no name of its own"
        raise ValueError(
            f"{cls.__name__} has {what} but keeps the name {name!r} of its parent: a checkpoint "
            f'would load it as that one; give it a name, such as name: ClassVar[str] = "'
            f'{cls.__name__.lower()}"'
        )
    if not isinstance(name, str) or not name.isascii() or not name.replace("-", "_").isidentifier():
        raise ValueError(
            f"the name of {cls.__name__} must be a word of letters, digits, - and _, got {name!r}"
        )
    known = _REGISTERED[kind].get(name)
    if known is not None and home(known) != home(cls):
        raise ValueError(
            f"the {kind} {home(cls)} cannot be called {name!r}: {home(known)} has that name; "
            "choose another"
        )
    _REGISTERED[kind][name] = cls


def known(kind: str, name: str) -> Any:
    """The class of that kind and name; None if there is none."""
    return _complete(kind).get(name)


def home(cls: type) -> str:
    """Where a class is defined, as "module:Class"."""
    return f"{cls.__module__}:{cls.__qualname__}"


def neurons() -> dict[str, type]:
    """All neurons defined so far, by name."""
    return _complete("neuron")


def networks() -> dict[str, type]:
    """All networks defined so far, by name."""
    return _complete("network")


def rules() -> dict[str, type]:
    """All learning rules defined so far, by name."""
    return _complete("rule")


def agents() -> dict[str, type]:
    """All classes of agents that checkpoints can hold, by name."""
    return _complete("agent")


def _complete(kind: str) -> dict[str, type]:
    """The classes of a kind, those of the package among them."""
    for module in ("agents", "agents.continuous", "agents.network"):
        importlib.import_module(module)
    return dict(_REGISTERED[kind])


def find_neuron(spec: str) -> type:
    """See `find`."""
    return find("neuron", spec)


def find_model(spec: str) -> type:
    """A neuron or a network; see `find`."""
    return find("network" if spec in networks() else "neuron", spec)


def find_rule(spec: str) -> type:
    """See `find`."""
    return find("rule", spec)


def find(kind: str, spec: str) -> type:
    """The class that `spec` names: a registered name, "module:Class" or "path/to/file.py:Class".

    Raises ValueError if there is none.
    """
    if not isinstance(spec, str):
        raise ValueError(
            f"a {kind} must be given by its name, or as module:Class or file.py:Class, got {spec!r}"
        )
    place, _, class_name = spec.rpartition(":")
    if not place:
        known = _complete(kind)
        if spec not in known:
            raise ValueError(
                f"there is no {kind} {spec!r}; known: {', '.join(sorted(known))}; "
                "yours is given as module:Class or file.py:Class"
            )
        return known[spec]
    module = load_module(place)
    cls = getattr(module, class_name, None)
    if not isinstance(cls, type):
        raise ValueError(f"{place} has no class {class_name!r}")
    if cls not in _REGISTERED[kind].values():
        raise ValueError(f"{spec} is no {kind}: derive it from the base class and give it a name")
    return cls


def load_module(place: str) -> Any:
    """The module named `place`, or that of the file `place`."""
    if not place.endswith(".py"):
        if place.startswith("."):
            raise ValueError(f"cannot import {place}: give the module's whole name, or its file")
        sys.path.insert(0, "")  # as `python -m` does: modules of the folder one stands in
        try:
            return importlib.import_module(place)
        except ModuleNotFoundError as error:
            raise ValueError(
                f"cannot import {place}: there is no module {error.name!r} here; "
                "give the path of its file, such as folder/file.py:Class"
            ) from None
        finally:
            sys.path.remove("")
    path = Path(place).resolve()
    if not path.is_file():
        raise ValueError(f"there is no file {place}")
    for module in list(sys.modules.values()):  # imported already, perhaps as part of a package
        if getattr(module, "__file__", None) == str(path):
            return module
    if path.stem in sys.modules:
        raise ValueError(
            f"{place} cannot be imported as {path.stem!r}: a module of that name is there already; "
            "rename the file"
        )
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and isinstance(spec.loader, SourceLoader)
    try:
        spec.loader.get_code(path.stem)
    except (SyntaxError, ValueError) as error:  # the latter for what is no text
        raise ValueError(f"{place} cannot be read as Python: {error}") from None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[path.stem]
        raise
    return module


def find_class(kind: str, name: str, where: str | None) -> type:
    """The class that a checkpoint names, of home `where`. NotDefinedError says what to import."""
    known = _complete(kind)
    if name in known:
        return known[name]
    module = (where or "").partition(":")[0]
    remedy = "define it first"
    if module not in ("", "__main__"):
        remedy = f"import {module} first (on the command line: --import {module})"
    raise NotDefinedError(
        f"the {kind} {name!r} is not known here ({where or 'its module was not kept'}): {remedy}"
    )
