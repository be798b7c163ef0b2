"""Every Python block of README and site runs.

The blocks of a page run in order, in one namespace, in an empty folder. A comment in the line above
a block says what else is to happen: `<!-- slow: why -->` runs with `-m slow` only, and
`<!-- not run: why -->` is compiled but never run.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from agents import registry
from tests.docs.pages import ROOT, Block, blocks, name, pages

MARKS = (None, "slow", "not run")
OPTIONAL = ("stable_baselines3", "sb3_contrib", "torch", "roadrunner", "matplotlib", "xarray")
NEEDS = {"agents.rl": "stable_baselines3", "agents.chemistry": "roadrunner"}
PAGES = [page for page in pages() if blocks(page, "python")]
SLOW = [page for page in PAGES if any(b.mark == "slow" for b in blocks(page, "python"))]
Names = dict[str, Any]


def run(page: Path, marks: tuple[str | None, ...]) -> list[Names]:
    """The names that there are after each block that ran."""
    wanted = [block for block in blocks(page, "python") if block.mark in marks]
    skip_without_extras(wanted)
    module = ModuleType("page_" + re.sub(r"\W+", "_", name(page)))
    sys.modules[module.__name__] = module  # where pickle finds the classes that a page defines
    after = []
    for block in wanted:
        exec(compiled(block), vars(module))
        after.append(dict(vars(module)))
    return after


def compiled(block: Block) -> Any:
    """As code of the page itself: tracebacks and `inspect.getsource` find the lines there."""
    return compile("\n" * block.line + block.code, str(block.page), "exec")


def skip_without_extras(wanted: list[Block]) -> None:
    code = "\n".join(block.code for block in wanted)
    modules = set(re.findall(r"^\s*(?:from|import) ([\w.]+)", code, re.MULTILINE))
    for module in sorted(modules):
        package = NEEDS.get(module, module.split(".")[0])
        if package in OPTIONAL:
            pytest.importorskip(package)


# What a page promises in words beside its code; block by block, counted among those that run.


def readme(after: list[Names]) -> None:
    assert after[0]["bins"].mean() > 5 * after[0]["task"].silent_score


def own_agent(after: list[Names]) -> None:
    assert after[0]["bins"].tolist() == [10_000] * 10
    # Two spikes are owed in about 200 bins; the learner began with one in every other bin.
    assert 0.002 < after[1]["agent"].rate < 0.05
    assert after[2]["agent"].n_inputs == 100
    assert after[3]["labels"].size > 0 and after[3]["labels"].min() >= 0


def own_neuron(after: list[Names]) -> None:
    names = after[-1]
    assert names["bins"].mean() > 2 * names["task"].silent_score


PROMISES: dict[str, Callable[[list[Names]], None]] = {
    "README.md": readme,
    "docs/bring-your-own/agent.md": own_agent,
    "docs/bring-your-own/neuron.md": own_neuron,
    "docs/bring-your-own/rule.md": own_neuron,
}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")


@pytest.fixture(autouse=True)
def _where_only_the_package_has_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page may give its classes names that other tests, or other pages, have given to theirs."""
    own = {
        kind: {n: cls for n, cls in known.items() if cls.__module__.startswith("agents.")}
        for kind, known in registry._REGISTERED.items()
    }
    monkeypatch.setattr(registry, "_REGISTERED", own)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_the_code_of_a_page_runs(page: Path) -> None:
    after = run(page, (None,))
    PROMISES.get(name(page), lambda after: None)(after)


@pytest.mark.slow
@pytest.mark.parametrize("page", SLOW, ids=name)
def test_the_slow_code_of_a_page_runs(page: Path) -> None:
    run(page, (None, "slow"))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_code_that_is_only_shown_says_why_and_is_python(page: Path) -> None:
    for block in blocks(page, "python"):
        assert block.mark in MARKS, f"{name(page)}:{block.line}: unknown mark {block.mark!r}"
        compiled(block)


def test_promises_are_made_for_pages_that_exist() -> None:
    assert all((ROOT / page).exists() for page in PROMISES)
