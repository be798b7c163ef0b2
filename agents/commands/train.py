"""Train a neuron on patterns hidden in noise from the aggregate label; score it, save it, draw it.

    gnm train
    gnm train --n-classes 2 --learner et --modulate --alpha 0.25 --trials 20000
    gnm train --neuron my_neuron.py:ALIF --learner my_rules:Mine

The output folder receives the agent (agent.npz), its learning curve (learning_curve.csv), a picture
(training.png) and the score (score.json), once training has come to its end; until then they are
in its subfolder "unfinished". Ctrl-C keeps what was learned so far.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents import History, load_checkpoint, plot, train, train_many
from agents.commands import fields
from agents.commands.ahead import compile_ahead
from agents.commands.output import Output
from agents.commands.scoring import report, score
from agents.commands.terminal import Parser, Stopped, at_least, share
from agents.experiments.models import default_rule, new_agent
from agents.experiments.progress import Progress
from agents.registry import find_model, find_rule, networks, neurons, rules
from gnm_env import Patterns, Task
from gnm_env.files import atomic_write

AGENT = "agent.npz"
_YOURS = "or your own as module:Class or file.py:Class"


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("--neuron", metavar="NAME", help=f"{', '.join(_models())}, {_YOURS} (default gnm)")
    add("--learner", metavar="NAME",
        help=f"{', '.join(rules())}, {_YOURS} (default all; bp for the network)")
    add("--time", choices=("discrete", "continuous"),
        help="time of the GNM: bins, or differential equations with the integral readout S: "
        "another name for --neuron continuous")
    add("--trials", type=at_least(1), default=60_000, metavar="N", help="(default 60000)")
    share(parser, "--seed", default=None, help="of the stream and of the initial weights "
          "(default 0)")
    share(parser, "--pattern-seed")
    add("--initial-weight", type=float, metavar="X",
        help="initial weights are uniform on 0 … X (default: the neuron's own)")
    add("--weight-bounds", nargs="+", metavar="X",
        help='lowest and highest weight, or "none" (default 0 1; none for the network)')
    add("--loop", choices=("compiled", "standard"), default="compiled",
        help="train in compiled code, or through the Gymnasium loop: same bits (default compiled)")
    add("--resume", type=Path, metavar="CHECKPOINT",
        help="go on from a saved agent, its task, its patterns and its place in the stream")
    add("--checkpoint-every", type=float, default=60.0, metavar="SECONDS",
        help="save the agent so often while it learns (default 60; 0: in every block of trials)")
    share(parser, "--import")
    share(parser, "--out", default=Path("runs/train"))
    fields.add_options(parser, {"the task": Task, **_groups(parser)})
    # fmt: on


def _models() -> dict[str, type]:
    return neurons() | networks()


def _groups(parser: Parser) -> dict[str, type]:
    """The classes of all neurons and rules, and of those that the command line names."""
    found = {f"--neuron {name}": cls for name, cls in _models().items()}
    found |= {f"--learner {name}": cls for name, cls in rules().items()}
    for option, find in (("--neuron", find_model), ("--learner", find_rule)):
        spec = parser.early(option)
        if spec and ":" in spec:
            found[f"{option} {spec}"] = find(spec)
    parser.set_defaults(models=found)
    return found


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Train, save, score and draw."""
    began = time.monotonic()
    agent, task, patterns, rng = resumed(options) if options.resume else new(options)
    output = Output(options.out, AGENT, options.resume)

    def save(history: History) -> None:
        agent.save(output.fresh / AGENT, task=task, patterns=patterns, rng=rng)
        history.save(output.fresh / "learning_curve.csv")

    history, stopped = learn((agent, task, patterns, rng), options, save)
    trials = int(history.trials[-1]) if len(history) else 0
    if trials:
        save(history)
    if stopped:
        raise _stopped(output, options, trials)
    result = score(agent, task, patterns) | {
        "trials": trials,
        "seconds": time.monotonic() - began,
        "checkpoint": str(options.out / AGENT),
        "picture": None,
        "stopped": False,
    }
    try:
        plot(agent, task, patterns, history).savefig(output.fresh / "training.png")
        result["picture"] = str(options.out / "training.png")
    except ImportError as error:
        print(f"no picture: {error}\n")
    with atomic_write(output.fresh / "score.json") as file:
        file.write(json.dumps(result, indent=2).encode())
    output.finish()
    print(report(result))
    print(f"\nin {options.out}: {', '.join(sorted(path.name for path in options.out.iterdir()))}")
    return result


def _stopped(output: Output, options: argparse.Namespace, trials: int) -> Stopped:
    """What to say, and to give to other programs, of a training that was stopped."""
    path = output.stop()
    result = {"stopped": True, "trials": trials, "checkpoint": str(path) if path else None}
    if path is None:
        return Stopped(f"nothing was learned yet, and {options.out} is as it was", result)
    beside = "" if path.parent == options.out else f" ({options.out / AGENT} is as it was)"
    return Stopped(
        f"kept what was learned in {trials:,} trials in {path}{beside}: go on with --resume {path}",
        result,
    )


# --- what is trained -----------------------------------------------------------------------------


def new(options: argparse.Namespace) -> tuple[Any, Task, Patterns, np.random.Generator]:
    """A new agent with its task, patterns and stream."""
    task = fields.made(Task, options)
    patterns = Patterns.draw(task, options.pattern_seed or 0)
    agent = agent_of(options, task)
    return agent, task, patterns, np.random.default_rng(options.seed or 0)


def agent_of(options: argparse.Namespace, task: Task) -> Any:
    """The agent that the options describe; ValueError if they do not go together."""
    classes = _chosen(options)
    others = {title: cls for title, cls in options.models.items() if cls is not Task}
    fields.refuse_foreign(options, classes, others)
    neuron, rule = (fields.made(cls, options) for cls in classes)
    bounds: dict[str, Any] = {}
    if options.weight_bounds is not None:
        bounds["weight_bounds"] = _bounds(options.weight_bounds)
    elif getattr(neuron, "readout", "V") == "D":
        bounds["weight_bounds"] = None  # D = αV must be able to reach the threshold
    return new_agent(
        neuron, rule, task.n_inputs, options.seed or 0, options.initial_weight, **bounds
    )


def _chosen(options: argparse.Namespace) -> tuple[type, type]:
    neuron = options.neuron or "gnm"
    if options.time == "continuous":
        if neuron not in ("gnm", "continuous"):
            raise ValueError(
                f"--time continuous does not go with --neuron {neuron}: "
                "only the GNM has differential equations here"
            )
        neuron = "continuous"
    cls = find_model(neuron)
    return cls, find_rule(options.learner or default_rule(cls))


def _bounds(words: Sequence[str]) -> tuple[float, float] | None:
    if list(words) == ["none"]:
        return None
    try:
        low, high = map(float, words)
    except ValueError:
        raise ValueError(
            f'--weight-bounds takes two numbers or "none", got {" ".join(words)}'
        ) from None
    return low, high


def resumed(options: argparse.Namespace) -> tuple[Any, Task, Patterns, np.random.Generator]:
    """Agent, task, patterns and generator of the checkpoint to go on from."""
    own = ("neuron", "learner", "time", "seed", "pattern_seed", "initial_weight", "weight_bounds")
    ignored = [name for name in own if getattr(options, name) is not None]
    ignored += fields.given(options, {"": Task, **options.models})
    if ignored:
        raise ValueError(
            f"--{ignored[0].replace('_', '-')} does not go with --resume, which goes on with the "
            "agent, the task and the stream that were saved: leave one of the two out"
        )
    saved = load_checkpoint(options.resume)
    if saved.task is None or saved.patterns is None or saved.rng is None:
        raise ValueError(
            f"{options.resume} was saved without its task, patterns and place in the stream: "
            "go on from a checkpoint that gnm train wrote"
        )
    return saved.agent, saved.task, saved.patterns, saved.rng


def learn(what: tuple[Any, Task, Patterns, Any], options: argparse.Namespace, save: Any) -> Any:
    """Train with a progress bar, and now and then `save(history)`.

    Returns the history, and whether training was stopped.
    """
    agent, task, patterns, rng = what
    history, saved = History(), time.monotonic()
    block = max(1, min(1_000, options.trials // 50))

    def told(done: int, so_far: History) -> None:
        nonlocal history, saved
        history = so_far if so_far.error_rate.ndim == 1 else so_far.of(0)
        progress.advance(done - progress.done, f"wrong {100 * history.error_rate[-1]:.1f} %")
        if time.monotonic() - saved >= options.checkpoint_every:
            save(history)
            saved = time.monotonic()

    with Progress("learning", options.trials, unit="trials") as progress:
        try:
            if options.loop == "standard":
                env = _environment(agent, task, patterns)
                train(agent, env, options.trials, rng, callback=told, block=block)
            else:
                compile_ahead(agent, task, patterns)
                train_many(
                    [agent], task, patterns, options.trials, rng, 1, callback=told, block=block
                )
        except KeyboardInterrupt:
            return history, True
    return history, False


def _environment(agent: Any, task: Task, patterns: Patterns) -> Any:
    import gymnasium as gym

    output = {}
    if getattr(agent, "graded", False):
        output = {"output": "graded", "max_output": agent.neuron.max_output}
    return gym.make("gnm/PatternTrial-v0", task=task, patterns=patterns, **output)
