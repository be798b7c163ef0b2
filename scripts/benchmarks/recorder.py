"""What the suite's recorder costs: steps of watched environments beside bare ones.

`python scripts/benchmarks/recorder.py` prints the median over pairs that are timed one after the
other, in processor time. The target is 5 % at most.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # run by itself, from a checkout
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from gnm_env import Level, suite
from gnm_env.results import Recorder

PAIRS = 300
SINGLE, SIDE_BY_SIDE = 4_000, 400
"""Steps of one timing."""


def overhead(make: Callable[[], Any], walk: Callable[[Any], None]) -> tuple[float, float]:
    """Seconds of the bare environment, and the share by which the watched one is slower."""
    level = suite()["1class"]
    with tempfile.TemporaryDirectory() as folder:
        bare, watched = make(), Recorder(folder, level, 0, "benchmark").watch(make())
        for env in (bare, watched):
            env.reset(seed=0)
            walk(env)
        rows = []
        for pair in range(PAIRS):
            order = (bare, watched) if pair % 2 else (watched, bare)
            seconds = {id(env): _timed(walk, env) for env in order}
            rows.append((seconds[id(bare)], seconds[id(watched)]))
    times = np.array(rows)
    return float(np.median(times[:, 0])), float(np.median(times[:, 1] / times[:, 0])) - 1.0


def _timed(walk: Callable[[Any], None], env: Any) -> float:
    start = time.process_time()
    walk(env)
    return time.process_time() - start


def walk_single(env: Any) -> None:
    """Silent steps of one environment."""
    for _ in range(SINGLE):
        if env.step(0)[2]:
            env.reset()


def walk_many(env: Any) -> None:
    """Silent steps of many side by side."""
    silent = np.zeros(env.num_envs, np.int64)
    for _ in range(SIDE_BY_SIDE):
        env.step(silent)


def main() -> None:
    """Print a row per kind of environment."""
    level: Level = suite()["1class"]
    found = {"one": overhead(lambda: level.trial_env(0, disable_env_checker=True), walk_single)}
    steps = {"one": SINGLE}
    for n in (64, 1_024):
        found[f"{n:,}"] = overhead(lambda n=n: level.trial_envs(n, 0), walk_many)  # type: ignore[misc]
        steps[f"{n:,}"] = SIDE_BY_SIDE
    for name, (seconds, more) in found.items():
        print(f"{name:>6} environments: {1e6 * seconds / steps[name]:7.2f} µs a step, {more:+.1%}")


if __name__ == "__main__":
    main()
