"""The pages of the documentation, and the blocks of code in them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
NOT_OURS = (
    "_build",
    "tutorials/gallery",
    "environments/gnm-",
    "reproduction/",
    "findings/",
    "forensics/",
)
MARK = r"(?:<!-- (?P<mark>[a-z ]+): (?P<reason>[^>]+?) -->\n)?"
BLOCK = re.compile(MARK + r"```(?P<language>\w+)\n(?P<code>.*?)^```", re.MULTILINE | re.DOTALL)


def pages() -> list[Path]:
    """README, CONTRIBUTING and every page of the site that is written by hand."""
    written = [
        page
        for page in sorted(DOCS.rglob("*.md"))
        if not page.relative_to(DOCS).as_posix().startswith(NOT_OURS)
    ]
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *written]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@dataclass(frozen=True)
class Block:
    """A fenced block: its language and code, the line that it begins on, and its mark, if any."""

    page: Path
    line: int
    language: str
    code: str
    mark: str | None
    reason: str | None


def blocks(page: Path, *languages: str) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(
            page,
            text.count("\n", 0, found.start("code")),
            found["language"],
            found["code"],
            found["mark"],
            found["reason"],
        )
        for found in BLOCK.finditer(text)
        if found["language"] in languages
    ]
