"""The campaign: bad inputs, random tasks, kills and flipped bytes, at any size, with a table.

    python tests/campaign/run.py --size full --jobs 2
    python tests/campaign/run.py --only inputs --owner gnm_env/trial

Exit code 1 if anything crashed, hung, lost something, or was refused by somebody else's traceback.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from tests.campaign.inputs import Case, cases  # noqa: E402  after the path
from tests.campaign.pool import run_cases  # noqa: E402

PARTS = ("inputs", "configurations", "environments", "kills", "flips")
OUTCOMES = ("refused", "fine", "nonsense", "foreign", "crash", "hang")
EVERY = {"small": 25, "full": 1}
"""Every how many-th bad input is tried."""
CONFIGURATIONS = {"small": 6, "full": 500}
ENVIRONMENTS = {"small": 40, "full": 2000}
KILLS = {"small": 6, "full": 100}
FLIPS = {"small": (30, 20), "full": (300, 200)}


def verdict(case: Case, outcome: str) -> str:
    """The outcome, with what was accepted told apart: as good as refused, or nonsense."""
    if outcome in ("accepted", "warned"):
        return "fine" if case.fine or outcome == "warned" else "nonsense"
    return outcome


Result = tuple[Case, str, str]
"""A case, the verdict, and what was said."""


def bad_inputs(
    every: int, jobs: int, timeout: float, owner: str = "", file: Path | None = None, first: int = 0
) -> list[Result]:
    """Every `every`-th case of an owner; what is wrong is kept in `file` while it goes on."""
    everything = cases()
    numbered = list(enumerate(everything))[first:]
    chosen = [n for n, case in numbered if case.owner.startswith(owner)][::every]

    def judged(outcomes: dict[int, tuple[str, str]]) -> list[Result]:
        return [(everything[n], verdict(everything[n], o), s) for n, (o, s) in outcomes.items()]

    def keep(outcomes: dict[int, tuple[str, str]]) -> None:
        if file is not None:
            file.write_text(findings(judged(outcomes)))

    results = run_cases(chosen, jobs, timeout, keep)
    keep(results)
    return judged(results)


def table(results: list[Result]) -> str:
    """One row for each owner, one column for each verdict."""
    rows: dict[str, Counter[str]] = {}
    for case, outcome, _ in results:
        rows.setdefault(case.owner, Counter())[outcome] += 1
    total = sum(rows.values(), Counter())
    width = max(len(owner) for owner in rows)
    lines = [f"{'owner':{width}}" + "".join(f"{name:>10}" for name in OUTCOMES)]
    for owner, row in [*sorted(rows.items()), ("all", total)]:
        lines.append(f"{owner:{width}}" + "".join(f"{row[name] or '·':>10}" for name in OUTCOMES))
    return "\n".join(lines)


def findings(results: list[Result]) -> str:
    """Everything that is not as it should be, by owner, as Markdown."""
    counts = dict(Counter(verdict_ for _, verdict_, _ in results))
    lines = [f"# Bad inputs: {len(results)}: {counts}"]
    for owner in sorted({case.owner for case, _, _ in results}):
        bad = [r for r in results if r[0].owner == owner and r[1] not in ("refused", "fine")]
        if bad:
            lines.append(f"\n## {owner} ({len(bad)})\n")
        for case, outcome, said in sorted(bad, key=lambda r: OUTCOMES[::-1].index(r[1])):
            code = " ⏎ ".join(case.name.splitlines())
            lines.append(f"- **{outcome}** `{code}`" + (f": {said[:240]}" if said else ""))
    return "\n".join(lines) + "\n"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--size", choices=EVERY, default="small", help="default: %(default)s")
    parser.add_argument("--only", choices=PARTS, action="append", help="default: all parts")
    parser.add_argument("--count", type=int, help="of configurations, environments, kills")
    parser.add_argument(
        "--pairs", type=int, default=0, help="of a neuron and a rule; 0: every rule is in one"
    )
    parser.add_argument("--owner", default="", help="bad inputs to these files alone, by prefix")
    parser.add_argument("--first", type=int, default=0, help="bad inputs from this number on")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes (default 1)")
    parser.add_argument(
        "--timeout", type=float, default=120.0, help="seconds per input (default 120)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of all that is random (default 0)")
    parser.add_argument("--findings", type=Path, help="write what is wrong there, as Markdown")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser.parse_args()


def main() -> int:
    """Run the parts asked for, print their tables, and say whether all is well."""
    from tests.campaign import configurations, flips, kills, stores

    options = _arguments()
    summary: dict[str, Any] = {}
    well = True
    for part in options.only or PARTS:
        start = time.monotonic()
        if part == "inputs":
            results = bad_inputs(
                EVERY[options.size], options.jobs, options.timeout, options.owner,
                options.findings, options.first,
            )  # fmt: skip
            counts = Counter(outcome for _, outcome, _ in results)
            print(table(results))
            sound = not any(counts[name] for name in ("foreign", "crash", "hang"))
            sound &= counts["nonsense"] <= 0.01 * len(results)
        else:
            if part == "configurations":
                count = options.count or CONFIGURATIONS[options.size]
                counts = configurations.campaign(count, options.seed, options.pairs)
            elif part == "environments":
                count = options.count or ENVIRONMENTS[options.size]
                counts = configurations.campaign(count, options.seed, part="environments")
            elif part == "kills":
                count = options.count or KILLS[options.size]
                counts = kills.campaign(count, options.seed)
                counts.update(stores.campaign(count, 0, options.seed))
            else:
                checkpoints, others = FLIPS[options.size]
                counts = flips.campaign(checkpoints, others, options.seed)
                counts.update(stores.campaign(0, others, options.seed))
            sound = counts["wrong"] == 0
            print(f"{part}: " + ", ".join(f"{name} {n}" for name, n in counts.items()))
        summary[part] = {**counts, "seconds": round(time.monotonic() - start)}
        well &= sound
    if options.json:
        print(json.dumps(summary))
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
