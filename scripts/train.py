"""Train a neuron on patterns hidden in noise from the aggregate label; score it, save it, draw it.

    python scripts/train.py
    python scripts/train.py --n-classes 2 --learner et --modulate --alpha 0.25 --trials 20000

The output folder receives the neuron (agent.npz), its learning curve (learning_curve.csv), a
picture (training.png) and the score (score.json).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

import commandline
from agents import (
    GNM,
    LIF,
    MST,
    AggregateLabel,
    ErrorTrace,
    History,
    NeuronAgent,
    load_checkpoint,
    train,
    train_many,
)
from agents.checkpoint import atomic_write
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.network import BackPropagation, Network, NetworkAgent
from gnm_env import Patterns, Task
from options import add_options, made, refuse_foreign
from scoring import report, score

NEURONS = {"gnm": GNM, "lif": LIF, "mst": MST, "network": Network}
LEARNERS = {"all": AggregateLabel, "et": ErrorTrace, "bp": BackPropagation}
GROUPS: dict[str, type] = {
    "the task": Task,
    "--neuron gnm": GNM,
    "--neuron lif": LIF,
    "--neuron mst": MST,
    "--time continuous": ContinuousGNM,
    "--neuron network": Network,
    "--learner all": AggregateLabel,
    "--learner et": ErrorTrace,
    "--learner bp": BackPropagation,
}


def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--neuron", choices=NEURONS, default="gnm", help="(default gnm)")
    parser.add_argument(
        "--learner", choices=LEARNERS, help="(default all; bp for the network, which needs it)"
    )
    parser.add_argument(
        "--time", choices=("discrete", "continuous"), default="discrete",
        help="time of the GNM: bins, or differential equations with the integral readout S",
    )  # fmt: skip
    parser.add_argument("--trials", type=int, default=60_000, metavar="N", help="(default 60000)")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N",
        help="of the stream and of the initial weights (default 0)",
    )  # fmt: skip
    parser.add_argument(
        "--pattern-seed", type=int, default=0, metavar="N", help="of the patterns (default 0)"
    )
    parser.add_argument(
        "--initial-weight", type=float, metavar="X",
        help="initial weights are uniform on 0 … X (default: the neuron's own)",
    )  # fmt: skip
    parser.add_argument(
        "--weight-bounds", nargs="+", default=None, metavar="X",
        help='lowest and highest weight, or "none" (default 0 1; none for the network)',
    )  # fmt: skip
    parser.add_argument(
        "--loop", choices=("compiled", "standard"), default="compiled",
        help="train in compiled code, or through the Gymnasium loop: same bits (default compiled)",
    )  # fmt: skip
    parser.add_argument(
        "--resume", type=Path, metavar="CHECKPOINT",
        help="go on from a saved agent, its task, its patterns and its place in the stream",
    )  # fmt: skip
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("runs/train"),
        metavar="FOLDER",
        help="(default runs/train)",
    )
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    add_options(parser, GROUPS)
    return parser


def chosen_classes(options: argparse.Namespace) -> tuple[type, type]:
    """The neuron's and the rule's class; ValueError with the reason if they do not go together."""
    if options.learner is None:
        options.learner = "bp" if options.neuron == "network" else "all"
    if (options.neuron == "network") != (options.learner == "bp"):
        raise ValueError(
            f"--neuron {options.neuron} does not go with --learner {options.learner}: "
            "backpropagation needs the network's hidden layer, and only it can train that layer"
        )
    if options.time == "continuous":
        if options.neuron != "gnm":
            raise ValueError(
                f"--time continuous does not go with --neuron {options.neuron}: "
                "only the GNM has differential equations here"
            )
        return ContinuousGNM, LEARNERS[options.learner]
    return NEURONS[options.neuron], LEARNERS[options.learner]


def new_agent(options: argparse.Namespace, task: Task) -> Any:
    """The agent that the options describe."""
    neuron_class, rule_class = chosen_classes(options)
    groups = {title: cls for title, cls in GROUPS.items() if cls is not Task}
    refuse_foreign(options, (neuron_class, rule_class), groups)
    neuron, rule = made(neuron_class, options), made(rule_class, options)
    extra: dict[str, Any] = {"n_inputs": task.n_inputs, "seed": options.seed}
    if options.initial_weight is not None:
        extra["initial_weight"] = options.initial_weight
    if options.neuron == "network":
        if options.weight_bounds is not None:
            raise ValueError("--weight-bounds does not go with --neuron network: it has none")
        return NetworkAgent(neuron, rule, **extra)
    if options.weight_bounds is not None:
        extra["weight_bounds"] = _bounds(options.weight_bounds)
    elif getattr(neuron, "readout", "V") == "D":
        extra["weight_bounds"] = None  # D = αV must be able to reach the threshold
    agent_class = ContinuousAgent if options.time == "continuous" else NeuronAgent
    return agent_class(neuron, rule, **extra)


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


def resumed(options: argparse.Namespace) -> tuple[Any, Task, Patterns, Any]:
    """Agent, task, patterns and generator of the checkpoint to go on from."""
    saved = load_checkpoint(options.resume)
    if saved.task is None or saved.patterns is None or saved.rng is None:
        raise ValueError(
            f"{options.resume} was saved without its task, patterns and place in the stream; "
            "go on from a checkpoint that scripts/train.py wrote"
        )
    return saved.agent, saved.task, saved.patterns, saved.rng


def main(options: argparse.Namespace) -> dict[str, Any]:
    began = time.monotonic()
    if options.resume:
        agent, task, patterns, rng = resumed(options)
    else:
        task = made(Task, options)
        patterns = Patterns.draw(task, options.pattern_seed)
        agent = new_agent(options, task)
        if options.seed < 0:
            raise ValueError(f"--seed must be >= 0, got {options.seed}")
        rng = np.random.default_rng(options.seed)
    if options.trials < 1:
        raise ValueError(f"--trials must be >= 1, got {options.trials}")
    checkpoint = options.out / "agent.npz"
    _make_folder(options.out)
    agent.save(checkpoint, task=task, patterns=patterns, rng=rng)  # a bad folder shows at once

    history, stopped = run_training(agent, task, patterns, rng, options)
    agent.save(checkpoint, task=task, patterns=patterns, rng=rng)
    history.save(options.out / "learning_curve.csv")
    result = score(agent, task, patterns)
    result |= {
        "trials": int(history.trials[-1]) if len(history) else 0,
        "seconds": time.monotonic() - began,
        "checkpoint": str(checkpoint),
        "picture": str(draw(agent, task, patterns, history, options)),
        "stopped": stopped,
    }
    with atomic_write(options.out / "score.json") as file:
        file.write(json.dumps(result, indent=2).encode())
    print(report(result))
    print(f"\nsaved {checkpoint}, learning_curve.csv, score.json; picture {result['picture']}")
    if stopped:
        print(f"stopped after {result['trials']:,} trials; go on with --resume {checkpoint}")
    return result


def run_training(
    agent: Any, task: Task, patterns: Patterns, rng: Any, options: argparse.Namespace
) -> tuple[History, bool]:
    """Train with a progress bar. True if it was interrupted; what was learned so far is kept."""
    history = History()
    bar = tqdm(
        total=options.trials, unit="trial", unit_scale=True, disable=not sys.stderr.isatty(),
        desc="learning",
    )  # fmt: skip

    def progress(done: int, so_far: History) -> None:
        nonlocal history
        history = so_far if so_far.error_rate.ndim == 1 else so_far.of(0)
        bar.update(done - bar.n)
        bar.set_postfix_str(f"wrong {100 * history.error_rate[-1]:.1f} %")

    block = max(1, min(1_000, options.trials // 50))
    try:
        with bar:
            if options.loop == "standard":
                train(
                    agent, _environment(agent, task, patterns), options.trials, rng,
                    callback=progress, block=block,
                )  # fmt: skip
            else:
                train_many(
                    [agent], task, patterns, options.trials, rng, threads=1,
                    callback=progress, block=block,
                )  # fmt: skip
    except KeyboardInterrupt:
        return history, True
    return history, False


def _environment(agent: Any, task: Task, patterns: Patterns) -> Any:
    import gymnasium as gym

    graded = isinstance(agent, ContinuousAgent)
    output = {"output": "graded", "max_output": agent.neuron.max_output} if graded else {}
    return gym.make("gnm/PatternTrial-v0", task=task, patterns=patterns, **output)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f"cannot make the output folder {folder}: {error.strerror}; choose another with --out"
        ) from None


def draw(
    agent: Any, task: Task, patterns: Patterns, history: History, options: argparse.Namespace
) -> Path:
    from pictures import save, training_picture

    return save(training_picture(agent, task, patterns, history), options.out / "training.png")


if __name__ == "__main__":
    arguments = parser().parse_args()
    commandline.run(lambda: main(arguments), as_json=arguments.json, name="train.py")
