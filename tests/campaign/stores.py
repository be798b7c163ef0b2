"""Stores of experiments: sweeps killed at any moment, and one changed byte in any file of a store.

python tests/campaign/stores.py --kills 100 --flips 200
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SEEDS = 12
"""Size of the experiment: 6 blocks for each of these."""


def campaign(kills: int, flips: int, seed: int) -> Counter[str]:
    """So many killed sweeps and changed bytes, in a process of its own."""
    done = subprocess.run(
        [
            *(sys.executable, str(Path(__file__)), "--seed", str(seed)),
            *("--kills", str(kills), "--flips", str(flips)),
        ],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in (str(ROOT), *sys.path) if p)},
        stdout=subprocess.PIPE,
        text=True,
    )
    if done.returncode:
        print(f"the process ended with {done.returncode}")
        return Counter(tried=kills + flips, wrong=1)
    return Counter(json.loads(done.stdout.splitlines()[-1]))


def fill(folder: Path, repair: bool = False) -> None:
    """Compute whatever is still to be computed."""
    from agents.experiments.store import open_store
    from tests.agents.experiments.toys import toy, work

    with open_store(folder, toy(seeds=SEEDS), repair=repair) as store:
        for block in store.pending():
            store.write(block, work(block), 0.01, "here")


def killed_sweeps(count: int, folder: Path, rng: random.Random) -> list[str]:
    """What is wrong after each of `count` kills of a sweep that is begun anew when it is done."""
    import dask.array  # noqa: F401  what xarray imports for the first store of a process
    import numpy as np

    from agents.experiments.store import read, summarise
    from agents.experiments.sweep import sweep
    from agents.experiments.workers import threads
    from tests.agents.experiments.toys import toy

    experiment = toy(seeds=SEEDS, pause=0.01)
    whole = folder / "whole"
    fill_with_pause(whole, experiment)
    expected = read(whole)
    place, said, before = folder / "killed", [], 0
    for _ in range(count):
        child = os.fork()
        if child == 0:
            with threads(2) as executor:
                sweep(experiment, place, executor)
            os._exit(0)
        time.sleep(rng.uniform(0.0, 1.0))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        wrong = ""
        if place.exists():
            try:
                now, results = summarise(place).done, read(place, unfinished=True)
                there = results["survived"].values >= 0
                right = expected["survived"].values == results["survived"].values
                if now < before or not np.all(right | ~there):
                    wrong = f"{before} blocks became {now}, or their numbers changed"
                before = now
            except Exception as error:
                wrong = f"{type(error).__name__}: {error}"
            if before == summarise(place).blocks:
                left = [p.name for p in place.rglob("*.partial")]
                wrong = wrong or (f"left behind: {left}" if left else "")
                if not read(place).equals(expected):
                    wrong = "the finished store differs from one that was never interrupted"
                shutil.rmtree(place)
                before = 0
        said.append(wrong)
    return said


def fill_with_pause(folder: Path, experiment: Any) -> None:
    """The experiment without an interruption."""
    from agents.experiments.sweep import sweep
    from agents.experiments.workers import threads

    with threads(2) as executor:
        sweep(experiment, folder, executor)


def changed_stores(count: int, folder: Path, rng: random.Random) -> list[str]:
    """What became of each of `count` stores with one changed byte: refused, without effect, …"""
    from agents.experiments.journal import StoreError
    from agents.experiments.store import read

    whole = folder / "whole"
    fill(whole)
    expected = read(whole)
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    said = []
    for k in range(count):
        copy = folder / f"copy{k}"
        shutil.copytree(whole, copy)
        # The journal, where one digit may matter, as often as all other files together.
        journals = [f for f in files if "journal" in f.name]
        path = copy / rng.choice(journals if k % 2 and journals else files)
        content = bytearray(path.read_bytes())
        place = rng.randrange(len(content))
        content[place] ^= rng.randrange(1, 256)
        path.write_bytes(content)
        where = f"byte {place} of {path.relative_to(copy)}"
        outcome = "without effect"
        try:
            if not read(copy).equals(expected):
                outcome = f"{where}: other numbers, unnoticed"
        except StoreError:
            outcome = "refused"
        except Exception as error:
            outcome = f"{where}: {type(error).__name__}: {error}"
        try:
            fill(copy, repair=True)
            if not read(copy).equals(expected):
                outcome = f"{where}: repaired to other numbers"
        except Exception as error:
            outcome = f"{where}: repair ends in {type(error).__name__}: {error}"
        said.append(outcome)
        shutil.rmtree(copy)
    return said


def main() -> None:
    """Kill sweeps and change bytes, and say how it went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=4)
    parser.add_argument("--flips", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = random.Random(options.seed)
    counts: Counter[str] = Counter({"tried": 0, "refused": 0, "without effect": 0, "wrong": 0})
    with tempfile.TemporaryDirectory() as kills, tempfile.TemporaryDirectory() as flips:
        outcomes = killed_sweeps(options.kills, Path(kills), rng) if options.kills else []
        outcomes = [outcome or "without effect" for outcome in outcomes]
        outcomes += changed_stores(options.flips, Path(flips), rng) if options.flips else []
    for outcome in outcomes:
        counts["tried"] += 1
        if outcome not in counts:
            print(outcome, file=sys.stderr)
        counts[outcome if outcome in counts else "wrong"] += 1
    print(json.dumps(counts))


if __name__ == "__main__":
    sys.path[:0] = [p for p in (str(ROOT), str(ROOT / "scripts")) if p not in sys.path]
    main()
