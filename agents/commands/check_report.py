"""Open the report in headless Chromium: no errors, a table that sorts, and screenshots.

    gnm check-report results/report/index.html

Screenshots of a wide and of a narrow window are left beside the page.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from agents.commands.terminal import REPORT, Parser

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WINDOWS = {"wide": (1280, 2400), "narrow": (400, 2400)}
SECONDS = 60
_OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--hide-scrollbars", "--enable-logging=stderr", "--v=0", "--virtual-time-budget=5000",
)  # fmt: skip


def browser() -> str | None:
    """Path of Chromium: the one that $CHROMIUM names, or the first that is installed."""
    named = os.environ.get("CHROMIUM")
    return named or next((path for path in map(shutil.which, BROWSERS) if path), None)


def visit(chromium: str, url: str, *options: str) -> tuple[str, list[str]]:
    """Open `url`; returns the standard output, and the lines of the page's console."""
    with tempfile.TemporaryDirectory() as profile:
        ended = subprocess.run(
            [chromium, *_OPTIONS, f"--user-data-dir={profile}", *options, url],
            capture_output=True, text=True, timeout=SECONDS,
        )  # fmt: skip
    if ended.returncode != 0:
        raise OSError(f"{chromium} ended with code {ended.returncode}: {ended.stderr[-300:]}")
    return ended.stdout, [line for line in ended.stderr.splitlines() if "CONSOLE" in line]


def ids(html: str) -> list[str]:
    """Ids of the claims in the order in which the table shows them."""
    return re.findall(r'<tr data-id="([^"]+)"', html)


def seconds(html: str) -> list[float]:
    """Durations in that order."""
    return [float(text) for text in re.findall(r'data-seconds="([^"]+)"', html)]


def outside(html: str) -> list[str]:
    """Addresses that the page would load from elsewhere."""
    sources = re.findall(r'(?:src|href)="([^"]+)"', html)
    return [source[:80] for source in sources if not source.startswith(("data:", "#"))]


def check(page: Path, chromium: str) -> dict[str, Any]:
    """Check the page; returns what was found. Raises ValueError if anything is wrong."""
    if not page.is_file():
        raise ValueError(f"there is no report at {page}: run gnm reproduce first")
    html = page.read_text(encoding="utf-8")
    if outside(html):
        raise ValueError(f"the page must stand alone, but loads {outside(html)[0]}")
    url = page.resolve().as_uri()
    _, console = visit(chromium, url)
    by_duration, more = visit(chromium, f"{url}#sort=-seconds", "--dump-dom")
    if console or more:
        raise ValueError(f"the page wrote to its console: {(console + more)[0]}")
    if sorted(ids(by_duration)) != sorted(ids(html)) or not ids(html):
        raise ValueError("sorting lost or repeated a claim")
    if seconds(by_duration) != sorted(seconds(html), reverse=True):
        raise ValueError("the table did not sort by duration")
    shots = {name: screenshot(page, chromium, name) for name in WINDOWS}
    return {"page": str(page), "claims": len(ids(html)), "screenshots": shots}


def screenshot(page: Path, chromium: str, name: str) -> str:
    """Take the picture of one window; returns its path."""
    path = page.resolve().parent / f"screenshot-{name}.png"
    width, height = WINDOWS[name]
    visit(
        chromium, page.resolve().as_uri(), f"--screenshot={path}", f"--window-size={width},{height}"
    )
    if not path.is_file():
        raise OSError(f"{chromium} made no screenshot at {path}")
    return str(path)


def options(parser: Parser) -> None:
    page = REPORT / "index.html"
    parser.add_argument("page", type=Path, nargs="?", default=page, help=f"(default {page})")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Check the page that the command line names."""
    chromium = browser()
    if chromium is None:
        print(
            "check-report: skipped, Chromium is not installed (Debian and Ubuntu: apt install "
            "chromium; elsewhere set CHROMIUM to its path)",
            file=sys.stderr,
        )
        return {"skipped": True}
    found = check(options.page, chromium)
    print(f"{found['page']}: {found['claims']} claims, sorts, no console messages")
    for path in found["screenshots"].values():
        print(path)
    return found
