"""Train a Stable-Baselines3 agent on the aggregate label alone; score it as the neurons are scored.

    gnm train-rl
    gnm train-rl --algo ppo-linear --n-classes 2 --feedback dense --steps 3000000
    gnm train-rl --resume runs/ppo-cost --steps 16000000
    tensorboard --logdir runs

The output folder receives SB3's model (model.zip), the best by periodic evaluation
(best_model.zip), the task with its patterns (task.json), the evaluations (evaluations.npz), the
score (score.json) and a TensorBoard log, all but the log once training has come to its end; until
then they are in its subfolder "unfinished". gnm evaluate takes the folder.

SB3's models hold pickled objects, which may run any program when they are opened: --resume opens
one that no run of yours wrote with --trust alone.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

import torch

from agents.commands import fields
from agents.commands.output import Output
from agents.commands.scoring import report, score
from agents.commands.terminal import EVALUATION_SEED, Parser, Stopped, at_least, share
from agents.rl import HYPERPARAMETERS, load, make_rl_agent, training_env
from agents.rl.callbacks import Evaluation
from agents.rl.checkpoint import (
    BEST,
    MODEL,
    Description,
    describe,
    described,
    load_model,
    save_model,
)
from agents.rl.hyperparameters import n_parameters
from agents.rl.trust import require_trust
from gnm_env import Patterns, Task
from gnm_env.files import atomic_write

EVALUATIONS = "evaluations.npz"
STEPS = {1: 2_000_000, 2: 8_000_000}
"""Bins to hear by default, for one class and for more."""


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("--algo", choices=tuple(HYPERPARAMETERS), help="(default ppo)")
    add("--feedback", choices=("cost", "dense"), help="(default cost)")
    add("--steps", type=at_least(1), metavar="N",
        help=f"bins to hear in all (default {STEPS[1]:,}, with more classes {STEPS[2]:,})")
    share(parser, "--seed", help="of the stream, the initial weights and exploration")
    share(parser, "--pattern-seed")
    add("--n-envs", type=at_least(1), metavar="N",
        help="environments side by side (default: as --algo has them)")
    add("--evaluations", type=at_least(0), default=5, metavar="N",
        help="evaluations on endless streams during training, and one at its end; 0 for none: "
        "the last agent is kept, not the best (default 5)")
    share(parser, "--runs", help="of the final score")
    add("--resume", type=Path, metavar="FOLDER",
        help="go on with a saved agent and its task, up to --steps, with a learning rate that "
        "falls anew; the folder is the output too")
    share(parser, "--trust")
    share(parser, "--out", help="(default runs/ALGO-FEEDBACK)")
    # fmt: on
    fields.add_options(parser, {"the task": Task})


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Train, save and score."""
    if options.resume and options.out:
        raise ValueError(
            "--out does not go with --resume: the agent stays in its folder; copy the folder first"
        )
    torch.set_num_threads(1)  # on networks this small, threads only get in each other's way
    about = wanted(options)
    folder = options.resume or options.out or default_folder(about)
    steps = options.steps or STEPS[min(about.task.n_classes, 2)]
    model = new_model(about, folder, options)
    require_rollout(model, steps)
    output = Output(folder, MODEL, options.resume and options.resume / MODEL)
    begin(output.fresh, about, options)
    model.tensorboard_log = str(folder / "tensorboard")

    heard = model.num_timesteps
    seconds, stopped = learn(model, about, output.fresh, steps, options)
    if model.num_timesteps > heard:
        save_model(output.fresh / MODEL, model)
    if stopped:
        raise _stopped(output, model.num_timesteps, steps)
    agent, task, patterns = load(output.fresh)
    result = score(agent, task, patterns, runs=options.runs) | {
        "algorithm": about.kind,
        "feedback": about.feedback,
        "n_classes": task.n_classes,
        "steps": model.num_timesteps,
        "steps_per_second": (model.num_timesteps - heard) / seconds,
        "seconds": seconds,
        "trainable_parameters": n_parameters(model),
        "checkpoint": str(folder),
        "stopped": False,
    }
    with atomic_write(output.fresh / "score.json") as file:
        file.write(json.dumps(result, indent=2).encode())
    # The best of earlier evaluations is not this agent.
    remove(folder, BEST, f"{BEST}.seal", EVALUATIONS)
    output.finish()
    print(report(result))
    print(
        f"\n{model.num_timesteps:,} bins heard; {seconds:,.0f} s of training, "
        f"{result['steps_per_second']:,.0f} bins/s; saved in {folder}"
    )
    return result


def begin(fresh: Path, about: Description, options: argparse.Namespace) -> None:
    """Put into the folder what training begins with."""
    if options.resume:
        kept = (BEST, EVALUATIONS) if options.evaluations else ()
        for path in (options.resume / name for name in (*kept, f"{BEST}.seal")):
            if path.exists():
                shutil.copyfile(path, fresh / path.name)
    describe(fresh, about)


def _stopped(output: Output, heard: int, steps: int) -> Stopped:
    """What to say, and to give to other programs, of a training that was stopped."""
    path = output.stop()
    place = path and path.parent
    result = {"stopped": True, "steps": heard, "checkpoint": place and str(place)}
    if place is None:
        return Stopped(f"nothing was learned yet, and {output.folder} is as it was", result)
    return Stopped(
        f"kept what was learned in {heard:,} bins in {place}: go on with --resume {place} "
        f"--steps {steps}",
        result,
    )


def remove(folder: Path, *names: str) -> None:
    """Remove what an earlier run left, where it did."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


def default_folder(about: Description) -> Path:
    """Where an agent goes if nobody says where."""
    classes = about.task.n_classes
    suffix = f"-{classes}-classes" if classes > 1 else ""
    return Path(f"runs/{about.kind}-{about.feedback}{suffix}")


def wanted(options: argparse.Namespace) -> Description:
    """What is to be trained on what: from the options, or from the folder to resume.

    Raises ValueError if the folder's agent has another task than the options ask for.
    """
    if options.resume:
        about = described(options.resume)
        refuse_contradictions(about, options)
        if about.kind == "dqn":
            raise ValueError(
                f"{options.resume} holds a DQN agent, which cannot go on: its replay buffer is not "
                "saved; train a new one with more --steps"
            )
        return about
    task, kind = fields.made(Task, options), options.algo or "ppo"
    patterns = Patterns.draw(task, options.pattern_seed or 0)
    return Description(
        kind, HYPERPARAMETERS[kind].observation, options.feedback or "cost", task, patterns
    )


def refuse_contradictions(about: Description, options: argparse.Namespace) -> None:
    """ValueError if an option was given that differs from what was saved."""
    saved = {"algo": about.kind, "feedback": about.feedback}
    saved |= {field.name: getattr(about.task, field.name) for field in fields_of(Task)}
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


def new_model(about: Description, folder: Path, options: argparse.Namespace) -> Any:
    """SB3's model with its environments: a fresh one, or the one in the folder to resume."""

    def envs(n_envs: int | None) -> Any:
        return training_env(
            about.task, about.patterns, about.kind, feedback=about.feedback, n_envs=n_envs
        )

    if not options.resume:
        return make_rl_agent(about.kind, envs(options.n_envs), options.seed)
    require_trust(options.trust, folder / MODEL, folder / BEST)
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
    model: Any, about: Description, folder: Path, steps: int, options: argparse.Namespace
) -> tuple[float, bool]:
    """Train up to `steps`. Returns seconds, without those of evaluations, and if it was stopped."""
    callback = None
    if options.evaluations:
        callback = Evaluation(
            folder, about.task, about.patterns, about.observation,
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
