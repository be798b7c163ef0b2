"""What the pages on agents of one's own show is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[3] / "docs"
PAGES = [DOCS / "bring-your-own-agent.md", DOCS / "reinforcement-learning.md"]


def blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


def run(code: str) -> dict[str, object]:
    names: dict[str, object] = {}
    exec(compile(code, "a page", "exec"), names)
    return names


def test_the_policy_in_fifteen_lines_survives_to_the_cap():
    names = run(blocks(PAGES[0])[0])
    assert names["bins"].tolist() == [10_000] * 10


def test_the_learner_in_the_loop_comes_nearer_to_what_it_owes():
    agent = run(blocks(PAGES[0])[1])["agent"]
    # Two spikes are owed in about 200 bins; it began with one in every other bin.
    assert 0.002 < agent.rate < 0.05


def test_a_model_of_stable_baselines_is_scored():
    pytest.importorskip("stable_baselines3")
    assert run(blocks(PAGES[0])[2])["agent"].n_inputs == 100


def test_thousands_of_streams_end_with_their_labels():
    names = run(blocks(PAGES[0])[3])
    assert names["labels"].size > 0 and names["labels"].min() >= 0


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    targets = re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text())
    assert [target for target in targets if not (page.parent / target).exists()] == []
