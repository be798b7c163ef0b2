"""The page "Where to change what" names files that are there."""

from __future__ import annotations

import re

from tests.docs.pages import DOCS, ROOT

PAGE = (DOCS / "where-to-change-what.md").read_text(encoding="utf-8")
PATH = re.compile(r"`((?:[\w.-]+/)+[\w.-]*)`")


def test_the_files_to_touch_exist() -> None:
    table = PAGE.partition("| to change | files |")[2].partition("\n\n")[0]
    rows = [row for row in table.splitlines() if row.startswith("| ") and "---" not in row]
    assert len(rows) > 15
    paths = [path for row in rows for path in PATH.findall(row)]
    assert [path for path in paths if not (ROOT / path).exists()] == []
    without = [row for row in rows if not PATH.search(row) and "`__all__`" not in row]
    assert without == []
