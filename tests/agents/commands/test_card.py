"""gnm card: a README.md with settings and scores, a replay, and nothing replaced unasked."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("PIL")

from agents import GNM, ErrorTrace, NeuronAgent
from agents.commands import card
from agents.commands.terminal import parse
from gnm_env import Patterns, Task

TASK = Task(n_classes=2, jitter_bins=1)
PATTERNS = Patterns.draw(TASK, 0)
FAST = ["--runs", "5", "--bins", "40"]


def code_of(text: str) -> str:
    found = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.fixture
def neuron(tmp_path: Path) -> Path:
    agent = NeuronAgent(GNM(alpha=0.25), ErrorTrace(), n_inputs=100, seed=0)
    agent.save(tmp_path / "agent.npz", task=TASK, patterns=PATTERNS)
    return tmp_path


def test_the_card_of_a_neuron_says_what_it_is_and_how_good(
    neuron: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told = card.main(parse(card, [neuron, "--name", "My | neuron", *FAST]))
    text = (neuron / "README.md").read_text(encoding="utf-8")
    head = text.split("---")[1]
    assert "library_name: gnm-env" in head and '- name: "My | neuron"' in head
    mean = told["score"]["noisy_performance"]["mean"]
    assert f"| noisy performance | {mean:,.0f} bins [" in text
    for row in ("| alpha | 0.25 |", "| rule | et |", "| jitter_bins | 1 |",
                "| spikes owed per class | 1, 2 |"):  # fmt: skip
        assert row in text
    assert (neuron / "replay.gif").read_bytes()[:3] == b"GIF"
    monkeypatch.chdir(neuron)
    exec(code_of(text).replace(".mean()", ".shape"), {})
    assert "(100,)" in capsys.readouterr().out


def test_a_readme_that_is_there_is_not_replaced_unasked(neuron: Path) -> None:
    (neuron / "README.md").write_text("mine")
    with pytest.raises(ValueError, match=r"README\.md is there already: give --replace"):
        card.main(parse(card, [neuron, *FAST]))
    assert (neuron / "README.md").read_text() == "mine"
    card.main(parse(card, [neuron, "--replace", *FAST]))
    assert (neuron / "README.md").read_text() != "mine"


def test_the_card_of_a_policy_has_its_hyperparameters(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    from agents.rl import make_rl_agent, save, training_env

    env = training_env(TASK, PATTERNS, "ppo-linear", n_envs=2)
    save(tmp_path, make_rl_agent("ppo-linear", env), "ppo-linear", TASK, PATTERNS)
    card.main(parse(card, [tmp_path, *FAST]))
    text = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "library_name: stable-baselines3" in text
    for row in ("| algorithm | PPO |", "| gae_lambda | 1.0 |", "| observation: decays | 0.3 |"):
        assert row in text
    assert "pickled objects" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{}/none"], "there is no folder"),
        (["{}"], "holds no RL agent, it has no task.json"),
        (["{}", "--name", "a\nb"], "the name must be a line"),
    ],
)
def test_what_is_no_agent_is_refused(tmp_path: Path, words: list[str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        card.main(parse(card, [word.format(tmp_path) for word in words]))
    assert not list(tmp_path.iterdir())
