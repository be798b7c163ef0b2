"""Train a Stable-Baselines3 agent on the aggregate label alone; score it as the neurons are scored.

    python scripts/train_rl.py
    python scripts/train_rl.py --algo ppo-linear --n-classes 2 --feedback dense --steps 3000000
    python scripts/train_rl.py --resume runs/ppo-cost --steps 16000000
    tensorboard --logdir runs

The output folder receives SB3's model (model.zip), the best by periodic evaluation
(best_model.zip), the task with its patterns (task.json), the evaluations (evaluations.npz), a
TensorBoard log and the score (score.json). scripts/evaluate.py takes the folder.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import commandline
from agents.checkpoint import atomic_write
from gnm_env import Patterns, Task
from options import add_options, made
from scoring import EVALUATION_SEED, report, score

ALGORITHMS = ("ppo", "ppo-linear", "recurrent-ppo", "dqn")
FEEDBACK = ("cost", "dense")
EVALUATIONS = "evaluations.npz"
STEPS = {1: 2_000_000, 2: 8_000_000}
"""Bins to hear by default, for one class and for more."""


def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--algo", choices=ALGORITHMS, help="(default ppo)")
    parser.add_argument("--feedback", choices=FEEDBACK, help="(default cost)")
    parser.add_argument(
        "--steps", type=int, metavar="N",
        help=f"bins to hear in all (default {STEPS[1]:,}, with more classes {STEPS[2]:,})",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N",
        help="of the stream, the initial weights and exploration (default 0)",
    )  # fmt: skip
    parser.add_argument("--pattern-seed", type=int, metavar="N", help="of the patterns (default 0)")
    parser.add_argument(
        "--n-envs", type=int, metavar="N", help="environments side by side (default: the recipe's)"
    )
    parser.add_argument(
        "--evaluations", type=int, default=5, metavar="N",
        help="evaluations on endless streams during training, and one at its end; 0 for none: "
        "the last agent is kept, not the best (default 5)",
    )  # fmt: skip
    parser.add_argument(
        "--runs", type=int, default=100, metavar="N", help="of the final score (default 100)"
    )
    parser.add_argument(
        "--resume", type=Path, metavar="FOLDER",
        help="go on with a saved agent and its task, up to --steps, with a learning rate that "
        "falls anew; the folder is the output too",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="(default runs/ALGO-FEEDBACK)")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    add_options(parser, {"the task": Task})
    return parser


def main(options: argparse.Namespace) -> dict[str, Any]:
    check(options)
    from agents.rl import load
    from agents.rl.folder import BEST, MODEL, describe, save_model
    from agents.rl.recipes import n_parameters

    import torch  # isort: skip  # after agents.rl, which says what to install if it is missing

    torch.set_num_threads(1)  # on networks this small, threads only get in each other's way
    about = wanted(options)
    folder = options.resume or options.out or default_folder(about)
    steps = options.steps or STEPS[min(about.task.n_classes, 2)]
    model = new_model(about, folder, options)
    require_rollout(model, steps)
    model.tensorboard_log = str(folder / "tensorboard")
    if not options.resume:
        describe(folder, about)  # a bad folder shows at once
        remove(folder, MODEL, BEST, EVALUATIONS)

    heard = model.num_timesteps
    seconds, stopped = learn(model, about, folder, steps, options)
    save_model(folder / MODEL, model)
    if not options.evaluations:  # the best of earlier evaluations is not this agent
        remove(folder, BEST, EVALUATIONS)
    agent, task, patterns = load(folder)
    result = score(agent, task, patterns, runs=options.runs)
    result |= {
        "algorithm": about.kind,
        "feedback": about.feedback,
        "n_classes": task.n_classes,
        "steps": model.num_timesteps,
        "steps_per_second": (model.num_timesteps - heard) / seconds,
        "seconds": seconds,
        "trainable_parameters": n_parameters(model),
        "checkpoint": str(folder),
        "stopped": stopped,
    }
    with atomic_write(folder / "score.json") as file:
        file.write(json.dumps(result, indent=2).encode())
    print(report(result))
    print(
        f"\n{model.num_timesteps:,} bins heard; {seconds:,.0f} s of training, "
        f"{result['steps_per_second']:,.0f} bins/s; saved in {folder}"
    )
    if stopped:
        print(f"stopped early; go on with --resume {folder} --steps {steps}")
    return result


def remove(folder: Path, *names: str) -> None:
    """Remove what an earlier run left, where it did."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


def default_folder(about: Any) -> Path:
    """Where an agent goes if nobody says where."""
    classes = about.task.n_classes
    suffix = f"-{classes}-classes" if classes > 1 else ""
    return Path(f"runs/{about.kind}-{about.feedback}{suffix}")


def check(options: argparse.Namespace) -> None:
    """ValueError where a number is out of range; the others are checked where they are used."""
    for name, low in (("steps", 1), ("seed", 0), ("n_envs", 1), ("evaluations", 0), ("runs", 1)):
        value = getattr(options, name)
        if value is not None and value < low:
            raise ValueError(f"--{name.replace('_', '-')} must be >= {low}, got {value}")
    if options.resume and options.out:
        raise ValueError(
            "--out does not go with --resume: the agent stays in its folder; copy the folder first"
        )


def wanted(options: argparse.Namespace) -> Any:
    """What is to be trained on what: from the options, or from the folder to resume.

    Raises ValueError if the folder's agent has another task than the options ask for.
    """
    from agents.rl import RECIPES
    from agents.rl.folder import Description, described

    if options.resume:
        about = described(options.resume)
        refuse_contradictions(about, options)
        if about.kind == "dqn":
            raise ValueError(
                f"{options.resume} holds a DQN agent, which cannot go on: its replay buffer is not "
                "saved; train a new one with more --steps"
            )
        return about
    task, kind = made(Task, options), options.algo or "ppo"
    patterns = Patterns.draw(task, options.pattern_seed or 0)
    return Description(kind, RECIPES[kind].senses, options.feedback or "cost", task, patterns)


def refuse_contradictions(about: Any, options: argparse.Namespace) -> None:
    """ValueError if an option was given that differs from what was saved."""
    from dataclasses import fields

    saved = {"algo": about.kind, "feedback": about.feedback}
    saved |= {field.name: getattr(about.task, field.name) for field in fields(Task)}
    for name, there in saved.items():
        here = getattr(options, name)
        if here is not None and (tuple(here) if name == "targets" else here) != there:
            raise ValueError(
                f"{options.resume} holds an agent of another task: {name} is {there!r} there and "
                f"{here!r} here; leave --{name.replace('_', '-')} out, or train a new agent"
            )
    seed = options.pattern_seed
    if seed is not None and about.patterns != Patterns.draw(about.task, seed):
        raise ValueError(
            f"{options.resume} holds an agent of other patterns than those of --pattern-seed "
            f"{seed}; leave the option out, or train a new agent"
        )


def new_model(about: Any, folder: Path, options: argparse.Namespace) -> Any:
    """SB3's model with its environments: a fresh one, or the one in the folder to resume."""
    from agents.rl import make_rl_agent, training_env
    from agents.rl.folder import MODEL, load_model

    def envs(n_envs: int | None) -> Any:
        return training_env(
            about.task, about.patterns, about.kind, feedback=about.feedback, n_envs=n_envs
        )

    if not options.resume:
        return make_rl_agent(about.kind, envs(options.n_envs), options.seed)
    model = load_model(folder / MODEL, about.kind)
    if options.n_envs not in (None, model.n_envs):
        raise ValueError(
            f"{options.resume} was trained in {model.n_envs} environments side by side, which its "
            f"rollouts go by, not in {options.n_envs}; leave --n-envs out"
        )
    model.set_env(envs(model.n_envs))
    # Neither the trials that it has heard already nor the same exploration again.
    model.set_random_seed(options.seed + model.num_timesteps)
    return model


def require_rollout(model: Any, steps: int) -> None:
    """ValueError if `steps` leaves no more than the model hears before it first learns."""
    buffered = hasattr(model, "learning_starts")
    rollout = model.learning_starts if buffered else model.n_envs * model.n_steps
    if steps - model.num_timesteps <= rollout:
        done = f" of which {model.num_timesteps:,} are done" if model.num_timesteps else ""
        raise ValueError(
            f"--steps must leave room for more than one rollout of {rollout:,} bins, at the end of "
            f"which the learning rate is 0, got {steps:,}{done}"
        )


def learn(
    model: Any, about: Any, folder: Path, steps: int, options: argparse.Namespace
) -> tuple[float, bool]:
    """Train up to `steps`. Returns seconds, without those of evaluations, and if it was stopped."""
    from agents.rl.callbacks import Evaluation

    callback = None
    if options.evaluations:
        callback = Evaluation(
            folder, about.task, about.patterns, about.senses,
            every=(steps - model.num_timesteps) // options.evaluations // model.n_envs,
            seed=EVALUATION_SEED + options.runs,
        )  # fmt: skip
        callback.go_on()
    start, stopped = time.monotonic(), False
    try:
        model.learn(
            steps - model.num_timesteps,
            callback=callback,
            reset_num_timesteps=not options.resume,
            tb_log_name=about.kind,
            progress_bar=sys.stderr.isatty(),
        )
    except KeyboardInterrupt:
        stopped = True
    return time.monotonic() - start - (callback.seconds if callback else 0.0), stopped


if __name__ == "__main__":
    arguments = parser().parse_args()
    commandline.run(lambda: main(arguments), as_json=arguments.json, name="train_rl.py")
