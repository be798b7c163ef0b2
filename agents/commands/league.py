"""One table and one picture for every learner: neurons, the network, RL agents, silence, an oracle.

    gnm league                       the quick size, one class: minutes
    gnm league --size full --jobs 16
    gnm league --part rl --seeds 100-104 --jobs 4
    gnm league --part rules --size full      every rule on every neuron, tuned alike
    gnm league --rules critical all --neurons GNM MST
    gnm league --trials mine.npz     the same neurons and rules on a data set of yours

All hear the same patterns and are scored on the same streams; they are compared at the same number
of bins heard, and with each one's whole budget. Each training is one process, and one block of the
store: a run that is stopped goes on from what is there. The part "rules" has a table and pictures
of its own; `--tune` searches its settings anew.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from agents.commands.terminal import RESULTS, Parser, at_least, share
from agents.experiments import own_data, ranking, tuning
from agents.experiments.design import Experiment
from agents.experiments.league import PARTS, draw, league, read_league, rows, text_table
from agents.experiments.progress import counted
from agents.experiments.store import read
from agents.experiments.sweep import sweep
from gnm_env import Trials
from gnm_env.files import atomic_write

RESUMES = True
RULES = "rules"
SETTINGS, SCORES = "settings.json", "scores.json"


def options(parser: Parser) -> None:
    add = parser.add_argument
    share(parser, "--size", choices=("quick", "full"), default=None, help="(default quick)")
    add(
        "--part",
        choices=(*PARTS, RULES),
        action="append",
        help="this part: neurons and rl are the default, rules every rule on every neuron",
    )
    share(parser, "--seeds")
    add("--rules", nargs="+", metavar="RULE", help="of the part rules: only these, such as "
        f"{'; '.join(tuning.RULES)}; or by their registered names")  # fmt: skip
    add("--neurons", nargs="+", metavar="NEURON", help="of the part rules: only on these of "
        f"{', '.join(tuning.NEURONS)}")  # fmt: skip
    add("--tune", action="store_true", help="of the part rules: search the settings first; they "
        "then stand in the folder, in place of those that come with the package")  # fmt: skip
    add("--trials", type=Path, metavar="FILE", help="a data set, as `Trials.save` writes it: train "
        "every rule on 80 %% of it, score it on the rest")  # fmt: skip
    add("--by", metavar="COLUMN", help="of --trials: keep together what is alike in this column")
    add("--epochs", type=at_least(1), metavar="N", help="of --trials: how "
        f"often each trial is heard (default {own_data.EPOCHS})")  # fmt: skip
    share(parser, "--seed", help="of --trials: of the split and of all that is drawn")
    add("--jobs", type=at_least(1), metavar="N", help="trainings at a time (default 1)")
    add("--steps", type=at_least(1), metavar="N", help="bins that RL agents hear, to try it out")
    share(parser, "--out", help=f"(default {RESULTS}/league/SIZE)")
    add("--so-far", action="store_true", help="train nothing: print and draw what is finished")
    add("--keep", action="store_true", help="keep the table as the one that gnm report shows")
    share(parser, "--repair")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Compute what is missing, then print and draw what is there."""
    if options.trials is not None:
        return _on_trials(options)
    for name in ("by", "epochs"):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name} belongs to --trials FILE: add it, or leave --{name} out")
    options.size = options.size or "quick"
    folder = options.out or RESULTS / "league" / options.size
    chosen_rows = options.rules is not None or options.neurons is not None
    parts = options.part or ([RULES] if chosen_rows or options.tune else PARTS)
    if (chosen_rows or options.tune) and RULES not in parts:
        raise ValueError(
            "--rules, --neurons and --tune belong to --part rules: add it, or leave them out"
        )
    # Wrong names are told before anything is trained.
    names = ranking.rows_of(options.neurons, options.rules) if RULES in parts else []
    if not options.so_far:
        with _processes(options.jobs or 1) as executor:
            for part in parts:
                if part == RULES:
                    _rank(options, folder, names, executor)
                    continue
                wanted = league(part, options.size, options.seeds, options.steps)
                sweep(wanted, folder / part, executor, repair=options.repair)
    told: dict[str, Any] = {"store": str(folder), "table": [], "pictures": []}
    results = [read_league(folder / p) for p in PARTS if p in parts and (folder / p).exists()]
    if results:
        told["table"] = rows(results)
        print(text_table(told["table"]))
        told["pictures"] += map(str, draw(results, folder))
        if options.keep:
            from agents.suite.league import keep

            print(f"kept in {keep(told['table'])}")
    if RULES in parts and (folder / RULES).exists():
        told |= _ranked(folder, names, told["pictures"])
    elif not results:
        raise ValueError(f"there is no league in {folder}: leave --so-far out to train one")
    return told


def _on_trials(options: argparse.Namespace) -> dict[str, Any]:
    """Rank neurons and rules on a data set, print the table and keep it."""
    of_streams = ("part", "seeds", "tune", "steps", "so_far", "keep", "repair", "size", "jobs")
    for name in of_streams:
        if getattr(options, name):
            word = name.replace("_", "-")
            raise ValueError(
                f"--{word} is of the league on drawn streams: leave --trials or --{word} out"
            )
    trials = Trials.load(options.trials)
    print(trials)
    found = own_data.rank(
        trials, options.neurons, options.rules,
        epochs=options.epochs or own_data.EPOCHS, seed=options.seed, by=options.by,
        progress=counted("training", "entries"),
    )  # fmt: skip
    text = own_data.markdown(found)
    print(text)
    path = (options.out or RESULTS / "league" / options.trials.stem) / "trials.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as file:
        file.write(text.encode())
    return {"table": str(path), "rows": [row._asdict() for row in found]}


@contextmanager
def _processes(jobs: int) -> Iterator[Executor]:
    """Processes that keep to one core each, so that times can be compared."""
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as executor:
        yield executor


def _rank(options: argparse.Namespace, folder: Path, names: list[str], executor: Executor) -> None:
    """Compute what is missing of the part "rules": of the search too, where it is asked for."""
    settings = folder / SETTINGS
    if options.tune:
        tuned = [name for name in names if name not in ranking.FIXED]
        coarse, fine = tuning.SIZES[options.size]
        searches = {name: tuning.search(name, coarse) for name in tuned}
        results = _seed_by_seed(searches, folder / "tuning", executor, options.repair)
        searches = {
            name: tuning.search(name, fine, tuning.kept_tries(name, read(store)))
            for name, store in results.items()
        }
        results = _seed_by_seed(searches, folder / "tuning-of-the-best", executor, options.repair)
        found = {name: tuning.choose(name, read(store)) for name, store in results.items()}
        tuning.save_choices(found, settings)
    chosen = settings if settings.exists() else tuning.CHOSEN
    wanted = {n: ranking.ranking(n, options.size, options.seeds, chosen) for n in names}
    _seed_by_seed(wanted, folder / RULES, executor, options.repair)


def _seed_by_seed(
    experiments: Mapping[str, Experiment], folder: Path, executor: Executor, repair: bool
) -> dict[str, Path]:
    """All experiments on the first pattern seed, then on the next: each has a store in `folder`.

    A run that is stopped has all of them on the seeds that it came to. Returns the stores.
    """
    stores = {name: folder / tuning.folder_name(name) for name in experiments}
    for seed in next(iter(experiments.values())).axes[0].values:
        for name, wanted in experiments.items():
            only = ranking.on_seed(wanted, seed)
            sweep(wanted, stores[name], executor, repair=repair, only=only)
    return stores


def _ranked(folder: Path, names: list[str], pictures: list[str]) -> dict[str, Any]:
    """Print, draw and keep what is finished of the part "rules"."""
    table = ranking.with_others(ranking.read_ranking(folder / RULES, names))
    text = ranking.markdown(table)
    print(text)
    scores = ranking.saved(table)
    for name, content in (("rules.md", text), (SCORES, tuning.as_json(scores))):
        with atomic_write(folder / name) as file:
            file.write(content.encode())
    drawn = [*pictures, *map(str, ranking.draw(table, folder))]
    return {"rules": scores, "pictures": drawn}
