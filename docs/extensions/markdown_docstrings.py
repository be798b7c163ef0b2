"""Docstrings here are Markdown with Google's sections; this hands them to autodoc as they are.

Every docstring becomes one `markdown` directive, parsed by MyST. Sections such as "Args:" become
fields, headings become bold lines, and a name in backticks that the reference knows becomes a link.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any, get_origin

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.utils import new_document
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx

SECTION = re.compile(r"^(Args|Arguments|Attributes|Returns|Raises|Yields):$")
FIELD = {"Args": "param", "Arguments": "param", "Raises": "raises"}
WHOLE = {"Returns": "returns", "Yields": "yields"}
ITEM = re.compile(r"^ {4}(\*{0,2}[\w.]+(?:, \*{0,2}[\w.]+)*)(?: \([^)]*\))?: ?(.*)$")
HEADING = re.compile(r"^#{1,6} (.*)$")
NAME = re.compile(r"^([A-Za-z_][\w.]*)(\(\))?$")


def as_fields(title: str, body: list[str], of_class: bool) -> Iterator[str]:
    """A section of Google's form as Markdown fields."""
    if title in WHOLE:
        yield f":{WHOLE[title]}: " + " ".join(line.strip() for line in body if line.strip())
        return
    field = FIELD.get(title) or ("param" if of_class else "ivar")
    for line in body:
        item = ITEM.match(line)
        if item:
            name = item[1].replace("*", r"\*")
            yield f":{field} {name}: {item[2]}"
        elif line.strip():
            yield line if line.startswith("     ") else f"    {line}"
        else:
            yield ""


def markdown(lines: list[str], of_class: bool = False) -> list[str]:
    """A docstring with its sections as fields and its headings as bold lines."""
    result: list[str] = []
    rest = list(lines)
    while rest:
        line = rest.pop(0)
        section = SECTION.match(line)
        if section is None:
            heading = HEADING.match(line)
            result.append(f"**{heading[1]}**" if heading else line)
            if heading:
                result.append("")
            continue
        body: list[str] = []
        while rest and (not rest[0].strip() or rest[0].startswith("    ")):
            body.append(rest.pop(0))
        result += ["", *as_fields(section[1], body, of_class), ""]
    return result


def first_sentence(docstring: str | None) -> str:
    """What a table says of an object: the first sentence of its docstring."""
    paragraph = " ".join((docstring or "").strip().partition("\n\n")[0].split())
    return re.split(r"(?<=[.!?])\s", paragraph, maxsplit=1)[0]


class MarkdownDirective(Directive):
    """Its content as Markdown."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        document = self.state.document
        inner = new_document(document.current_source or "", document.settings)
        MystParser().parse("\n".join(self.content), inner)
        link_names(inner, document.settings.env.app)
        return list(inner.children)


def link_names(tree: nodes.Element, app: Sphinx) -> None:
    """Turn names in backticks into links where the reference has them."""
    targets: dict[str, str] = getattr(app, "public_targets", {})
    for literal in list(tree.findall(nodes.literal)):
        name = NAME.match(literal.astext())
        target = targets.get(name[1]) if name else None
        if target is None or inside_link_or_title(literal):
            continue
        link = pending_xref(
            "", refdomain="py", reftype="obj", reftarget=target, refexplicit=True, refwarn=True
        )
        literal.replace_self(link)
        link += literal


def inside_link_or_title(node: nodes.Node) -> bool:
    while node.parent is not None:
        node = node.parent
        if isinstance(node, nodes.reference | pending_xref | nodes.title):
            return True
    return False


def link_names_of_page(app: Sphinx, doctree: nodes.document) -> None:
    """The same for whole pages: `Task` in the text leads to its place in the reference."""
    link_names(doctree, app)


def is_plain_data(obj: Any) -> bool:
    """Neither class nor function, compiled ones included: a number, a table, a type alias."""
    if get_origin(obj) is not None:
        return True
    return not (inspect.isclass(obj) or inspect.isroutine(obj) or hasattr(obj, "py_func"))


def hand_over(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """`autodoc-process-docstring`: wrap the docstring in the directive."""
    shorten: Callable[[Any, list[str]], list[str]] | None = getattr(app, "shorten_manual", None)
    if what == "data" and lines and lines[0] == (obj.__doc__ or "").partition("\n")[0]:
        lines.clear()  # what int says of itself is nothing about this number
    text = list(lines) if shorten is None else shorten(obj, list(lines))
    text = markdown(text, of_class=what in ("class", "exception"))
    lines[:] = [".. markdown::", "", *(f"   {line}" for line in text), ""]


ARRAY = re.compile(
    r"(?:numpy\.)?ndarray\[tuple\[(?:typing\.)?Any, \.\.\.\], (?:numpy\.)?dtype\[([^\[\]]+)\]\]"
)


def shorten_types(
    app: Sphinx,
    what: str,
    name: str,
    obj: Any,
    options: Any,
    signature: str | None,
    result: str | None,
) -> tuple[str | None, str | None]:
    """`autodoc-process-signature`: NDArray[int8], as the source has it, for what it stands for."""

    def shorter(text: str | None) -> str | None:
        return None if text is None else ARRAY.sub(r"NDArray[\1]", text)

    return shorter(signature), shorter(result)


def setup(app: Sphinx) -> dict[str, Any]:
    app.setup_extension("sphinx.ext.autodoc")
    app.add_directive("markdown", MarkdownDirective)
    app.connect("autodoc-process-docstring", hand_over)
    app.connect("autodoc-process-signature", shorten_types)
    app.connect("doctree-read", link_names_of_page)
    return {"parallel_read_safe": True, "version": "1"}
