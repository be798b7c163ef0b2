"""What the README shows is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = (Path(__file__).parent.parent / "README.md").read_text()


def test_the_twelve_lines_run_and_beat_silence(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["bins"].mean() > 5 * names["task"].silent_score  # type: ignore[attr-defined]
    assert "without a mistake" in capsys.readouterr().out


def test_links_lead_somewhere() -> None:
    root = Path(__file__).parent.parent
    targets = re.findall(r"\]\((?!http)([^)#]+)\)", README)
    assert targets
    assert [target for target in targets if not (root / target).exists()] == []
