"""What the forensics found, as JSON, as a page and as a picture. Nothing is trained."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.experiments.figures import FORMATS
from agents.experiments.forensics import (
    BEST,
    CAPS,
    HYPOTHESES,
    NUMBERS,
    TRIALS,
    Found,
    Number,
    Scores,
    Size,
    best,
    come_back,
    interval,
    judged,
    kept,
    named,
    points_interval,
    ranking,
    unexplained,
)
from agents.experiments.forest import draw_forest
from agents.experiments.progress import duration
from agents.experiments.provenance import commit, software
from agents.experiments.report import minus, stores
from agents.experiments.statistics import Interval
from agents.experiments.store import read, summarise
from agents.experiments.verdict import DOES_NOT_HOLD, HOLDS, Forest, Mark
from agents.plotting import GREY, WIDE, panels, save, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STAGES = ("FORENSICS-coarse", "FORENSICS-fine", "FORENSICS-confirmed", "CONDITIONS")
PICTURE = "FORENSICS"
_CAPTION = (
    "Each number of the paper (shaded: the band in which it counts as come back; line: the "
    "paper's own, where it gives one) beside that of each protocol on pattern seeds that nothing "
    "was chosen by, with 95 % bootstrap intervals. Above the best three protocols of the search, "
    "below the named conditions at each cap. Blue: come back; red: not."
)
_SHOWN = 10
"""So many protocols of the search are listed."""


def outcome(size: Size, ranked: Sequence[Found], results: Path) -> list[Found]:
    """The confirmed protocols with their scores: the best of the search, then the conditions."""
    ours, others = (Scores(read(results / name)) for name in STAGES[2:])
    return [
        *(Found(one, ours.of(one)) for one in best(size, ranked)),
        *(Found(one, others.of(one)) for one in named(size)),
    ]


def short(found: Sequence[Found]) -> list[str]:
    """Names of the confirmed protocols: search 1, search 2, …, the conditions with their caps."""
    return [f"search {k + 1}" if k < BEST else one.protocol.words for k, one in enumerate(found)]


def write(size: Size, results: Path, name: str, out: Path) -> dict[str, Any]:
    """Judge and draw finished stages: forensics.json, forensics.md and figures/ in `out`."""
    first, second = (read(results / stage) for stage in STAGES[:2])
    tried = ranking(size, first, second)
    found = outcome(size, tried, results)
    costs = {stage: summarise(results / stage) for stage in STAGES}
    told = {
        "size": name,
        "software": software(),
        "commit": commit(),
        "command": f"gnm forensics --size {name}",
        "tried": {
            "ways of training": len(size.ways),
            "protocols": len(size.ways) * 2 * len(TRIALS) * len(CAPS),
            "ways that went on": kept(size),
            "pattern seeds": {
                "coarse": _seeds(size.coarse),
                "fine": _seeds(size.fine),
                "confirmed": _seeds(size.confirmed),
            },
        },
        "numbers": [_number(one) for one in NUMBERS],
        "protocols": sorted(
            (_row(label, one) for label, one in zip(short(found), found, strict=True)),
            key=lambda row: row["rank"],
            reverse=True,
        ),
        "unexplained": [one.words for one in unexplained(found)],
        "hypotheses": [
            {
                "id": key,
                "words": HYPOTHESES[key],
                "verdict": HOLDS if holds else DOES_NOT_HOLD,
                "numbers": minus(numbers),
            }
            for key, (holds, numbers) in judged(found).items()
        ],
        "search": [
            {"name": one.protocol.words, "points": round(one.rank[0], 2), "back": one.rank[1]}
            for one in tried[:_SHOWN]
        ],
        "caption": _CAPTION,
        "stores": stores(costs),
        "work": duration(sum(cost.seconds for cost in costs.values())),
    }
    out.mkdir(parents=True, exist_ok=True)
    with styled():
        save(draw(found), out / "figures", PICTURE, FORMATS)
    text = json.dumps(told, indent=1, ensure_ascii=False)
    (out / "forensics.json").write_text(text + "\n", encoding="utf-8")
    (out / "forensics.md").write_text(page(told), encoding="utf-8")
    return told


def _seeds(seeds: Sequence[int]) -> str:
    return f"{seeds[0]}–{seeds[-1]}" if len(seeds) > 1 else str(seeds[0])


def _number(one: Number) -> dict[str, Any]:
    return {
        "claim": one.id, "words": one.words, "paper": one.paper, "low": one.low, "high": one.high,
        "far": "0.3 in arcsin √x" if one.share else one.far,
    }  # fmt: skip


def _row(label: str, found: Found) -> dict[str, Any]:
    values = [interval(one, found.scores) for one in NUMBERS]
    return {
        "label": label,
        "name": found.protocol.words,
        "rank": found.rank,
        "points": f"{points_interval(found.scores):.1f}",
        "back": come_back(found.scores),
        "seeds": len(found.scores),
        "values": [minus(_shown(one, value)) for one, value in zip(NUMBERS, values, strict=True)],
        "inside": [one.back(v.value) for one, v in zip(NUMBERS, values, strict=True)],
    }


def _shown(one: Number, value: Interval) -> str:
    return f"{value:,.0f}" if one.high > 100 and one.high < 1e6 else f"{value:.2f}"


def page(told: dict[str, Any]) -> str:
    """What was found as Markdown."""
    rows = told["protocols"]
    tried = told["tried"]
    seeds = tried["pattern seeds"]
    lines = [
        f"# Which protocol explains the paper, at {told['size']} size",
        "",
        f"Written by `{told['command']}`; how it is made: "
        f"[reproduction.md](../../reproduction.md). {tried['ways of training']} ways of training, "
        f"{tried['protocols']:,} protocols, on pattern seeds {seeds['coarse']}; "
        f"{tried['ways that went on']} ways on seeds {seeds['fine']} too; what follows is on seeds "
        f"{seeds['confirmed']}. Work: {told['work']}.",
        "",
        f"| protocol | points of {len(NUMBERS)} | numbers that come back |",
        "|---|---|---|",
        *(f"| {_named(row)} | {row['points']} | {row['back']} |" for row in rows),
        "",
        "| expected | verdict | numbers |",
        "|---|---|---|",
        *(f"| {h['words']} | **{h['verdict']}** | {h['numbers']} |" for h in told["hypotheses"]),
        "",
        "Numbers that come back under none of these: "
        + ("; ".join(told["unexplained"]) or "none") + ".",
        "",
        f"![{PICTURE}](figures/{PICTURE}.png)",
        "",
        f"*{told['caption']}*",
        "",
        f"| claim | number | the paper | band | {' | '.join(row['label'] for row in rows)} |",
        "|---" * (4 + len(rows)) + "|",
        *(
            f"| {one['claim']} | {one['words']} | {one['paper']} | {_band(one)} | "
            + " | ".join(
                f"**{row['values'][k]}**" if row["inside"][k] else row["values"][k] for row in rows
            )
            + " |"
            for k, one in enumerate(told["numbers"])
        ),
        "",
        "Bold: in the band. The best protocols of the search on its own seeds:",
        "",
        "| protocol | points | come back |",
        "|---|---|---|",
        *(f"| {row['name']} | {row['points']} | {row['back']} |" for row in told["search"]),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _named(row: dict[str, Any]) -> str:
    return row["name"] if row["label"] == row["name"] else f"{row['label']}: {row['name']}"


def _band(one: dict[str, Any]) -> str:
    return f"≥ {one['low']:g}" if one["high"] > 1e6 else f"{one['low']:g} … {one['high']:g}"


def draw(found: Sequence[Found]) -> Figure:
    """Each number of the paper beside that of each protocol."""
    columns = 3
    rows = -(-len(NUMBERS) // columns)
    figure, grid = panels(rows, columns, width=WIDE, height=1.75 * rows)
    for place, (axes, one) in enumerate(zip(grid.flat, NUMBERS, strict=False)):
        draw_forest(axes, _forest(one, found), names=place % columns == 0)
        axes.axhline(BEST - 0.5, color=GREY, lw=0.6, ls=":")
        axes.set_title(f"{one.words}\nthe paper: {one.paper}", fontsize=6, loc="left")
        axes.tick_params(axis="y", labelsize=5)
    for axes in grid.flat[len(NUMBERS) :]:
        axes.set_visible(False)
    return figure


def _forest(one: Number, found: Sequence[Found]) -> Forest:
    values = [interval(one, each.scores) for each in found]
    marks = (Mark(n, v, one.back(v.value)) for n, v in zip(short(found), values, strict=True))
    return Forest("", one.low, one.high, tuple(marks), one.at, logarithmic=one.high > 2)
