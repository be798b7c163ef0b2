"""A saved RL agent: SB3's own zip beside what it was trained on, in one folder.

    model.zip         SB3's model as it stands; `PPO.load` and `learn` go on from it
    best_model.zip    the best by periodic evaluation, if there was one
    task.json         kind of agent, observation config, task, feedback and patterns

SB3's zip holds pickled objects, which may run any program when they are opened: `load` only what
you trust. The seal beside each (see `agents.rl.trust`) tells the command line which are your own.
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.rl import trust
from agents.rl.hyperparameters import HYPERPARAMETERS
from agents.rl.observation import TRACE_SCALE, ObservationConfig
from agents.rl.sb3_agent import SB3Agent
from gnm_env.checks import choice
from gnm_env.files import atomic_write, path_of
from gnm_env.task import Patterns, Task

FORMAT = 2
"""Format 1 called the observation config "senses"; it is still read."""
DESCRIPTION, MODEL, BEST = "task.json", "model.zip", "best_model.zip"


@dataclass(frozen=True)
class Description:
    """What a folder says about its agent."""

    kind: str
    observation: ObservationConfig
    feedback: str
    task: Task
    patterns: Patterns


def describe(folder: str | os.PathLike[str], description: Description) -> None:
    """Write task.json, whole or not at all. ValueError if the folder cannot be written."""
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f"cannot make the folder {place}: {error.strerror}; choose another"
        ) from None
    contents = {
        "format": FORMAT,
        "kind": description.kind,
        "observation": asdict(description.observation),
        "feedback": description.feedback,
        "task": asdict(description.task),
        "patterns": np.argwhere(description.patterns.dense()).tolist(),
    }
    with atomic_write(place / DESCRIPTION) as file:
        file.write(json.dumps(contents).encode())


def described(folder: str | os.PathLike[str]) -> Description:
    """What task.json says; ValueError if it is missing or damaged."""
    path = path_of(folder, "read") / DESCRIPTION
    try:
        contents = json.loads(path.read_bytes())
        if contents["format"] not in (1, FORMAT):
            raise ValueError(f"format {contents['format']}, this version reads 1 and {FORMAT}")
        task = Task(**contents["task"])
        bits = np.zeros((task.n_classes, task.pattern_bins, task.n_inputs), np.bool_)
        bits[tuple(np.array(contents["patterns"], np.int64).reshape(-1, 3).T)] = True
        return Description(
            choice("kind", contents["kind"], tuple(HYPERPARAMETERS)),
            _observation(contents),
            contents["feedback"],
            task,
            Patterns.from_dense(bits),
        )
    except FileNotFoundError:
        raise ValueError(
            f"{folder} holds no RL agent, it has no {DESCRIPTION}; "
            "give the folder that scripts/train_rl.py or agents.rl.save wrote"
        ) from None
    except (KeyError, TypeError, ValueError, IndexError, OSError, RecursionError) as error:
        raise ValueError(
            f"{path} is not readable ({type(error).__name__}: {error}); train and save again"
        ) from None


def _observation(contents: dict[str, Any]) -> ObservationConfig:
    """The observation config of task.json, of either format."""
    if contents["format"] == FORMAT:
        return ObservationConfig.of(contents["observation"])
    former = contents["senses"]
    scale = former["scale"] if former["decays"] else TRACE_SCALE  # raw bits have none
    return ObservationConfig.of({**former, "scale": scale})


def save_model(path: str | os.PathLike[str], model: BaseAlgorithm) -> None:
    """SB3's `model.save`, whole or not at all, and sealed as this user's own."""
    contents = io.BytesIO()
    model.save(contents)
    with atomic_write(path) as file:
        file.write(contents.getvalue())
    trust.seal(path)


def save(
    folder: str | os.PathLike[str],
    model: BaseAlgorithm,
    kind: str,
    task: Task,
    patterns: Patterns,
    *,
    feedback: str = "cost",
    observation: ObservationConfig | None = None,
) -> None:
    """Save a model with all that is needed to score it or to go on. `load` reads it.

    `observation`: what the model was trained on; None: what it says itself, or else that of its
    kind. Raises ValueError if the folder cannot be written, the model is not of this kind, or it
    was trained on other observations.
    """
    chosen = HYPERPARAMETERS[choice("kind", kind, tuple(HYPERPARAMETERS))]
    if not isinstance(model, chosen.algorithm):
        raise ValueError(
            f"{kind} is a {chosen.algorithm.__name__}, and the model is a {type(model).__name__}; "
            "keep a model of your own with its own save"
        )
    if observation is None and not hasattr(model, "observation_config"):
        observation = chosen.observation
    agent = SB3Agent(model, task, observation)  # refuses what does not belong together
    describe(folder, Description(kind, agent.observation, feedback, task, patterns))
    save_model(Path(folder) / MODEL, model)


def load(folder: str | os.PathLike[str]) -> tuple[SB3Agent, Task, Patterns]:
    """The best agent of a folder, ready to be scored, with its task and patterns.

    That is best_model.zip where there is one, else model.zip: pickled objects, so load only what
    you trust. Raises ValueError if a file is missing or damaged, or if they do not belong together:
    a model that was trained on other observations than task.json says is refused.
    """
    place = path_of(folder, "read")
    about = described(place)
    model = load_model(place / BEST if (place / BEST).exists() else place / MODEL, about.kind)
    return SB3Agent(model, about.task, about.observation), about.task, about.patterns


def load_model(path: str | os.PathLike[str], kind: str, **arguments: Any) -> BaseAlgorithm:
    """The SB3 model in a zip; ValueError if it is missing, damaged or of another algorithm."""
    algorithm = HYPERPARAMETERS[kind].algorithm
    try:
        model: BaseAlgorithm = algorithm.load(os.fspath(path), device="cpu", **arguments)
    except FileNotFoundError:
        raise ValueError(f"there is no model {path}; train and save again") from None
    except Exception as error:  # a zip of anything else fails in any way
        raise ValueError(
            f"{path} is not a readable {algorithm.__name__} model "
            f"({type(error).__name__}: {error}); train and save again"
        ) from None
    return model
