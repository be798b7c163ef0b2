"""Write a model card: README.md and a replay (replay.gif) beside a saved agent, ready to upload.

    gnm card runs/ppo-cost            a folder of gnm train-rl or gnm train
    gnm card runs/ppo-cost --name "PPO on one pattern"

The card says how the agent was trained, scores it anew with intervals, and shows it at work. Its
head is in the form that model hubs read. Nothing is uploaded. The replay needs
pip install "gnm-env[video]".
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from agents.commands.evaluate import loaded
from agents.commands.scoring import score
from agents.commands.terminal import EVALUATION_SEED, Parser, at_least, share
from agents.watching import play
from gnm_env import Task, __version__
from gnm_env.checks import shown
from gnm_env.files import atomic_write

CARD, REPLAY, NEURON = "README.md", "replay.gif", "agent.npz"
STREAM = "gnm/PatternStream-v0"


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("folder", type=Path, help="of a saved agent; the card goes into it")
    add("--name", metavar="TEXT", help="of the agent (default: the folder's)")
    share(parser, "--runs", help="of the score")
    share(parser, "--seed", default=EVALUATION_SEED, help="of the first stream")
    add("--bins", type=at_least(1), default=600, metavar="N", help="of the replay (default 600)")
    add("--replace", action="store_true", help="replace a README.md that is there already")
    share(parser, "--import")
    share(parser, "--trust")
    # fmt: on


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Score the agent, record its replay and write its card."""
    folder: Path = options.folder
    name = _checked_name(folder.resolve().name if options.name is None else options.name)
    if not folder.is_dir():
        raise ValueError(f"there is no folder {folder}; give the one that an agent was saved in")
    if (folder / CARD).exists() and not options.replace:
        raise ValueError(f"{folder / CARD} is there already: give --replace to write it anew")
    neuron = (folder / NEURON).exists()
    agent, task, patterns = loaded(folder / NEURON if neuron else folder, trust=options.trust)
    result = score(agent, task, patterns, runs=options.runs, seed=options.seed)
    replay = play(
        agent, task, patterns, folder / REPLAY, bins=options.bins, seed=options.seed, scale=0.75
    )
    settings = _of_neuron(agent) if neuron else _of_policy(folder)
    text = card(name, task, settings, result, _use(neuron))
    with atomic_write(folder / CARD) as file:
        file.write(text.encode())
    print(f"card: {folder / CARD}\nreplay: {replay['path']}")
    return {"card": str(folder / CARD), "replay": replay["path"], "score": result}


def _checked_name(name: Any) -> str:
    if not isinstance(name, str) or not 1 <= len(name) <= 100 or not name.isprintable():
        raise ValueError(f"the name must be a line of 1 … 100 characters, got {shown(name)}")
    return name


def card(
    name: str, task: Task, settings: Mapping[str, Any], result: Mapping[str, Any], use: str
) -> str:
    """The text of a card: a head for model hubs, then what a person wants to know."""
    performance = result["noisy_performance"]
    low, high = performance["ci95"]
    rate, ends = result["mistakes_per_10000_bins"], result["mistakes_per_10000_bins_ci95"]
    classes = len(task.owed)
    of = f"{classes} pattern{'s' if classes > 1 else ''}"
    head = _head(name, settings, performance)
    scores = {
        "noisy performance": f"{performance['mean']:,.0f} bins [{low:,.0f} … {high:,.0f}]",
        "median": f"{performance['median']:,.0f} bins",
        "mistakes per 10,000 bins": f"{rate:.2f} [{ends[0]:.2f} … {ends[1]:.2f}]",
        "wrong trials": f"{100 * result['error_rate']:.1f} %",
        "silence would get": f"{result['silent_score']:,.0f} bins",
    }
    differing = {
        field.name: getattr(task, field.name)
        for field in fields(Task)
        if field.name != "targets" and getattr(task, field.name) != field.default
    }
    return "\n".join(
        [
            *head,
            f"# {name}",
            "",
            f"An agent that finds {of} hidden in noise and answers each with as many spikes as it "
            "owes; it learned from feedback on whole trials. It hears "
            f"`{STREAM}` of [gnm-env](https://github.com/gnm-env/gnm-env) {__version__}.",
            "",
            f"![The agent at work]({REPLAY})",
            "",
            f"## Score\n\n{_table(scores)}\n",
            f"Bins survived before the first mistake, learning off: mean of {performance['runs']} "
            f"streams of at most {performance['cap']:,} bins, with 95 % intervals over streams.",
            "",
            f"## Task\n\n{_table({'spikes owed per class': task.owed, **differing})}\n",
            f"## Settings\n\n{_table(settings)}\n",
            f"## Use\n\n{use}\n",
        ]
    )


def _head(name: str, settings: Mapping[str, Any], performance: Mapping[str, Any]) -> list[str]:
    """YAML; texts in quotes, as JSON has them, are YAML too."""
    rl = "algorithm" in settings
    low, high = performance["ci95"]
    value = f"{performance['mean']:.0f} [{low:.0f}, {high:.0f}]"
    return [
        "---",
        f"library_name: {'stable-baselines3' if rl else 'gnm-env'}",
        "tags:",
        *(f"- {tag}" for tag in (STREAM, "reinforcement-learning", "spiking-neuron", "gymnasium")),
        "model-index:",
        f"- name: {json.dumps(name, ensure_ascii=False)}",
        "  results:",
        "  - task:",
        "      type: reinforcement-learning",
        "      name: reinforcement-learning",
        "    dataset:",
        f"      name: {STREAM}",
        f"      type: {STREAM}",
        "    metrics:",
        "    - type: mean_reward",
        f"      value: {json.dumps(value)}",
        "      name: mean_reward",
        f"      verified: {json.dumps(False)}",
        "---",
    ]


def _table(rows: Mapping[str, Any]) -> str:
    lines = ["| | |", "|---|---|"]
    return "\n".join([*lines, *(f"| {key} | {_cell(value)} |" for key, value in rows.items())])


def _cell(value: Any) -> str:
    if isinstance(value, (tuple, list)):
        return ", ".join(map(str, value)) or "none"
    return str(value).replace("|", "\\|").replace("\n", " ")


def _of_neuron(agent: Any) -> dict[str, Any]:
    """What a neuron was made from, and its rule."""
    return {
        "neuron": agent.model.name,
        **asdict(agent.model),
        "rule": agent.rule.name,
        **{f"{agent.rule.name}: {name}": value for name, value in asdict(agent.rule).items()},
    }


def _of_policy(folder: Path) -> dict[str, Any]:
    """What SB3's model was made from, and how much it heard."""
    from agents.rl import HYPERPARAMETERS
    from agents.rl.checkpoint import described

    about = described(folder)
    chosen = HYPERPARAMETERS[about.kind]
    settings = {
        "kind": about.kind,
        "algorithm": chosen.algorithm.__name__,
        "feedback": about.feedback,
        **{f"observation: {k}": v for k, v in asdict(about.observation).items()},
        "environments side by side": chosen.n_envs,
        **chosen.settings(chosen.n_envs),
    }
    path = folder / "score.json"
    if path.exists():
        told = json.loads(path.read_bytes())
        settings |= {"bins heard": f"{told['steps']:,}", "training": f"{told['seconds']:,.0f} s"}
    return settings


_CODE = """```python
from agents import noisy_performance
{load}
print(noisy_performance(agent, task, patterns, seed={seed}).mean())
```
"""
_LOAD_NEURON = f"""from agents import load_checkpoint

saved = load_checkpoint("{NEURON}")
agent, task, patterns = saved.agent, saved.task, saved.patterns"""
_LOAD_POLICY = """from agents.rl import load

agent, task, patterns = load(".")"""
_PICKLED = """
The model holds pickled objects, which may run any program when they are opened: load it only if you
trust where it comes from.
"""


def _use(neuron: bool) -> str:
    """How to load and score it, in its folder."""
    load = _LOAD_NEURON if neuron else _LOAD_POLICY
    return _CODE.format(load=load, seed=EVALUATION_SEED) + ("" if neuron else _PICKLED)
