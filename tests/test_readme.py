"""The README's links lead somewhere, also from the package's page on an index."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
FILES = re.compile(
    r"https://(?:github\.com/gnm-env/gnm-env/blob|raw\.githubusercontent\.com/gnm-env/gnm-env)"
    r"/main/([^#]+)"
)


def links() -> list[str]:
    return re.findall(r"\]\(([^)]+)\)", README)


def test_every_link_works_away_from_the_repository() -> None:
    assert [link for link in links() if not link.startswith(("https://", "#"))] == []


def test_links_to_files_lead_somewhere() -> None:
    files = [found[1] for link in links() if (found := FILES.match(link))]
    assert files
    assert [file for file in files if not (ROOT / file).exists()] == []
