"""Ask what the paper's method could not: run the experiments, draw them, judge the hypotheses.

    gnm findings                 minutes: few seeds
    gnm findings --size paper    about an hour on one core

Each hypothesis and its rule were written down before the run. May be stopped at any moment: what is
finished is kept, and the next start goes on from there.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

from agents.commands.sweep import workers
from agents.commands.terminal import RESULTS, Parser, share, share_run
from agents.experiments.figures import draw, load
from agents.experiments.listing import BEYOND, experiment, experiments, hypotheses, pictures
from agents.experiments.progress import duration
from agents.experiments.provenance import commit, software
from agents.experiments.report import minus, seeds_behind, stores
from agents.experiments.store import summarise
from agents.experiments.sweep import sweep
from agents.experiments.verdict import Hypothesis, Results

RESUMES = True
FINDINGS = RESULTS / "findings"


def options(parser: Parser) -> None:
    known = ", ".join(experiments(BEYOND))
    share_run(parser)
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"some experiments: {known}")
    parser.add_argument(
        "--judge", action="store_true", help="compute nothing: judge and draw what is there"
    )
    share(parser, "--results")
    share(parser, "--out", default=FINDINGS)


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Run what the command line asks for; write findings.json and figures/ in `--out`."""
    known = experiments(BEYOND)
    names = options.only or list(known)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"there is no experiment {unknown[0]!r}: choose from {', '.join(known)}")
    folder = options.results or RESULTS / options.size
    if not options.judge:
        with workers(options) as executor:
            for one in (experiment(name, options.size) for name in names):
                summary = sweep(one, folder / one.name, executor, repair=options.repair)
                print(f"{one.name}: {one.cells:,} cells, {duration(summary.wall)}", flush=True)
    results, absent = load(folder, names)
    if not results:
        raise ValueError(f"there is nothing to judge in {folder}: {'; '.join(absent)}")
    told = [row(one, results, options.size) for one in hypotheses()]
    drawn = draw(pictures(BEYOND), results, options.out / "figures")
    record = {
        "size": options.size, "software": software(), "commit": commit(), "findings": told,
        "figures": {name: pictures(BEYOND)[name].full_caption(results) for name in drawn},
        "stores": stores({name: summarise(folder / name) for name in results}),
    }  # fmt: skip
    options.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(record, indent=1, ensure_ascii=False)
    (options.out / "findings.json").write_text(text + "\n", encoding="utf-8")
    for found in told:
        print(f"{found['id']:3s} {found['verdict']}", *found["numbers"], sep="\n      ")
    print(f"figures and numbers: {options.out}")
    return {"findings": str(options.out), "verdicts": {one["id"]: one["verdict"] for one in told}}


def row(one: Hypothesis, results: Results, size: str) -> dict[str, Any]:
    """A hypothesis with what was found, ready for JSON."""
    finding = one.finding(results)
    return {
        "id": one.id,
        "words": one.words,
        "because": one.because,
        "protocol": one.protocol,
        "seeds": seeds_behind(one, results),
        "rule": one.rule,
        "verdict": one.verdict(results),
        "numbers": tuple(map(minus, finding.numbers)) if finding else (),
        "command": " && ".join(f"gnm sweep {name} --size {size}" for name in one.needs),
    }
