"""What is public: every name in the `__all__` of a package or module of the project."""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABC
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from markdown_docstrings import first_sentence, is_plain_data
from sphinx.application import Sphinx

ROOTS = ("gnm_env", "agents")


@dataclass(frozen=True, eq=False)
class Public:
    """One public object: where it is documented, and every name that leads to it."""

    home: str
    name: str
    value: Any

    @property
    def path(self) -> str:
        return f"{self.home}.{self.name}"


def public_modules() -> list[ModuleType]:
    """Every module that says in `__all__` what it offers, shortest path first."""
    found = []
    for root in ROOTS:
        package = importlib.import_module(root)
        found.append(package)
        for info in pkgutil.walk_packages(package.__path__, f"{root}."):
            if any(part.startswith("_") for part in info.name.split(".")):
                continue
            module = importlib.import_module(info.name)
            if getattr(module, "__all__", None):
                found.append(module)
    return sorted(found, key=lambda m: (ROOTS.index(m.__name__.split(".")[0]), depth(m)))


def depth(module: ModuleType) -> tuple[int, str]:
    return module.__name__.count("."), module.__name__


def public_names() -> dict[str, Public]:
    """Dotted name -> object. An object offered in several places lives at the shortest path."""
    homes: dict[Any, Public] = {}
    names: dict[str, Public] = {}
    for module in public_modules():
        for name in module.__all__:
            value = getattr(module, name)
            key = identity(value) or (module.__name__, name)
            public = homes.setdefault(key, Public(module.__name__, name, value))
            names[f"{module.__name__}.{name}"] = public
    return names


def identity(value: Any) -> Any:
    """What tells an object offered twice: classes and functions are one wherever they stand."""
    return id(value) if hasattr(value, "__qualname__") and hasattr(value, "__module__") else None


class NamesDirective(Directive):
    """Base of the tables of names: each a link, with the first sentence of its docstring."""

    required_arguments = 1

    def table(self, entries: list[Public]) -> list[nodes.Node]:
        rows = []
        for public in entries:
            value = public.value
            sentence = "" if is_plain_data(value) else first_sentence(value.__doc__)
            rows += [f"   * - :py:obj:`{public.name} <{public.path}>`", "     - .. markdown::", ""]
            rows += [f"          {sentence}", ""]
        lines = [".. list-table::", "   :widths: 30 70", "   :class: names", "", *rows]
        holder = nodes.Element()
        self.state.nested_parse(StringList(lines, source=self.name), 0, holder)
        return list(holder.children)


class SummaryDirective(NamesDirective):
    """The public names of a module."""

    def run(self) -> list[nodes.Node]:
        module = importlib.import_module(self.arguments[0])
        names = public_names()
        return self.table([names[f"{module.__name__}.{name}"] for name in module.__all__])


class KindDirective(NamesDirective):
    """Every public class that has a base with the class in the argument: all neurons, all rules."""

    def run(self) -> list[nodes.Node]:
        names = public_names()
        example = names[self.arguments[0]].value
        base = [cls for cls in example.__mro__ if cls not in (example, ABC, object)][-1]
        return self.table([p for p in unique(names) if is_kind(p.value, base)])


def unique(names: dict[str, Public]) -> list[Public]:
    """Each object once, in the order of the pages."""
    return list(dict.fromkeys(names.values()))


def is_kind(value: Any, base: type) -> bool:
    return isinstance(value, type) and issubclass(value, base) and value is not base


def collect(app: Sphinx) -> None:
    """Before anything is read: which names there are, and where each is documented."""
    targets: dict[str, str] = {}
    for dotted, public in public_names().items():
        targets[dotted] = public.path
        # Alone, a name is a link where it says enough: classes, and what the two roots offer.
        if public.home in ROOTS or public.name[0].isupper():
            targets.setdefault(public.name, public.path)
    app.public_targets = targets  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_directive("summary", SummaryDirective)
    app.add_directive("all-like", KindDirective)
    app.connect("builder-inited", collect, priority=100)
    return {"parallel_read_safe": True, "version": "1"}
