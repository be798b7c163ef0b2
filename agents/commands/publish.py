"""Keep a finished report in docs/reproduction: figures, claims and, packed, the stores.

    gnm publish --size paper
    gnm publish --size quick --stores

Each size has a folder of its own: claims.md, claims.json, figures/NAME.png and .pdf, and with
--stores one zip per experiment. Unpacked into results/SIZE/NAME, it is the store that it was.
"""

from __future__ import annotations

import argparse
import json
import shutil
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from agents.commands.terminal import REPORT, RESULTS, Parser, share
from agents.experiments.store import read

DOCS = Path("docs") / "reproduction"
KEPT = ("png", "pdf")


def options(parser: Parser) -> None:
    share(parser, "--size")
    parser.add_argument("--stores", action="store_true", help="keep the stores too")
    share(parser, "--results")
    parser.add_argument("--report", type=Path, default=REPORT, help=f"(default {REPORT})")
    share(parser, "--out", default=DOCS)


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Replace what is kept of one size."""
    found = claims(options.report, options.size)
    results = options.results or RESULTS / options.size
    target = options.out / options.size
    stores = [store["name"] for store in found["stores"]] if options.stores else []
    with replaced(target) as fresh:
        (fresh / "figures").mkdir()
        for suffix in KEPT:
            for picture in sorted((options.report / "figures").glob(f"*.{suffix}")):
                shutil.copy(picture, fresh / "figures")
        shutil.copy(options.report / "claims.json", fresh)
        (fresh / "claims.md").write_text(page(found), encoding="utf-8")
        packed = [pack(results / name, fresh / "stores").relative_to(fresh) for name in stores]
    print(f"{len(found['claims'])} claims and {len(packed)} stores in {target}")
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


def claims(report: Path, size: str) -> dict[str, Any]:
    """What claims.json of a report says; ValueError if there is none, or of another size."""
    try:
        found: dict[str, Any] = json.loads((report / "claims.json").read_text("utf-8"))
    except FileNotFoundError:
        raise ValueError(f"there is no report in {report}; run gnm reproduce first") from None
    if found["size"] != size:
        raise ValueError(
            f"{report} is a report of size {found['size']!r}, not {size!r}; "
            f"run gnm report --size {size} first"
        )
    return found


def page(found: dict[str, Any]) -> str:
    """The claims as Markdown: what was found, the verdicts, and what it took."""
    lines = [
        f"# The claims at {found['size']} size",
        "",
        "Written by `gnm publish`. The rules of the verdicts stand in claims.json",
        "and beside the experiments; how it is all made: [reproduction.md](../../reproduction.md).",
        "",
        "| claim | in short | found | verdict |",
        "|---|---|---|---|",
        *(
            _row(row["id"], row["words"], "<br>".join(row["numbers"]), f"**{row['verdict']}**")
            for row in found["claims"]
        ),
        "",
        "| experiment | blocks | time | work of all threads | version |",
        "|---|---|---|---|---|",
        *(
            _row(store["name"], store["blocks"], store["wall"], store["work"], store["commits"])
            for store in found["stores"]
        ),
    ]
    return "\n".join(lines) + "\n"


def _row(*cells: Any) -> str:
    return "| " + " | ".join(str(cell).replace("|", r"\|") for cell in cells) + " |"


def pack(store: Path, folder: Path) -> Path:
    """A store as one zip file; StoreError if it is not finished, or damaged."""
    read(store)
    folder.mkdir(exist_ok=True)
    archive = folder / f"{store.name}.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted(store.rglob("*")):
            if path.is_file():
                file.write(path, path.relative_to(store))
    return archive
