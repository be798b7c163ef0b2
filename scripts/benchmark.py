"""Measure speed, memory and starts beside what one would otherwise use; say which targets are met.

    python scripts/benchmark.py                     everything, some minutes
    python scripts/benchmark.py --quick             a first look, targets are for the long run
    python scripts/benchmark.py --only training loop
    python scripts/benchmark.py --publish           also writes docs/performance.md and its picture

Everything runs on one core, the idlest, unless a row says otherwise. Writes benchmark.json and
benchmark.png into --out. What cannot be measured here, because a package is missing, is skipped
with a line; a measurement that fails is named at the end, and the exit code is then 1.
"""

from __future__ import annotations

import argparse
import importlib
import json
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tqdm import tqdm

import benchmarks  # noqa: F401  before NumPy

# isort: split
from agents.commands import terminal
from agents.commands.terminal import Parser, at_least
from benchmarks.report import page, summary, table
from benchmarks.rows import Findings
from gnm_env.files import atomic_write

DOCS = Path(__file__).resolve().parent.parent / "docs"

SECTIONS: dict[str, tuple[str, ...]] = {
    "training": ("training:side_by_side",),
    "rules": ("training:rules",),
    "alone": ("training:alone",),
    "network": ("training:network",),
    "continuous": ("training:continuous",),
    "threads": ("training:threads",),
    "heat-map": ("training:heat_map",),
    "loop": ("training:loop",),
    "data-sets": ("data_sets:data_sets",),
    "others": ("others:forward", "others:learning_trials"),
    "environments": ("environments:single", "environments:vector"),
    "rl": ("learners:reinforcement",),
    "growth": ("growth:sizes", "growth:lanes", "growth:trials", "growth:environments"),
    "memory": ("footprint:memory",),
    "start": ("footprint:imports", "footprint:starts"),
}
"""Functions (Settings) -> Findings in the package `benchmarks`, by the name of their section."""


def measure(options: argparse.Namespace) -> Findings:
    """Everything that the command line asks for, saved section by section."""
    from benchmarks.cores import Cores
    from benchmarks.machine import machine
    from benchmarks.timing import Settings

    cores = Cores()
    settings = Settings(options.repeats, options.quick, options.full, options.seed, cores)
    found = Findings(
        machine=machine(cores),
        settings={
            "command": command(options),
            "repeats": options.repeats,
            "quick": options.quick,
            "full": options.full,
            "seed": options.seed,
        },
    )
    names = options.only or list(SECTIONS)
    pending = [function for name in SECTIONS if name in names for function in SECTIONS[name]]
    before = time.monotonic()
    with tqdm(pending, disable=not sys.stderr.isatty(), unit="measurement") as bar:
        for function in bar:
            bar.set_description(function)
            if bar.disable:
                print(f"{time.monotonic() - before:5.0f} s  {function}", file=sys.stderr)
            found.add(attempt(function, settings))
            save(found, options.out)
    found.settings["seconds"] = round(time.monotonic() - before, 1)
    save(found, options.out)
    return found


def attempt(function: str, settings: Any) -> Findings:
    """One measurement. What cannot be measured here is named, and does not end the run."""
    from benchmarks.timing import Skip

    module, name = function.split(":")
    try:
        call: Callable[[Any], Findings] = getattr(
            importlib.import_module(f"benchmarks.{module}"), name
        )
        return call(settings)
    except Skip as reason:
        return Findings(skipped=[f"{function}: {reason}"])
    except Exception as error:
        return Findings(failed=[f"{function}: {type(error).__name__}: {error}"])


def save(found: Findings, folder: Path) -> None:
    """Write what there is, whole or not at all."""
    with atomic_write(folder / "benchmark.json") as file:
        file.write(json.dumps(found.to_json(), indent=1).encode())


def publish(found: Findings, picture: Path | None, docs: Path) -> None:
    """Write the page, and put the picture beside it."""
    (docs / "images").mkdir(parents=True, exist_ok=True)
    (docs / "performance.md").write_text(page(found, picture is not None), encoding="utf-8")
    if picture is not None:
        shutil.copyfile(picture, docs / "images/performance.png")


def illustrated(found: Findings, folder: Path) -> Path | None:
    """Draw the picture; None, and a line that says so, without matplotlib."""
    try:
        from benchmarks.picture import draw

        draw(found, folder / "benchmark.png")
        return folder / "benchmark.png"
    except ImportError as error:
        print(f'no picture: {error}; pip install "gnm-env[pictures]"', file=sys.stderr)
        return None


def command(options: argparse.Namespace) -> str:
    """The command line that measures the same."""
    parts = ["python scripts/benchmark.py"]
    if options.only:
        parts.append("--only " + " ".join(options.only))
    parts += [f"--{name}" for name in ("quick", "full") if getattr(options, name)]
    parts += [
        f"--{n} {getattr(options, n)}" for n, usual in DEFAULTS if getattr(options, n) != usual
    ]
    return " ".join(parts)


DEFAULTS = (("repeats", 5), ("seed", 0))


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("--only", nargs="+", metavar="NAME", choices=SECTIONS,
        help=f"some of: {', '.join(SECTIONS)}")
    add("--quick", action="store_true", help="less work per repeat, a minute or two in all")
    add("--full", action="store_true", help="the heat map whole, not a part that is scaled up")
    add("--repeats", type=at_least(1), default=5, metavar="N", help="(default 5)")
    terminal.share(parser, "--seed", help="of the streams")
    terminal.share(parser, "--out", default=Path("results/benchmark"))
    add("--publish", action="store_true", help="write docs/performance.md and its picture")
    add("--last", action="store_true", help="measure nothing: show the last run that is in --out")
    # fmt: on


def check(options: argparse.Namespace) -> None:
    """ValueError for options that exclude each other."""
    if options.quick and options.full:
        raise ValueError("--quick and --full exclude each other: choose one")
    if options.publish and not options.last:
        partial = [f"--{name}" for name in ("quick", "only") if getattr(options, name)]
        if options.repeats < DEFAULTS[0][1]:
            partial.append("--repeats")
        if partial:
            raise ValueError(
                f"--publish wants the long run, not one with {' and '.join(partial)}: "
                "leave one of the two out"
            )


def last(folder: Path) -> Findings:
    """The findings of the last run in `folder`."""
    path = folder / "benchmark.json"
    if not path.exists():
        raise ValueError(f"there is no {path}: run the benchmark without --last first")
    return Findings.from_json(path.read_text(encoding="utf-8"))


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Measure (or load), tell, draw, publish."""
    check(options)
    options.out.mkdir(parents=True, exist_ok=True)
    found = last(options.out) if options.last else measure(options)
    print(table(found))
    picture = illustrated(found, options.out)
    if options.publish:
        publish(found, picture, DOCS)
    print(f"in {options.out}", file=sys.stderr)
    return {**found.to_json(), "summary": summary(found)}


if __name__ == "__main__":
    terminal.run(lambda: sys.modules[__name__], sys.argv[1:], "benchmark.py")
