"""Show a trained continuous neuron as a chemical reaction network: draw it, count, export.

python scripts/chemistry.py runs/continuous/agent.npz --molecules 25 100 500 --export model.xml
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import commandline
from agents import load_checkpoint
from agents.checkpoint import Checkpoint, atomic_write
from agents.chemistry import Course, ReactionNetwork, Reactor, antimony, sbml
from agents.chemistry.mistakes import MOLECULES, Mistakes, count_mistakes
from agents.chemistry.network import CONVERSION
from agents.continuous import InputSpikes, Trajectory
from agents.continuous.outputs import course, in_occurrences, outputs_alone, pattern_spikes
from agents.evaluation import bootstrap_interval
from gnm_env import Patterns, Task, Trial
from progress import Progress

GAP = 25
"""Bins of noise before, between and after the patterns that are shown."""


def shown_trial(task: Task, patterns: Patterns, seed: int) -> Trial:
    """Each pattern once, in noise drawn from `seed`."""
    rng = np.random.default_rng(seed)
    parts: list[Any] = []
    for pattern in patterns.dense():
        parts += [rng.random((GAP, task.n_inputs)) < task.rate, pattern]
    parts.append(rng.random((GAP, task.n_inputs)) < task.rate)
    onsets = GAP + (GAP + task.pattern_bins) * np.arange(task.n_classes)
    return Trial.from_dense(np.concatenate(parts), onsets, np.arange(task.n_classes), task)


def export(path: Path, network: ReactionNetwork, spikes: InputSpikes, molecules: int) -> None:
    """Write the model: Antimony text if the name ends so (.ant, .txt), else SBML."""
    write = antimony if path.suffix in (".ant", ".txt") else sbml
    text = write(network, spikes, molecules)
    with atomic_write(path) as file:
        file.write(text.encode())


@dataclass(frozen=True, eq=False)
class Traces:
    """The network's answer to one trial.

    Attributes:
        deterministic: with infinitely many molecules.
        shown: for each number of molecules the first stochastic run.
        S: float64 (runs, K) for each number of molecules, S of each occurrence in each run.
    """

    deterministic: Course
    shown: dict[int, Course]
    S: dict[int, NDArray[np.float64]]


def main(options: argparse.Namespace) -> dict[str, Any]:
    """What the command line asks for; a missing package is bad input like any other."""
    try:
        return _main(options)
    except ImportError as error:
        raise ValueError(str(error)) from None


def _main(options: argparse.Namespace) -> dict[str, Any]:
    began = time.monotonic()
    saved = load_checkpoint(options.checkpoint)
    network = ReactionNetwork.from_agent(saved.agent, options.conversion)
    task, patterns = _task(saved, options.checkpoint)
    trial = shown_trial(task, patterns, options.seed)
    spikes = InputSpikes.from_trial(trial)
    result: dict[str, Any] = {
        "checkpoint": str(options.checkpoint),
        "conversion": network.conversion,
        "targets": list(task.owed),
        "outputs_alone": outputs_alone(saved.agent, patterns).tolist(),
    }
    if options.export is not None:
        export(options.export, network, spikes, options.molecules[0])
        result["export"] = str(options.export)
        print(f"model with {len(spikes.times)} input spikes: {options.export}")

    traces = simulate(network, trial, options.molecules, options.runs, options.seed)
    result |= _print_traces(trial, traces)
    mistakes = None
    if options.trials:
        with Progress("trials", options.trials) as progress:
            mistakes = count_mistakes(
                saved.agent, task, patterns, MOLECULES, options.trials, options.seed,
                options.conversion, progress.advance,
            )  # fmt: skip
        result["wrong_outputs"] = _print_mistakes(mistakes)
    if options.out is not None:
        courses = [course(saved.agent, pattern_spikes(patterns, c)) for c in range(task.n_classes)]
        result["figures"] = _draw(options.out, task, network, trial, courses, traces, mistakes)
    return result | {"seconds": round(time.monotonic() - began, 2)}


def _task(saved: Checkpoint, path: Path) -> tuple[Task, Patterns]:
    if saved.task is None or saved.patterns is None:
        raise ValueError(
            f"{path} was saved without its task and patterns; save with task=…, patterns=…"
        )
    return saved.task, saved.patterns


def simulate(
    network: ReactionNetwork, trial: Trial, molecules: list[int], runs: int, seed: int
) -> Traces:
    """One deterministic trace, and `runs` stochastic ones for each number of molecules."""
    spikes, reactor = InputSpikes.from_trial(trial), Reactor(network)
    traces = Traces(reactor.deterministic(spikes), {}, {})
    with Progress("stochastic runs", runs * len(molecules)) as progress:
        for number in molecules:
            amounts = []
            for run in range(runs):
                one = reactor.stochastic(spikes, number, seed=seed + run)
                traces.shown.setdefault(number, one)
                amounts.append(_given(trial, one)[0])
                progress.advance()
            traces.S[number] = np.array(amounts)
    return traces


def _given(trial: Trial, course: Course) -> NDArray[np.float64]:
    """S of each occurrence."""
    S = course.S()
    return in_occurrences(trial, S[..., :: (S.shape[-1] - 1) // trial.n_bins])


def _print_traces(trial: Trial, traces: Traces) -> dict[str, Any]:
    exact = _given(trial, traces.deterministic)
    rows = {"deterministic": (exact, np.zeros_like(exact))}
    rows |= {f"{m} molecules": (S.mean(axis=0), S.std(axis=0)) for m, S in traces.S.items()}
    for name, (mean, spread) in rows.items():
        cells = ",  ".join(
            f"class {c + 1}: {mean[c]:5.2f} ± {spread[c]:.2f}" for c in trial.classes
        )
        print(f"{name:>16}   S of {cells}")
    return {
        "deterministic_S": exact.tolist(),
        "stochastic_S": {str(m): S.mean(axis=0).tolist() for m, S in traces.S.items()},
    }


def _print_mistakes(mistakes: Mistakes) -> dict[str, Any]:
    intervals = [bootstrap_interval(row) for row in mistakes.stochastic]
    mean = mistakes.stochastic.mean(axis=1)
    print(f"wrong outputs per trial, {mistakes.neuron.size} trials (95 % interval)")
    for number, rate, (low, high) in zip(mistakes.molecules, mean, intervals, strict=True):
        print(f"{number:>16,} molecules  {rate:6.3f}  ({low:.3f} … {high:.3f})")
    print(f"{'deterministic':>26}  {mistakes.deterministic.mean():6.3f}")
    print(f"{'neuron':>26}  {mistakes.neuron.mean():6.3f}")
    return {
        "trials": int(mistakes.neuron.size),
        "molecules": mistakes.molecules.tolist(),
        "mean": mean.tolist(),
        "ci95": intervals,
        "deterministic": float(mistakes.deterministic.mean()),
        "neuron": float(mistakes.neuron.mean()),
    }


def _draw(
    folder: Path,
    task: Task,
    network: ReactionNetwork,
    trial: Trial,
    courses: list[Trajectory],
    traces: Traces,
    mistakes: Mistakes | None,
) -> list[str]:
    """Write the figures as PDF and PNG; returns their paths."""
    from figures_continuous import draw_classes, draw_mistakes, draw_volumes, save

    figures = {
        "F2_classes": draw_classes(courses, task.owed, network.theta_r),
        "F8_volumes": draw_volumes(trial, traces.deterministic, traces.shown),
    }
    if mistakes is not None:
        figures["F8_mistakes"] = draw_mistakes(mistakes)
    paths = [str(path) for name in figures for path in save(figures[name], folder / name)]
    if mistakes is not None:
        save_counts(folder / "F8_mistakes.csv", mistakes)
    return paths


def save_counts(path: Path, mistakes: Mistakes) -> None:
    """Wrong outputs as a table: a row for each trial, a column for each number of molecules."""
    columns = ["neuron", "deterministic", *(str(number) for number in mistakes.molecules)]
    rows = np.column_stack([mistakes.neuron, mistakes.deterministic, *mistakes.stochastic])
    with atomic_write(path) as file:
        np.savetxt(file, rows, "%d", ",", header=",".join(columns), comments="")


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("checkpoint", type=Path, help="a neuron trained with --time continuous")
    parser.add_argument(
        "--molecules", type=int, nargs="+", default=[25, 100, 500], metavar="M",
        help="molecules that make an input spike (default: 25 100 500)",
    )  # fmt: skip
    parser.add_argument(
        "--export", type=Path, metavar="FILE",
        help="write the network with the shown input: SBML, or Antimony if FILE ends in .ant or "
        ".txt; `molecules` is set to the first of --molecules",
    )  # fmt: skip
    parser.add_argument(
        "--conversion", type=float, default=CONVERSION, metavar="C",
        help="rate at which input molecules react, per bin (default: %(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--runs", type=int, default=10, help="stochastic runs each (default: %(default)s)"
    )
    parser.add_argument(
        "--trials", type=int, default=0, metavar="T",
        help="count wrong outputs over T trials for 10 … 2,000 molecules (default: do not)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="draw F2 and F8 there")
    parser.add_argument("--seed", type=int, default=0, help="of noise and of the molecules")
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    options = parser.parse_args(arguments)
    for name in ("runs", "seed", "trials"):
        if getattr(options, name) < (name == "runs"):
            parser.error(f"--{name} must be >= {int(name == 'runs')}, got {getattr(options, name)}")
    return options


if __name__ == "__main__":
    options = parse()
    commandline.run(lambda: main(options), as_json=options.json, name="chemistry")
