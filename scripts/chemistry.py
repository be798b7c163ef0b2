"""Show a trained continuous neuron as a chemical reaction network: draw it, count, export.

python scripts/chemistry.py runs/continuous/agent.npz --molecules 25 100 500 --export model.xml
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

import commandline
from agents import load_checkpoint
from agents.checkpoint import Checkpoint, atomic_write
from agents.chemistry import ReactionNetwork, Reactor, antimony, sbml
from agents.chemistry.mistakes import MOLECULES, Mistakes, count_mistakes
from agents.chemistry.network import CONVERSION
from agents.continuous import InputSpikes
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


def main(options: argparse.Namespace) -> dict[str, Any]:
    """What the command line asks for; missing packages are bad input like any other."""
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
        "molecules": options.molecules,
        "conversion": network.conversion,
        "outputs_alone": outputs_alone(saved.agent, patterns).tolist(),
        "targets": list(task.owed),
    }
    if options.export is not None:
        export(options.export, network, spikes, options.molecules[0])
        result["export"] = str(options.export)
        print(f"model with {len(spikes.times)} input spikes: {options.export}")
    result |= _simulate(options, network, trial, spikes)
    if options.trials:
        result |= _count(options, saved.agent, task, patterns)
    if options.out is not None:
        result["figures"] = _draw_classes(options.out, saved.agent, task, patterns) + result.get(
            "figures", []
        )
    return result | {"seconds": round(time.monotonic() - began, 2)}


def _task(saved: Checkpoint, path: Path) -> tuple[Task, Patterns]:
    if saved.task is None or saved.patterns is None:
        raise ValueError(
            f"{path} was saved without its task and patterns; save with task=…, patterns=…"
        )
    return saved.task, saved.patterns


def _simulate(
    options: argparse.Namespace, network: ReactionNetwork, trial: Trial, spikes: InputSpikes
) -> dict[str, Any]:
    """One deterministic trace, and `runs` stochastic ones for each number of molecules."""
    reactor = Reactor(network)
    deterministic = reactor.deterministic(spikes)
    _print_row("deterministic", in_occurrences(trial, _edges(deterministic, trial)), None)
    shown, rows = {}, {}
    with Progress("stochastic runs", options.runs * len(options.molecules)) as progress:
        for molecules in options.molecules:
            S = []
            for run in range(options.runs):
                one = reactor.stochastic(spikes, molecules, seed=options.seed + run)
                shown.setdefault(molecules, one)
                S.append(in_occurrences(trial, _edges(one, trial))[0])
                progress.advance()
            rows[molecules] = np.array(S)
    for molecules, amounts in rows.items():
        spread = amounts.std(axis=0, ddof=1) if options.runs > 1 else None
        _print_row(f"{molecules} molecules", amounts.mean(axis=0), spread)
    result: dict[str, Any] = {
        "deterministic_S": in_occurrences(trial, _edges(deterministic, trial)).tolist(),
        "stochastic_S": {str(m): amounts.mean(axis=0).tolist() for m, amounts in rows.items()},
    }
    if options.out is not None:
        from figures_continuous import draw_volumes, save

        paths = save(draw_volumes(trial, deterministic, shown), options.out / "F8_volumes")
        result["figures"] = [str(path) for path in paths]
    return result


def _edges(course: Any, trial: Trial) -> np.ndarray[Any, np.dtype[np.float64]]:
    S = course.S()
    return S[..., :: (S.shape[-1] - 1) // trial.n_bins]


def _print_row(name: str, S: Any, spread: Any) -> None:
    cells = [
        f"class {c + 1}: {amount:5.2f}" + ("" if spread is None else f" ± {spread[c]:.2f}")
        for c, amount in enumerate(S)
    ]
    print(f"{name:>16}   S of " + ",  ".join(cells))


def _count(
    options: argparse.Namespace, agent: Any, task: Task, patterns: Patterns
) -> dict[str, Any]:
    """Wrong outputs per trial for each of many numbers of molecules."""
    with Progress("trials", options.trials) as progress:
        mistakes = count_mistakes(
            agent,
            task,
            patterns,
            MOLECULES,
            options.trials,
            options.seed,
            options.conversion,
            progress.advance,
        )
    print("wrong outputs per trial (mean, 95 % interval)")
    for molecules, row in zip(mistakes.molecules, mistakes.stochastic, strict=True):
        low, high = bootstrap_interval(row)
        print(f"{molecules:>16,} molecules  {row.mean():6.3f}  ({low:.3f} … {high:.3f})")
    print(f"{'deterministic':>26}  {mistakes.deterministic.mean():6.3f}")
    print(f"{'neuron':>26}  {mistakes.neuron.mean():6.3f}")
    result = {"wrong_outputs": _described(mistakes)}
    if options.out is not None:
        from figures_continuous import draw_mistakes, save

        save(draw_mistakes(mistakes), options.out / "F8_mistakes")
    return result


def _described(mistakes: Mistakes) -> dict[str, Any]:
    return {
        "trials": int(mistakes.neuron.size),
        "molecules": mistakes.molecules.tolist(),
        "mean": mistakes.stochastic.mean(axis=1).tolist(),
        "ci95": [bootstrap_interval(row) for row in mistakes.stochastic],
        "deterministic": float(mistakes.deterministic.mean()),
        "neuron": float(mistakes.neuron.mean()),
    }


def _draw_classes(out: Path, agent: Any, task: Task, patterns: Patterns) -> list[str]:
    from figures_continuous import draw_classes, save

    courses = [course(agent, pattern_spikes(patterns, c)) for c in range(task.n_classes)]
    figure = draw_classes(courses, task.owed, agent.neuron.theta_r)
    return [str(path) for path in save(figure, out / "F2_classes")]


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
