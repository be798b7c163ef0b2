"""The example of an outside agent: one command, the same scores bit by bit."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from agents.commands.report import differing
from gnm_env.results import read_results

FILE = Path(__file__).parents[2] / "examples" / "suite_agent.py"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("suite_agent", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_the_same_command_makes_the_same_scores_bit_by_bit(
    example: ModuleType, tmp_path: Path
) -> None:
    for folder in ("one", "other"):
        example.main(["--out", str(tmp_path / folder), "--trials", "60", "--seeds", "2"])
    assert differing(tmp_path / "one", tmp_path / "other") == []
    results = read_results(tmp_path / "one")
    assert [result.pattern_seed for result in results] == [100, 101]
    assert all(8_000 < result.last.heard < 16_000 for result in results)  # 60 trials of 200 bins
    assert results[0].last.survived != results[1].last.survived
    assert "--trials 60 --seeds 2" in results[0].command


@pytest.mark.slow
def test_it_learns(example: ModuleType, tmp_path: Path) -> None:
    (mean,) = example.main(["--out", str(tmp_path), "--seeds", "1"])
    assert mean > 5 * 148


def test_a_level_that_is_not_there_is_refused(example: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no level '7class'"):
        example.main(["--level", "7class", "--out", str(tmp_path)])
