"""SIGKILL at any moment of a saving: the file is the old or the new one, and nothing else is left.

python tests/campaign/kills.py --count 100
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
LONGEST = 0.03
"""Seconds after which a saver is killed at the latest; one saving takes a tenth of it."""


def campaign(count: int, seed: int) -> Counter[str]:
    """`count` kills in a process of its own, which forks savers without importing anything anew."""
    done = subprocess.run(
        [sys.executable, str(Path(__file__)), "--count", str(count), "--seed", str(seed)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return Counter(json.loads(done.stdout.splitlines()[-1]))


class Kind:
    """Something that is saved: how, and how to see which of the savings is there.

    Attributes:
        save: writes version k to a path.
        version: which version a file holds; raises ValueError if it is damaged.
    """

    def __init__(self, save: Callable[[Path, int], None], version: Callable[[Path], int]) -> None:
        self.save = save
        self.version = version


def kinds() -> dict[str, Kind]:
    """Checkpoints of each sort of agent with all that goes beside them, curves, and trials."""
    import numpy as np

    import agents
    import gnm_env
    from agents.network import BackPropagation, Network, NetworkAgent

    task = gnm_env.Task(n_inputs=50, n_classes=2)
    patterns = gnm_env.Patterns.draw(task, 0)
    single = agents.NeuronAgent(agents.GNM(), agents.AggregateLabel(), 50, weight_bounds=None)
    network = NetworkAgent(Network(hidden=5), BackPropagation(), 50)

    def of_agent(agent: Any) -> Kind:
        def save(path: Path, k: int) -> None:
            agent.weights = np.full(agent.weights.shape, float(k))
            agent.save(path, task=task, patterns=patterns, rng=np.random.default_rng(k))

        def version(path: Path) -> int:
            found = agents.load_checkpoint(path)
            (number,) = set(found.agent.weights.tolist())
            expected = np.random.default_rng(int(number)).bit_generator.state
            if found.rng is None or found.rng.bit_generator.state != expected:
                raise ValueError("weights and generator are of two savings")
            return int(number)

        return Kind(save, version)

    def save_curve(path: Path, k: int) -> None:
        history = agents.History()
        for _ in range(200):
            history.append(1, k, k)
        history.save(path)

    def curve_version(path: Path) -> int:
        rows = path.read_text().splitlines()
        if len(rows) != 201 or len({row.split(",")[2] for row in rows[1:]}) != 1:
            raise ValueError("torn")
        return int(float(rows[-1].split(",")[2]))

    found = {
        "neuron": of_agent(single),
        "network": of_agent(network),
        "curve": Kind(save_curve, curve_version),
    }
    if hasattr(gnm_env, "Trials"):
        raster = np.ones((30, 50), np.int8)

        def save_trials(path: Path, k: int) -> None:
            one = gnm_env.Trial.from_dense(raster, label=k)
            gnm_env.Trials([one] * 20).save(path)

        def trials_version(path: Path) -> int:
            (label,) = {trial.label for trial in gnm_env.Trials.load(path)}
            return int(label)

        found["trials"] = Kind(save_trials, trials_version)
    return found


def kill_once(kind: Kind, folder: Path, delay: float) -> str:
    """What is wrong after one kill; empty if nothing is."""
    path = folder / "saved"
    kind.save(path, 1)
    child = os.fork()
    if child == 0:
        try:
            for k in range(2, 10**9):
                kind.save(path, k)
        finally:
            os._exit(1)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if not os.WIFSIGNALED(status):
        return "the saver ended by itself"
    left = [p.name for p in folder.iterdir()]
    try:
        version = kind.version(path)
    except Exception as error:
        return f"{type(error).__name__}: {error}; {left}"
    kind.save(path, version + 1)
    if kind.version(path) != version + 1:
        return "the next saving did not take its place"
    names = [p.name for p in folder.iterdir()]
    return "" if names == ["saved"] else f"left behind: {names}"


def main() -> None:
    """Kill savers of each kind in turn, and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    counts: Counter[str] = Counter(tried=0, wrong=0)
    every = kinds()
    names = list(every)
    for k in range(options.count):
        name = names[k % len(names)]
        with tempfile.TemporaryDirectory() as folder:
            said = kill_once(every[name], Path(folder), rng.uniform(0.0, LONGEST))
        counts["tried"] += 1
        if said:
            counts["wrong"] += 1
            print(f"kill {k} of {name}: {said}", file=sys.stderr)
    print(json.dumps(counts))


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
    main()
