"""Show a trained continuous neuron as a chemical reaction network: draw it, count, export.

gnm chemistry runs/continuous/agent.npz --molecules 25 100 500 --export model.xml
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents import bootstrap_interval
from agents.chemistry import Course, ReactionNetwork, Reactor, antimony, sbml
from agents.chemistry.mistakes import MOLECULES, Mistakes, count_mistakes
from agents.chemistry.network import CONVERSION
from agents.commands.evaluate import loaded
from agents.commands.terminal import Parser, at_least, share
from agents.continuous import InputSpikes
from agents.continuous.outputs import outputs_alone
from agents.experiments import continuous_time, reactions
from agents.experiments.progress import Progress
from agents.experiments.reactions import given, traced_trial
from agents.plotting import save
from gnm_env import Trial
from gnm_env.files import atomic_write


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("checkpoint", type=Path, help="a neuron trained with --time continuous")
    add("--molecules", type=int, nargs="+", default=[25, 100, 500], metavar="M",
        help="molecules that make an input spike (default 25 100 500)")
    add("--export", type=Path, metavar="FILE",
        help="write the network with the shown input: SBML, or Antimony if FILE ends in .ant or "
        ".txt; `molecules` is set to the first of --molecules")
    add("--conversion", type=float, metavar="C", help="rate at which input molecules react, per "
        f"bin (default {CONVERSION:g}, or that of --neuron reacting)")
    share(parser, "--runs", default=10, help="stochastic runs each")
    add("--trials", type=at_least(0), default=0, metavar="T",
        help="count wrong outputs over T trials for 10 … 2,000 molecules (default: do not)")
    share(parser, "--out", help="draw F2 and F8 there")
    share(parser, "--seed", help="of noise and of the molecules")
    # fmt: on


def export(path: Path, network: ReactionNetwork, spikes: InputSpikes, molecules: int) -> None:
    """Write the model: Antimony text if the name ends so (.ant, .txt), else SBML."""
    write = antimony if path.suffix in (".ant", ".txt") else sbml
    text = write(network, spikes, molecules)
    with atomic_write(path) as file:
        file.write(text.encode())


@dataclass(frozen=True, eq=False)
class Responses:
    """The network's answer to one trial.

    Attributes:
        deterministic: with infinitely many molecules.
        shown: for each number of molecules the first stochastic run.
        S: float64 (runs, K) for each number of molecules, S of each presentation in each run.
    """

    deterministic: Course
    shown: dict[int, Course]
    S: dict[int, NDArray[np.float64]]


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Export, simulate, count and draw what the command line asks for."""
    began = time.monotonic()
    agent, task, patterns = loaded(options.checkpoint)
    network = ReactionNetwork.from_agent(agent, options.conversion)
    trial = traced_trial(task, patterns, options.seed)
    spikes = InputSpikes.from_trial(trial)
    result: dict[str, Any] = {
        "checkpoint": str(options.checkpoint),
        "conversion": network.conversion,
        "targets": list(task.owed),
        "outputs_alone": outputs_alone(agent, patterns).tolist(),
    }
    if options.export is not None:
        export(options.export, network, spikes, options.molecules[0])
        result["export"] = str(options.export)
        print(f"model with {len(spikes.times)} input spikes: {options.export}")

    responses = simulate(network, trial, options.molecules, options.runs, options.seed)
    result |= _print_responses(trial, responses)
    figures = {
        "F2_classes": lambda: continuous_time.draw(agent, task, patterns),
        "F8_volumes": lambda: reactions.draw_volumes(
            trial, responses.deterministic, responses.shown
        ),
    }
    if options.trials:
        with Progress("mistakes", options.trials, unit="trials") as progress:
            mistakes = count_mistakes(
                agent, task, patterns, MOLECULES, options.trials, options.seed,
                options.conversion, progress.advance,
            )  # fmt: skip
        result["wrong_outputs"] = _print_mistakes(mistakes)
        figures["F8_mistakes"] = lambda: reactions.draw_mistakes(mistakes)
    if options.out is not None:
        result["figures"] = [
            str(path)
            for name, draw in figures.items()
            for path in save(draw(), options.out, name, ("pdf", "png")).values()
        ]
        if options.trials:
            save_counts(options.out / "F8_mistakes.csv", mistakes)
    return result | {"seconds": round(time.monotonic() - began, 2)}


def simulate(
    network: ReactionNetwork, trial: Trial, molecules: list[int], runs: int, seed: int
) -> Responses:
    """One deterministic trace, and `runs` stochastic ones for each number of molecules."""
    spikes, reactor = InputSpikes.from_trial(trial), Reactor(network)
    responses = Responses(reactor.deterministic(spikes), {}, {})
    with Progress("stochastic simulation", runs * len(molecules), unit="runs") as progress:
        for number in molecules:
            amounts = []
            for run in range(runs):
                one = reactor.stochastic(spikes, number, seed=seed + run)
                responses.shown.setdefault(number, one)
                amounts.append(given(trial, one)[0])
                progress.advance()
            responses.S[number] = np.array(amounts)
    return responses


def _print_responses(trial: Trial, responses: Responses) -> dict[str, Any]:
    exact = given(trial, responses.deterministic)
    rows = {"deterministic": (exact, np.zeros_like(exact))}
    rows |= {f"{m} molecules": (S.mean(axis=0), S.std(axis=0)) for m, S in responses.S.items()}
    for name, (mean, spread) in rows.items():
        cells = ",  ".join(f"class {c}: {mean[c]:5.2f} ± {spread[c]:.2f}" for c in trial.classes)
        print(f"{name:>16}   S of {cells}")
    return {
        "deterministic_S": exact.tolist(),
        "stochastic_S": {str(m): S.mean(axis=0).tolist() for m, S in responses.S.items()},
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


def save_counts(path: Path, mistakes: Mistakes) -> None:
    """Wrong outputs as a table: a row for each trial, a column for each number of molecules."""
    columns = ["neuron", "deterministic", *(str(number) for number in mistakes.molecules)]
    rows = np.column_stack([mistakes.neuron, mistakes.deterministic, *mistakes.stochastic])
    with atomic_write(path) as file:
        np.savetxt(file, rows, "%d", ",", header=",".join(columns), comments="")
