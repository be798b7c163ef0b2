"""The tutorials run from beginning to end, each within a minute."""

from __future__ import annotations

import runpy
import time
from pathlib import Path

import pytest

from tests.docs.pages import DOCS

SCRIPTS = sorted((DOCS / "tutorials" / "scripts").glob("tutorial_*.py"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_tutorial_runs(
    script: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    start = time.process_time()
    runpy.run_path(str(script), run_name="__main__")
    plt.close("all")
    # A minute on a quiet machine, compiling included; of a busy one processor time counts more.
    assert time.process_time() - start < 90
    assert capsys.readouterr().out  # it tells what it found
