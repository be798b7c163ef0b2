"""What the project costs before and besides its work: memory, first start, second start, import."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from agents.memory import bytes_needed
from agents.training.source import TaskSource
from benchmarks.peak_memory import task_of
from benchmarks.rows import Findings, Row, Target
from benchmarks.timing import Settings, Skip
from gnm_env import Patterns

SCRIPTS = Path(__file__).resolve().parent.parent
MIB = 2**20

IMPORT = """
import json, time
import gymnasium, numba, numpy
before = time.perf_counter()
import gnm_env
middle = time.perf_counter()
import agents
print(json.dumps([middle - before, time.perf_counter() - before]))
"""

# numba fires "numba:compile" only where it finds nothing in its cache.
START = """
import json, runpy, sys
from numba.core import event
compiled = []
class Listener(event.Listener):
    def on_start(self, happened): compiled.append(1)
    def on_end(self, happened): pass
event.register("numba:compile", Listener())
script, sys.argv = sys.argv[1], sys.argv[1:]
sys.path.insert(0, sys.argv[0].rpartition("/")[0])
try:
    runpy.run_path(script, run_name="__main__")
except SystemExit as ended:
    if ended.code:
        raise
print(json.dumps(len(compiled)))
"""

PEAK = """
import runpy, sys
sys.argv[0] = "peak_memory"
runpy.run_module("benchmarks.peak_memory", run_name="__main__")
"""


def imports(settings: Settings) -> Findings:
    """Time to import our packages, beyond that of what they stand on."""
    with settings.cores.only(1):
        program(IMPORT)  # the first may still have to write byte code
        both = [json.loads(program(IMPORT)) for _ in range(settings.repeats)]
    section = "Start"
    world = Row(
        section, "import gnm_env, beyond gymnasium and numba", "s",
        tuple(world for world, _ in both), more_is_better=False, targets=(Target(0.3),),
    )  # fmt: skip
    everything = Row(
        section, "import gnm_env and agents, likewise", "s",
        tuple(all_ for _, all_ in both), more_is_better=False, targets=(Target(0.5),),
    )  # fmt: skip
    return Findings(rows=[world, everything])


def starts(settings: Settings) -> Findings:
    """First and later starts of scripts/train.py: the first compiles, the others must not.

    The first has two cores where there are two, as a user's has: it compiles with two processes.
    """
    script = SCRIPTS / "train.py"
    if not script.exists():
        raise Skip("scripts/train.py is not there")
    n_cores = min(2, settings.cores.count)
    with tempfile.TemporaryDirectory() as folder:
        arguments = (str(script), "--trials", "1000", "--out", str(Path(folder) / "out"))
        environment = {"NUMBA_CACHE_DIR": str(Path(folder) / "cache")}
        with settings.cores.only(n_cores):
            first, n_first = _start(arguments, environment)
        with settings.cores.only(1):
            later = [_start(arguments, environment) for _ in range(settings.repeats)]
    section = "Start"
    what = "scripts/train.py, 1,000 trials"
    return Findings(
        rows=[
            Row(
                section, f"{what}, first start", "s", (first,), more_is_better=False,
                note=f"{n_first} functions are compiled, once, beside those of a second process"
                if n_cores > 1
                else f"{n_first} functions are compiled, once, on one core",
                targets=(Target(9.0),),
            ),
            Row(section, f"{what}, later starts", "s", tuple(t for t, _ in later), False),
            Row(
                section, "functions compiled by a later start", "functions",
                tuple(float(n) for _, n in later), more_is_better=False, targets=(Target(0.0),),
            ),
        ]
    )  # fmt: skip


def _start(arguments: tuple[str, ...], environment: dict[str, str]) -> tuple[float, int]:
    """Seconds that the script takes, and the number of functions that it compiles."""
    before = time.perf_counter()
    output = program(START, *arguments, **environment)
    return time.perf_counter() - before, int(output.splitlines()[-1])


def memory(settings: Settings) -> Findings:
    """Peak memory of `train_many` beside what is stated for it."""
    if not Path("/proc/self/clear_refs").exists():
        raise Skip("peak memory is read from /proc, which this system lacks")
    cases = [
        (100, 64, 100, 1),
        (100, 1_024, 100, 1),
        (100, 4_096, 100, 1),
        (1_000, 1_024, 100, 1),
        (1_000, 4_096, 100, 1),
        (100, 64, 100_000, 1),
        (100, 1_024, 100_000, 1),
        (100, 1_024, 100_000, 2),
        (100, 64, 1_000_000, 1),
    ]
    if settings.quick:
        cases = cases[1:6:2]
    rows = []
    for n_inputs, lanes, length, threads in cases:
        text = program(PEAK, n_inputs, lanes, length, threads)
        task = task_of(n_inputs, length)
        source = TaskSource(task, Patterns.draw(task, 0))
        allowed = bytes_needed(n_inputs * lanes, lanes, source, threads)
        also = ", two threads" if threads == 2 else ""
        rows.append(
            Row(
                "Peak memory of train_many, agents included",
                f"N = {n_inputs:,}, {lanes:,} neurons, longest trial {length:,} bins{also}",
                "MiB",
                (json.loads(text) / MIB,),
                more_is_better=False,
                targets=(Target(allowed / MIB),),
            )
        )
    return Findings(rows=rows)


def program(text: str, *arguments: Any, **environment: str) -> str:
    """Run Python code in a process of its own; what it prints. OSError with its complaint if it
    fails."""
    roots = [str(SCRIPTS), str(SCRIPTS.parent)]
    path = os.pathsep.join(filter(None, [*roots, os.environ.get("PYTHONPATH", "")]))
    ended = subprocess.run(
        [sys.executable, "-c", text, *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path, **environment},
    )
    if ended.returncode != 0:
        raise OSError(f"a measuring process failed: {ended.stderr.strip().splitlines()[-1:]}")
    return ended.stdout
