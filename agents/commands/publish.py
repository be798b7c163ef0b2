"""Keep a finished report in docs/reproduction: figures, claims and, packed, the stores.

    gnm publish --size paper
    gnm publish --size quick --stores
    gnm publish --findings --size paper    what gnm findings found, in docs/findings
    gnm publish --forensics --size paper   what gnm forensics found, in docs/forensics
    gnm publish --size paper --merge       only what was judged anew; all else stays

Each size has a folder of its own: claims.md, claims.json, figures/NAME.png and .pdf, the forest
plots of single claims, and with --stores one zip per experiment. Unpacked into results/SIZE/NAME,
it is the store that it was.
"""

from __future__ import annotations

import argparse
import json
import shutil
import zipfile
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from agents.commands.findings import FINDINGS
from agents.commands.forensics import FORENSICS
from agents.commands.terminal import REPORT, RESULTS, Parser, share
from agents.experiments import forensics_page
from agents.experiments.former_names import standing
from agents.experiments.report import FORESTS
from agents.experiments.store import read
from agents.experiments.verdict import MISSING

KEPT = ("png", "pdf")


class Kind(NamedTuple):
    """What may be kept: the name of its file, the command that writes it, and both folders."""

    name: str
    verb: str
    report: Path
    docs: Path


CLAIMS = Kind("claims", "reproduce", REPORT, Path("docs") / "reproduction")
FOUND = Kind("findings", "findings", FINDINGS, Path("docs") / "findings")
SOUGHT = Kind("forensics", "forensics", FORENSICS, Path("docs") / "forensics")


def options(parser: Parser) -> None:
    share(parser, "--size")
    parser.add_argument(
        "--findings", action="store_true", help="keep the findings beyond the paper, not its claims"
    )
    parser.add_argument(
        "--forensics", action="store_true", help="keep what explains the paper's numbers best"
    )
    parser.add_argument("--stores", action="store_true", help="keep the stores too")
    parser.add_argument(
        "--merge",
        action="store_true",
        help="leave what the report says nothing of (verdict “missing”) as it is kept",
    )
    share(parser, "--results")
    parser.add_argument(
        "--report",
        type=Path,
        metavar="FOLDER",
        help=f"(default {REPORT}, {FINDINGS} or {FORENSICS})",
    )
    share(parser, "--out", help=f"(default {CLAIMS.docs}, {FOUND.docs} or {SOUGHT.docs})")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Replace what is kept of one size."""
    if options.findings and options.forensics:
        raise ValueError("--findings and --forensics are kept one by one: leave one out")
    if options.merge and options.forensics:
        raise ValueError("the forensics are one whole: leave --merge out")
    kind = FOUND if options.findings else SOUGHT if options.forensics else CLAIMS
    report = options.report or kind.report
    found = told(kind, report, options.size)
    results = options.results or RESULTS / options.size
    target = (options.out or kind.docs) / options.size
    stores = [store["name"] for store in found["stores"]] if options.stores else []
    if options.merge:
        found = merged(kind, told(kind, target, options.size), found)
    with replaced(target) as fresh:
        for part in ("figures", FORESTS, "stores"):
            if options.merge and (target / part).exists():
                shutil.copytree(target / part, fresh / part)
        for part, kept in (("figures", KEPT), (FORESTS, ("svg",))):
            pictures = [p for suffix in kept for p in sorted((report / part).glob(f"*.{suffix}"))]
            if pictures:
                (fresh / part).mkdir(exist_ok=True)
            for picture in pictures:
                shutil.copy(picture, fresh / part)
        drawn = frozenset(path.stem for path in (fresh / FORESTS).glob("*.svg"))
        text = forensics_page.page(found) if kind is SOUGHT else page(kind, found, drawn)
        shutil.copy(report / f"{kind.name}.json", fresh)
        if options.merge:
            joined = json.dumps(found, indent=1, ensure_ascii=False)
            (fresh / f"{kind.name}.json").write_text(joined + "\n", encoding="utf-8")
        (fresh / f"{kind.name}.md").write_text(text, encoding="utf-8")
        packed = [pack(results / name, fresh / "stores").relative_to(fresh) for name in stores]
    what = f"{len(found[kind.name])} {kind.name}" if kind.name in found else kind.name
    print(f"{what} and {len(packed)} stores in {target}")
    return {"folder": str(target), "stores": [str(target / path) for path in packed]}


@contextmanager
def replaced(folder: Path) -> Iterator[Path]:
    """An empty folder beside `folder`, to be filled; without an error it takes `folder`'s place."""
    fresh, old = (folder.with_name(folder.name + ending) for ending in (".partial", ".old"))
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    try:
        yield fresh
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        raise
    if folder.exists():
        shutil.rmtree(old, ignore_errors=True)
        folder.rename(old)
    fresh.rename(folder)
    shutil.rmtree(old, ignore_errors=True)


def told(kind: Kind, report: Path, size: str) -> dict[str, Any]:
    """What the JSON file of a report says; ValueError if there is none, or of another size."""
    try:
        found: dict[str, Any] = json.loads((report / f"{kind.name}.json").read_text("utf-8"))
    except FileNotFoundError:
        raise ValueError(f"there is no report in {report}; run gnm {kind.verb} first") from None
    if found["size"] != size:
        again = "report" if kind is CLAIMS else "findings --judge"
        raise ValueError(
            f"{report} is a report of size {found['size']!r}, not {size!r}; "
            f"run gnm {again} --size {size} first"
        )
    return found


def merged(kind: Kind, kept: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """What is kept, with what `found` judged, drew and computed in its place or added to it.

    A row that `found` could not judge stays as it is kept. Raises ValueError where such a row is
    not kept, or was judged by another rule than the one that stands now.
    """
    before = {row["id"]: row for row in kept[kind.name]}
    rows = []
    for row in found[kind.name]:
        old = before.get(row["id"])
        if row["verdict"] != MISSING:
            rows.append(row)
        elif old is None or old["rule"] != row["rule"]:
            why = "is not kept" if old is None else "was judged by another rule"
            raise ValueError(
                f"{row['id']} has no verdict in this report, and {why}: run its experiments "
                f"({row['command']}) and gnm {kind.verb} first"
            )
        else:
            rows.append(old)
    stores = {store["name"]: store for store in (*kept["stores"], *found["stores"])}
    joined = {**found, kind.name: rows, "stores": list(stores.values())}
    for part in ("figures", "table"):
        if part in found:
            new = {name: value for name, value in found[part].items() if value}
            joined[part] = {**kept.get(part, {}), **new}
    return joined


def page(kind: Kind, found: dict[str, Any], forests: Set[str] = frozenset()) -> str:
    """The claims or findings as Markdown: what was found, the verdicts, and what it took.

    `forests` are the ids that have a forest plot beside the page.
    """
    about = "../../reproduction.md" if kind is CLAIMS else "../../findings.md"
    lines = [
        f"# The {kind.name} at {found['size']} size",
        "",
        f"Written by `gnm publish`. The rules of the verdicts stand in {kind.name}.json",
        f"and beside the experiments; how it is all made: [{Path(about).name}]({about}).",
        "",
        f"| {'claim' if kind is CLAIMS else 'expected'} | in short | found | verdict |",
        "|---|---|---|---|",
        *(
            _row(row["id"], row["words"], _numbers(row, forests), f"**{row['verdict']}**")
            for row in found[kind.name]
        ),
        "",
        *_pictures(found.get("figures", {})),
        "| experiment | blocks | time | work of all threads | version |",
        "|---|---|---|---|---|",
        *(
            _row(store["name"], store["blocks"], store["wall"], store["work"], store["commits"])
            for store in found["stores"]
        ),
    ]
    return "\n".join(lines) + "\n"


def _numbers(row: Mapping[str, Any], forests: Set[str]) -> str:
    """What was found, and its forest plot where there is one."""
    plot = [f"![{row['id']}: ours beside the paper's]({FORESTS}/{row['id']}.svg)"]
    return "<br>".join([*row["numbers"], *(plot if row["id"] in forests else [])])


def _pictures(captions: Mapping[str, str]) -> list[str]:
    """Every figure with its caption below."""
    return [
        line
        for name, caption in captions.items()
        for line in (f"![{name}](figures/{name}.png)", "", f"*{name}: {caption}*", "")
    ]


def _row(*cells: Any) -> str:
    return "| " + " | ".join(str(cell).replace("|", r"\|") for cell in cells) + " |"


def pack(store: Path, folder: Path) -> Path:
    """A store as one zip file; StoreError if it is not finished, or damaged."""
    read(store)
    folder.mkdir(exist_ok=True)
    archive = folder / f"{store.name}.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted(standing(store).rglob("*")):
            if path.is_file():
                file.write(path, path.relative_to(standing(store)))
    return archive
