"""Levels: tasks of fixed difficulty, each with ids of its own, fixed seeds and fixed streams.

    gnm/PatternTrial-2class-v0      to learn on
    gnm/PatternStream-2class-v0     to be scored on

A level is nothing but a `Task`: its ids are those of the environments with that task's fields as
keywords. `suite()` lists the levels and makes their environments.
"""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import register
from gymnasium.vector import VectorEnv

from gnm_env.checks import shown, whole
from gnm_env.rules import MAX_EPISODE_BINS, RUNS
from gnm_env.task import Patterns, Task

__all__ = ["LEVELS", "PATTERN_SEEDS", "TUNING_SEEDS", "Level", "Suite", "suite"]

VERSION = 0
"""Of all levels: the number at the end of their ids. A level that changes gets a new one."""

PATTERN_SEEDS = range(100, 110)
"""Pattern seeds that scores are reported on; the league's. Choose no setting on them."""

TUNING_SEEDS = range(100)
"""Pattern seeds that settings may be chosen on."""

KINDS = ("Trial", "Stream")
_ENTRY_POINTS = {
    "Trial": ("gnm_env.trial_task.env:PatternTrialEnv", "gnm_env.trial_task.vector"),
    "Stream": ("gnm_env.stream_task.env:PatternStreamEnv", "gnm_env.stream_task.vector"),
}


def evaluation_seed(classes: Any, pattern_seed: Any) -> Any:
    """Seed of evaluation run 0. Run k hears the stream of this seed + k; runs stay below 1000."""
    return 10_000_000 * classes + 1_000 * pattern_seed


@dataclass(frozen=True)
class Level:
    """One task of fixed difficulty.

    Attributes:
        name: as in its ids, say "2class".
        about: what is difficult, in one line.
        fields: those of its `Task` that are not the default.
    """

    name: str
    about: str
    fields: Mapping[str, Any]

    def __hash__(self) -> int:
        return hash(self.name)

    @functools.cached_property
    def task(self) -> Task:
        """What is heard and owed."""
        return Task(**self.fields)

    @property
    def trial_id(self) -> str:
        """Id of the environment to learn on."""
        return _id("Trial", self.name)

    @property
    def stream_id(self) -> str:
        """Id of the environment to be scored on."""
        return _id("Stream", self.name)

    def patterns(self, pattern_seed: int) -> Patterns:
        """The patterns of a seed: `PATTERN_SEEDS` to report, `TUNING_SEEDS` to try things out."""
        return Patterns.draw(self.task, pattern_seed)

    def evaluation_seed(self, pattern_seed: int) -> int:
        """Seed of the first stream of a score: run k hears that of this seed + k."""
        seed: int = evaluation_seed(self.task.n_classes, whole("pattern seed", pattern_seed, 0))
        return seed

    def trial_env(self, pattern_seed: int = 0, **arguments: Any) -> gym.Env[Any, Any]:
        """An environment to learn on; `arguments` are those of `gym.make`, say `feedback`."""
        return gym.make(self.trial_id, pattern_seed=pattern_seed, **arguments)

    def trial_envs(
        self, num_envs: int, pattern_seed: int = 0, **arguments: Any
    ) -> VectorEnv[Any, Any, Any]:
        """Many of them side by side: the native vector environment."""
        return gym.make_vec(
            self.trial_id,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            pattern_seed=pattern_seed,
            **arguments,
        )

    def stream_env(self, pattern_seed: int = 0, **arguments: Any) -> gym.Env[Any, Any]:
        """The endless stream, on which a score is the number of bins survived."""
        return gym.make(self.stream_id, pattern_seed=pattern_seed, **arguments)


def _id(kind: str, name: str) -> str:
    return f"gnm/Pattern{kind}-{name}-v{VERSION}"


LEVELS = (
    Level("1class", "one pattern, owed one spike: the task's defaults", {}),
    Level("2class", "two patterns, owed one and two spikes", {"n_classes": 2}),
    Level("3class", "three patterns, owed one to three spikes", {"n_classes": 3}),
    Level("4class", "four patterns, owed one to four spikes", {"n_classes": 4}),
    Level("sparse", "a pattern of 10 input spikes in place of 25", {"rate": 0.002}),
    Level("jitter", "each input spike of a presentation up to 2 bins off", {"jitter_bins": 2}),
    Level("deletion", "a fifth of a presentation's input spikes is missing", {"deletion": 0.2}),
    Level(
        "distractors",
        "one pattern owed a spike, two others owed none",
        {"n_classes": 3, "targets": (1, 0, 0)},
    ),
    Level(
        "crowded",
        "two patterns that often follow each other without a pause",
        {"n_classes": 2, "mean_occurrences": 4.0, "onset_probability": 0.04},
    ),
)
"""All levels; those of one to four classes are the league's."""


class Suite(Mapping[str, Level]):
    """The levels by name, in their order: `suite()["2class"]`, or by either id.

    Attributes:
        pattern_seeds: that scores are reported on.
        tuning_seeds: that settings may be chosen on.
        runs, cap: streams of a score, and most bins of each.
    """

    pattern_seeds = PATTERN_SEEDS
    tuning_seeds = TUNING_SEEDS
    runs = RUNS
    cap = MAX_EPISODE_BINS

    def __getitem__(self, name: str) -> Level:
        """The level of a name or an id; ValueError, with the nearest ones, if there is none."""
        for level in LEVELS:
            if name in (level.name, level.trial_id, level.stream_id):
                return level
        raise ValueError(_unknown(name))

    def __contains__(self, name: object) -> bool:
        return any(name in (level.name, level.trial_id, level.stream_id) for level in LEVELS)

    def __iter__(self) -> Iterator[str]:
        return (level.name for level in LEVELS)

    def __len__(self) -> int:
        return len(LEVELS)

    def __repr__(self) -> str:
        return f"Suite({', '.join(self)})"


def _unknown(name: Any) -> str:
    ids = [name for level in LEVELS for name in (level.name, level.trial_id, level.stream_id)]
    near = difflib.get_close_matches(name, ids, n=3) if isinstance(name, str) else []
    hint = f"near it are {', '.join(map(repr, near))}; " if near else ""
    names = ", ".join(level.name for level in LEVELS)
    return f"there is no level {shown(name)}: {hint}the levels are {names}"


_SUITE = Suite()


def suite() -> Suite:
    """All levels, with the seeds that scores are reported on."""
    return _SUITE


def register_levels() -> None:
    """Register the ids of every level; `import gnm_env` does so."""
    for level in LEVELS:
        for kind in KINDS:
            env, vector = _ENTRY_POINTS[kind]
            register(
                _id(kind, level.name),
                entry_point=env,
                vector_entry_point=f"{vector}:Pattern{kind}VectorEnv",
                max_episode_steps=MAX_EPISODE_BINS if kind == "Stream" else None,
                kwargs=dict(level.fields),
            )
