"""The report: every figure, and a verdict on every claim of the paper, on one page.

The page needs no network. Verdicts follow from the stores by the rules beside the experiments.
"""

from __future__ import annotations

import base64
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from agents.experiments.figures import draw, load
from agents.experiments.forest import described, small
from agents.experiments.listing import claims, experiments, pictures
from agents.experiments.progress import duration
from agents.experiments.provenance import commit, software
from agents.experiments.store import Summary, summarise
from agents.experiments.table import reference
from agents.experiments.verdict import (
    MISSING,
    NOT_REPRODUCED,
    REPRODUCED,
    Claim,
    Hypothesis,
    Results,
)
from agents.plotting import save, styled

TEMPLATE = Path(__file__).parent / "report_template.html"
_NONE: Mapping[str, str] = {}
FORENSICS = "forensics"
"""Folder beside the page with what `gnm forensics` found."""
FORESTS = "forests"
"""Folder beside the page with the forest plots of single claims."""


def _row(claim: Claim, results: Results, costs: Mapping[str, Summary], size: str) -> dict[str, Any]:
    """One claim as the page shows it."""
    finding = claim.finding(results)
    absent = [name for name in claim.needs if name not in results]
    verdict = finding.verdict if finding else MISSING
    numbers = finding.numbers if finding else (f"no data: {', '.join(absent)}",)
    seconds = sum(costs[name].wall for name in claim.needs if name in costs)
    return {
        "id": claim.id,
        "where": claim.where,
        "words": claim.words,
        "protocol": claim.protocol,
        "seeds": seeds_behind(claim, results),
        "rule": claim.rule,
        "numbers": tuple(map(minus, numbers)),
        "verdict": verdict,
        "kind": {REPRODUCED: "yes", NOT_REPRODUCED: "no", MISSING: "missing"}.get(verdict, "if"),
        "environment": claim.environment,
        "seconds": round(seconds, 1),
        "duration": duration(seconds) if finding else "–",
        "command": " && ".join(f"gnm sweep {name} --size {size}" for name in claim.needs),
        "forest": described(finding.forest) if finding and finding.forest else None,
    }


def _forests(results: Results, folder: Path) -> dict[str, str]:
    """The forest plots of the claims that have one, as data URLs by id."""
    drawn = {}
    for claim in claims():
        finding = claim.finding(results)
        if finding and finding.forest:
            with styled():
                picture = save(small(finding.forest), folder, claim.id, ("svg",))["svg"]
            drawn[claim.id] = _inline(picture)
    return drawn


def minus(text: str) -> str:
    """Hyphens before numbers as minus signs."""
    return re.sub(r"(?<![\w…])-(?=[\d.])", "−", text)


def seeds_behind(claim: Claim | Hypothesis, results: Results) -> str:
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


def page(
    told: Mapping[str, Any],
    figures: list[dict[str, str]],
    forests: Mapping[str, str] = _NONE,
    forensics: Mapping[str, Any] | None = None,
) -> str:
    """The HTML of the whole report.

    Args:
        told: what claims.json holds.
        figures: name, caption and source (a data URL) of each figure that was drawn.
        forests: the forest plot of a claim (a data URL) by its id.
        forensics: what forensics.json holds, with the source of its figure.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATE.parent), autoescape=True, undefined=StrictUndefined
    )
    drawn = [figure["name"] for figure in figures]
    return environment.get_template(TEMPLATE.name).render(
        {**told, "figures": figures},
        counts=Counter(row["kind"] for row in told["claims"]),
        forests=forests,
        forensics=forensics,
        undrawn=[name for name in pictures() if name not in drawn],
        total=duration(sum(store["seconds"] for store in told["stores"])),
    )


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


def shown_forensics(folder: Path, size: str) -> dict[str, Any] | None:
    """What `gnm forensics` left in a folder, if it is of that size."""
    path = folder / "forensics.json"
    found: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.exists() else {}
    if found.get("size") != size:
        return None
    return {**found, "source": _inline(folder / "figures" / "FORENSICS.svg")}


def record(results: Results, costs: Mapping[str, Summary], size: str) -> dict[str, Any]:
    """All that the report tells, ready for JSON."""
    return {
        "size": size,
        "software": software(),
        "commit": commit(),
        "claims": [_row(claim, results, costs, size) for claim in claims()],
        "table": {n: [asdict(cell) for cell in cells] for n, cells in reference(results).items()},
        "figures": {
            name: picture.full_caption(results)
            for name, picture in pictures().items()
            if all(need in results for need in picture.needs)
        },
        "stores": stores(costs),
    }


def write(folder: Path, size: str, out: Path) -> dict[str, Any]:
    """Judge, draw and write: index.html, claims.json and figures/ in `out`.

    Raises ValueError if there is no finished store in `folder`, StoreError if one is damaged.
    """
    results, absent = load(folder, list(experiments()))
    if not results:
        raise ValueError(
            f"there is no finished experiment in {folder}: run gnm reproduce --size {size} first"
        )
    costs = {name: summarise(folder / name) for name in results}
    told = record(results, costs, size)
    figures = [
        {"name": name, "caption": told["figures"][name], "source": _inline(paths["svg"])}
        for name, paths in draw(pictures(), results, out / "figures").items()
    ]
    out.mkdir(parents=True, exist_ok=True)
    forests = _forests(results, out / FORESTS)
    html = page(told, figures, forests, shown_forensics(out / FORENSICS, size))
    (out / "index.html").write_text(html, encoding="utf-8")
    text = json.dumps(told, indent=1, ensure_ascii=False)
    (out / "claims.json").write_text(text + "\n", encoding="utf-8")
    return {
        "report": str(out / "index.html"),
        "verdicts": {row["id"]: row["verdict"] for row in told["claims"]},
        "missing": absent,
    }
