"""One changed byte anywhere in a file: it is refused with a sentence, or nothing has changed.

python tests/campaign/flips.py --checkpoints 300 --trials 200
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
MEMORY = 6 * 2**30


def campaign(checkpoints: int, trials: int, seed: int) -> Counter[str]:
    """So many changed bytes, in a process of its own that may be given to crashing."""
    done = subprocess.run(
        [
            *(sys.executable, str(Path(__file__)), "--seed", str(seed)),
            *("--checkpoints", str(checkpoints), "--trials", str(trials)),
        ],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    if done.returncode:
        print(f"the process ended with {done.returncode}")
        return Counter(tried=checkpoints + trials, wrong=1)
    return Counter(json.loads(done.stdout.splitlines()[-1]))


def checkpoint_files(folder: Path) -> list[Path]:
    """One checkpoint of each kind of agent, with and without what goes beside it."""
    import numpy as np

    import agents
    import gnm_env
    from agents.continuous import ContinuousAgent, ContinuousGNM
    from agents.network import BackPropagation, Network, NetworkAgent

    task = gnm_env.Task(n_inputs=6, n_classes=2, pattern_bins=4)
    patterns = gnm_env.Patterns.draw(task, 0)
    rule = agents.AggregateLabel()
    made = [
        agents.NeuronAgent(agents.GNM(), rule, 6),
        agents.NeuronAgent(agents.MST(), agents.ErrorTrace(), 6, weight_bounds=None),
        ContinuousAgent(ContinuousGNM(), rule, 6),
        NetworkAgent(Network(hidden=3), BackPropagation(), 6),
    ]
    paths = [folder / f"agent{k}" for k in range(len(made))]
    for k, (agent, path) in enumerate(zip(made, paths, strict=True)):
        if k % 2:
            agent.save(path)
        else:
            agent.save(path, task=task, patterns=patterns, rng=np.random.default_rng(1))
    return paths


def trials_files(folder: Path) -> list[Path]:
    """Data sets of trials with presentations, and with labels alone."""
    import numpy as np

    import gnm_env

    task = gnm_env.Task(n_inputs=6, n_classes=2, pattern_bins=4, background_bins=9)
    rng = np.random.default_rng(0)
    drawn = [gnm_env.draw_trial(task, gnm_env.Patterns.draw(task, 0), rng) for _ in range(3)]
    labelled = [gnm_env.Trial.from_dense(rng.random((8, 6)) < 0.2, label=k) for k in range(3)]
    gnm_env.Trials(drawn, columns={"day": [1, 2, 3]}, metadata={"who": "a"}).save(folder / "drawn")
    gnm_env.Trials(labelled).save(folder / "labelled")
    return [folder / "drawn", folder / "labelled"]


def seen_in_checkpoint(path: Path) -> Any:
    """All that a checkpoint gives, so that two can be compared."""
    import agents

    found = agents.load_checkpoint(path)
    agent = found.agent
    arrays = {
        name: getattr(agent, name).tobytes()
        for name in ("weights", "momentum", "velocity")
        if hasattr(agent, name)
    }
    names = ("neuron", "network", "rule", "weight_bounds", "overflowed", "n_inputs")
    state = None if found.rng is None else str(found.rng.bit_generator.state)
    settings = [repr(getattr(agent, name, None)) for name in names]
    return type(agent), arrays, settings, found.task, found.patterns, state


def seen_in_trials(path: Path) -> Any:
    """All that a file of trials gives."""
    import gnm_env

    trials = gnm_env.Trials.load(path)
    known = [repr(getattr(trials, name, None)) for name in ("columns", "metadata", "n_classes")]
    each = [
        (t.dense().tobytes(), t.edges.tobytes(), t.target.tobytes(), t.classes.tobytes(), t.label)
        for t in trials
    ]
    return known, each


def flip(path: Path, seen: Callable[[Path], Any], rng: random.Random) -> str:
    """Change one byte of a copy: refused, unchanged, or what is wrong."""
    before = seen(path)
    content = bytearray(path.read_bytes())
    place = rng.randrange(len(content))
    content[place] ^= rng.randrange(1, 256)
    damaged = path.with_name("damaged")
    damaged.write_bytes(content)
    try:
        after = seen(damaged)
    except ValueError as refusal:
        return "refused" if str(damaged) in str(refusal) else f"not told of which file: {refusal}"
    except BaseException as error:
        return f"byte {place} of {path.name}: {type(error).__name__}: {error}"
    if after == before:
        return "without effect"
    return f"byte {place} of {path.name}: other contents, unnoticed"


def main() -> None:
    """Flip bytes, and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--checkpoints", type=int, default=30)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("error")
    rng = random.Random(options.seed)
    counts: Counter[str] = Counter({"tried": 0, "refused": 0, "without effect": 0, "wrong": 0})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        work = [(checkpoint_files(folder), seen_in_checkpoint, options.checkpoints)]
        if options.trials:
            work.append((trials_files(folder), seen_in_trials, options.trials))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        for paths, seen, count in work:
            for k in range(count):
                said = flip(paths[k % len(paths)], seen, rng)
                counts["tried"] += 1
                if said not in counts:
                    print(said, file=sys.stderr)
                counts[said if said in counts else "wrong"] += 1
    print(json.dumps(counts))


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
    main()
