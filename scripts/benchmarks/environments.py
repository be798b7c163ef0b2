"""Steps per second of the environments, alone and many at once.

`python scripts/benchmarks/environments.py` prints both tables; `scripts/benchmark.py` has them too.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # run by itself: what the scripts share lies one folder up
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

import gnm_env  # noqa: F401  registers the environments
from benchmarks.rows import Findings, Target, rate_rows
from benchmarks.timing import Settings, Subject, race

UNIT = "million steps/s"
COPIES = 1_024
TRIAL_BINS = 200
"""Mean length of a trial."""
TRIAL, STREAM = "gnm/PatternTrial-v0", "gnm/PatternStream-v0"


class Rows(gym.Env[NDArray[np.int8], Any]):
    """Does nothing but return the rows of a ready-made array: what the wrappers alone cost."""

    def __init__(self, length: int) -> None:
        self.observation_space = spaces.Box(0, 1, (100,), np.int8)
        self.action_space: spaces.Space[Any] = spaces.Discrete(2)
        rng = np.random.default_rng(0)
        self._rows = (rng.random((length + 1, 100)) < 0.005).astype(np.int8)
        self._length = length
        self._t = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int8], dict[str, Any]]:
        super().reset(seed=seed)
        self._t = 0
        return self._rows[0], {}

    def step(self, action: Any) -> tuple[NDArray[np.int8], float, bool, bool, dict[str, Any]]:
        self._t += 1
        return self._rows[self._t], 0.0, self._t == self._length, False, {}


# Episodes as long as those of the environments beside them: a trial, and a silent neuron's stream.
ROWS: Any = Rows
gym.register("benchmarks/TrialRows-v0", entry_point=ROWS, kwargs={"length": 200})
gym.register(
    "benchmarks/StreamRows-v0", entry_point=ROWS, kwargs={"length": 148}, max_episode_steps=10_000
)


def single(settings: Settings) -> Findings:
    """Steps of one environment through `gymnasium.make`, by a loop that sends plain ints."""
    steps = 20_000 if settings.quick else 100_000
    pairs = (("benchmarks/TrialRows-v0", TRIAL), ("benchmarks/StreamRows-v0", STREAM))
    names = {
        pairs[0][0]: "rows, 200 a trial", TRIAL: TRIAL, pairs[1][0]: "rows, 148 an episode",
        STREAM: STREAM, "CartPole-v1": "CartPole-v1",
    }  # fmt: skip
    subjects = [_single(name, gym.make(id), steps) for id, name in names.items()]
    timings = race(subjects, settings)
    section, found = "One environment", Findings()
    for bare, ours in pairs:
        pair = {names[id]: timings[names[id]] for id in (bare, ours)}
        targets = {ours: [Target(0.5, of="ratio")]}
        notes = {names[bare]: "does nothing; through the same wrappers"}
        found.rows += rate_rows(
            section, pair, UNIT, against=names[bare], targets=targets, notes=notes
        )
    found.rows += rate_rows(section, {"CartPole-v1": timings["CartPole-v1"]}, UNIT)
    return found


def _single(name: str, env: gym.Env[Any, Any], steps: int) -> Subject:
    def run(_: Any) -> None:
        step, reset = env.step, env.reset
        for _ in range(steps):
            _, _, terminated, truncated, _ = step(0)
            if terminated or truncated:
                reset()

    env.reset(seed=0)
    return Subject(name, run, steps)


def vector(settings: Settings) -> Findings:
    """Steps of 1,024 copies at once, beside Gymnasium's own native vector environment.

    Trials begin and end at different times, as they do once the environments have run for long.
    """
    steps = 500 if settings.quick else 3_000
    pole = "CartPole-v1"
    subjects = [_many(pole, _made(pole), steps, random=True)]
    for copy in (True, False):
        how = "" if copy else ", copy=False"
        subjects.append(_many(f"{TRIAL}{how}", staggered(_made(TRIAL, copy=copy)), steps))
        streams = _made(STREAM, copy=copy)
        subjects.append(_many(f"{STREAM}{how}, never answering", streams, steps))
        streams = _made(STREAM, copy=copy)
        subjects.append(_many(f"{STREAM}{how}, random answers", streams, steps, random=True))
    loop = _made(TRIAL, mode="sync")
    subjects.append(_many(f"{TRIAL}, SyncVectorEnv", loop, steps // 50))
    targets = {TRIAL: [Target(1.5, of="ratio")], f"{TRIAL}, copy=False": [Target(3.0, of="ratio")]}
    notes = {pole: "Gymnasium's own native vector environment"}
    section, timings = f"{COPIES:,} environments at once", race(subjects, settings)
    rows = rate_rows(section, timings, UNIT, against=pole, targets=targets, notes=notes)
    return Findings(rows=rows)


def _made(
    id: str, mode: str = "vector_entry_point", **kwargs: Any
) -> gym.vector.VectorEnv[Any, Any, Any]:
    envs = gym.make_vec(id, num_envs=COPIES, vectorization_mode=mode, **kwargs)
    envs.reset(seed=0)
    return envs


def staggered(envs: gym.vector.VectorEnv[Any, Any, Any]) -> gym.vector.VectorEnv[Any, Any, Any]:
    """Reset so that in each step about as many trials end as in any other.

    All reset at once, they would go on ending in the same few steps for some ten thousand.
    """
    number = np.arange(envs.num_envs)
    envs.reset(seed=0)
    for t in range(TRIAL_BINS):
        envs.step(np.zeros(envs.num_envs, np.int64))
        if (number % TRIAL_BINS == t).any():
            envs.reset(options={"reset_mask": number % TRIAL_BINS == t})
    return envs


def _many(
    name: str, envs: gym.vector.VectorEnv[Any, Any, Any], steps: int, random: bool = False
) -> Subject:
    rng = np.random.default_rng(0)
    actions = rng.integers(0, 2, (16, COPIES)) if random else np.zeros((16, COPIES), np.int64)
    rows = list(actions)

    def run(_: Any) -> None:
        for t in range(steps):
            envs.step(rows[t & 15])

    return Subject(name, run, COPIES * steps)


def main() -> None:
    from benchmarks.cores import Cores
    from benchmarks.report import table

    settings = Settings(repeats=7, quick=False, full=False, seed=0, cores=Cores())
    found = single(settings)
    found.add(vector(settings))
    print(table(found))


if __name__ == "__main__":
    main()
