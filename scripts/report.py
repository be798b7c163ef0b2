"""Write the report: every figure, and a verdict on every claim of the paper, on one page.

    python scripts/report.py --size paper

The page needs no network. Verdicts follow from the stores by the rules beside the experiments.
"""

from __future__ import annotations

import argparse
import base64
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import commandline

with commandline.imports("report", "reproduce"):
    import xarray as xr
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    from agents import mistake_rate
    from experiments.claims import CLAIMS
    from experiments.methods import REFERENCE
    from experiments.registry import NAMES, SIZES
    from experiments.statistics import by_seed, mean, median, score
    from experiments.verdict import MISSING, NOT_REPRODUCED, REPRODUCED, Claim
    from figures import PICTURES, RESULTS, caption, draw, load
    from progress import duration
    from provenance import commit, software
    from store import Summary, summarise

REPORT = RESULTS / "report"
TEMPLATE = Path(__file__).parent / "report_template.html"


@dataclass(frozen=True)
class Row:
    """One claim as the page shows it."""

    id: str
    where: str
    words: str
    protocol: str
    seeds: str
    rule: str
    numbers: tuple[str, ...]
    verdict: str
    kind: str
    environment: str
    seconds: float
    duration: str
    command: str


@dataclass(frozen=True)
class Cell:
    """One entry of the reference table."""

    mean: str
    median: str
    mistakes: str
    reference: str
    ratio: float


def rows(results: Mapping[str, xr.Dataset], costs: Mapping[str, Summary], size: str) -> list[Row]:
    """All claims with what was found."""
    return [_row(claim, results, costs, size) for claim in CLAIMS]


def _row(
    claim: Claim, results: Mapping[str, xr.Dataset], costs: Mapping[str, Summary], size: str
) -> Row:
    finding = claim.finding(results)
    absent = [name for name in claim.needs if name not in results]
    verdict = finding.verdict if finding else MISSING
    seconds = sum(costs[name].wall for name in claim.needs if name in costs)
    return Row(
        id=claim.id,
        where=claim.where,
        words=claim.words,
        protocol=claim.protocol,
        seeds=_seeds(claim, results),
        rule=claim.rule,
        numbers=tuple(map(_minus, finding.numbers))
        if finding
        else (f"no data: {', '.join(absent)}",),
        verdict=verdict,
        kind={REPRODUCED: "yes", NOT_REPRODUCED: "no", MISSING: "missing"}.get(verdict, "if"),
        environment=claim.environment,
        seconds=round(seconds, 1),
        duration=duration(seconds) if finding else "–",
        command=" && ".join(
            f"python scripts/sweep.py {name} --size {size}" for name in claim.needs
        ),
    )


def _minus(text: str) -> str:
    """Hyphens before numbers as minus signs."""
    return re.sub(r"(?<![\w…])-(?=[\d.])", "−", text)


def _seeds(claim: Claim, results: Mapping[str, xr.Dataset]) -> str:
    """How many pattern seeds stand behind the numbers."""
    counts = {
        name: results[name].sizes["pattern_seed"]
        for name in claim.needs
        if name in results and "pattern_seed" in results[name].sizes
    }
    if not counts:
        return ""
    if len(set(counts.values())) == 1:
        return f"{next(iter(counts.values()))} pattern seeds"
    return "pattern seeds: " + ", ".join(f"{name} {count}" for name, count in counts.items())


def reference(results: Mapping[str, xr.Dataset]) -> dict[str, list[Cell]]:
    """The reference table: for each learner one cell per number of classes; empty without data."""
    if "table" not in results:
        return {}
    data = results["table"]
    return {
        name: [
            _cell(data.sel(classes=classes, learner=name), expected)
            for classes, expected in zip(data["classes"].to_numpy(), REFERENCE[name], strict=True)
        ]
        for name in REFERENCE
    }


def _cell(data: xr.Dataset, expected: tuple[int, int]) -> Cell:
    scores = by_seed(score(data))
    cap = data.attrs["settings"]["common"]["cap"]
    average, rate = mean(scores), mistake_rate(data["survived"], cap)
    return Cell(
        f"{average:,.0f}",
        f"{median(scores).value:,.0f}",
        f"{rate.rate:.2g} [{rate.low:.2g} … {rate.high:.2g}]",
        f"{expected[0]:,} / {expected[1]:,}",
        round(average.value / expected[0], 2),
    )


def page(
    claims: list[Row],
    table: dict[str, list[Cell]],
    pictures: Mapping[str, Mapping[str, Path]],
    captions: Mapping[str, str],
    costs: Mapping[str, Summary],
    size: str,
) -> str:
    """The HTML of the whole report."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATE.parent), autoescape=True, undefined=StrictUndefined
    )
    return environment.get_template(TEMPLATE.name).render(
        size=size,
        claims=claims,
        counts=Counter(row.kind for row in claims),
        table=table,
        figures=[
            {"name": name, "caption": captions[name], "source": _inline(paths["svg"])}
            for name, paths in pictures.items()
        ],
        undrawn=[name for name in PICTURES if name not in pictures],
        stores=stores(costs),
        total=duration(sum(cost.wall for cost in costs.values())),
        software=software(),
        commit=commit()[:10],
    )  # fmt: skip


def stores(costs: Mapping[str, Summary]) -> list[dict[str, Any]]:
    """What each store cost, and which versions made it."""
    return [
        {
            "name": name,
            "blocks": cost.blocks,
            "wall": duration(cost.wall),
            "work": duration(cost.seconds),
            "seconds": round(cost.wall, 1),
            "commits": ", ".join(c[:10] + ("+" if c.endswith("+") else "") for c in cost.commits),
        }
        for name, cost in costs.items()
    ]


def _inline(svg: Path) -> str:
    """A picture as a data URL, so that ids of one picture never meet those of another."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.read_bytes()).decode()


def write(folder: Path, size: str, out: Path) -> dict[str, Any]:
    """Judge, draw and write: index.html, claims.json and figures/ in `out`."""
    results, absent = load(folder)
    costs = {name: summarise(folder / name) for name in NAMES if name in results}
    claims = rows(results, costs, size)
    table = reference(results)
    pictures = draw(results, out / "figures")
    out.mkdir(parents=True, exist_ok=True)
    captions = {name: caption(name, results) for name in pictures}
    html = page(claims, table, pictures, captions, costs, size)
    (out / "index.html").write_text(html, encoding="utf-8")
    record = {
        "size": size,
        "software": software(),
        "commit": commit(),
        "claims": [asdict(row) for row in claims],
        "table": {name: [asdict(cell) for cell in cells] for name, cells in table.items()},
        "stores": stores(costs),
    }
    text = json.dumps(record, indent=1, ensure_ascii=False)
    (out / "claims.json").write_text(text + "\n", encoding="utf-8")
    return {
        "report": str(out / "index.html"),
        "verdicts": {row.id: row.verdict for row in claims},
        "missing": absent,
    }


def main(arguments: argparse.Namespace) -> dict[str, Any]:
    """Write the report that the command line asks for."""
    written = write(arguments.results or RESULTS / arguments.size, arguments.size, arguments.out)
    print_verdicts(written)
    return written


def print_verdicts(written: Mapping[str, Any]) -> None:
    """One line per claim, and where the page is."""
    for claim, verdict in written["verdicts"].items():
        print(f"{claim:4s} {verdict}")
    print(f"report: {written['report']}")


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--size", choices=SIZES, default="quick", help="default: %(default)s")
    parser.add_argument("--results", type=Path, help=f"folder of stores; default: {RESULTS}/SIZE")
    parser.add_argument("--out", type=Path, default=REPORT, help="default: %(default)s")
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    return parser.parse_args()


if __name__ == "__main__":
    options = parse()
    commandline.run(lambda: main(options), as_json=options.json, name="report")
