"""The site builds without a warning, leads nowhere dead, and holds every public name."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.docs.pages import DOCS, ROOT

pytest.importorskip("sphinx")
pytest.importorskip("furo")

LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src"}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; tutorials are not run for it, since a test of their own runs them."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-b", "html"]
    command += ["-D", "plot_gallery=0", "-d", str(folder / "doctrees"), str(DOCS)]
    command += [str(folder / "html")]
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    built = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths}
    )
    assert built.returncode == 0, built.stderr
    return folder / "html"


class Page(HTMLParser):
    """Links, anchors and what the browser loads by itself."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        found = dict(attributes)
        if found.get("id"):
            self.anchors.add(str(found["id"]))
        if tag == "a" and found.get("href"):
            self.links.append(str(found["href"]))
        if tag in LOADS and found.get(LOADS[tag]):
            self.loads.append(str(found[LOADS[tag]]))
        if tag == "link" and found.get("rel") != "canonical" and found.get("href"):
            self.loads.append(str(found["href"]))


def html_pages(site: Path) -> Iterator[tuple[Path, Page]]:
    for path in sorted(site.rglob("*.html")):
        yield path, Page(path.read_text(encoding="utf-8"))


def test_internal_links_lead_somewhere(site: Path) -> None:
    parsed = dict(html_pages(site))
    dead = []
    for path, page in parsed.items():
        if path.is_relative_to(site / "_modules"):
            continue  # listings by Sphinx, which leads back under a name by which it also found it
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            known = parsed.get(target)
            missing = known and parts.fragment and unquote(parts.fragment) not in known.anchors
            if not target.exists() or missing:
                dead.append(f"{path.relative_to(site)}: {link}")
    assert dead == []


def test_nothing_is_loaded_from_another_host(site: Path) -> None:
    outside = [
        f"{path.relative_to(site)}: {load}"
        for path, page in html_pages(site)
        for load in page.loads
        if urlsplit(load).netloc
    ]
    outside += [
        f"{path.relative_to(site)}: {url}"
        for path in site.rglob("*.css")
        for url in re.findall(r"(?:url\(|@import )[\"']?(https?:[^)\"']+)", path.read_text())
    ]
    assert outside == []


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    from sphinx.util.inventory import InventoryFile

    inventory = InventoryFile.loads((site / "objects.inv").read_bytes(), uri="")
    objects = {
        name
        for kind, names in inventory.data.items()
        if kind.startswith("py:") and kind != "py:module"
        for name in names
    }
    sys.path.insert(0, str(DOCS / "extensions"))
    try:
        from public_names import public_names
    finally:
        sys.path.remove(str(DOCS / "extensions"))
    names = public_names()
    assert len(names) > 40
    assert {name for name, public in names.items() if public.path not in objects} == set()


def test_every_registered_environment_has_a_page(site: Path) -> None:
    import gymnasium as gym

    from gnm_env.levels import LEVELS

    levels = {id for level in LEVELS for id in (level.trial_id, level.stream_id)}
    ids = {spec.id for spec in gym.registry.values() if spec.namespace == "gnm"}
    assert levels < ids
    for id_ in ids - levels:
        text = (site / "environments" / f"{id_.replace('/', '-')}.html").read_text()
        for section in ("Action Space", "Observation Space", "Rewards", "Starting State",
                        "Episode End", "Arguments", "Version History"):  # fmt: skip
            assert f">{section}<" in text, (id_, section)


def test_pictures_say_what_they_show(site: Path) -> None:
    silent = [
        f"{path.relative_to(site)}: {tag}"
        for path in site.rglob("*.html")
        for tag in re.findall(r"<img [^>]*>", path.read_text())
        if not re.search(r'alt="[^"]+"', tag) and "_thumb.png" not in tag  # beside its title
    ]
    assert silent == []


def test_no_page_is_wider_than_the_screen_and_every_picture_shows(site: Path) -> None:
    """On a phone and on a laptop: tables and code scroll in their frames, not the page."""
    playwright = pytest.importorskip("playwright.sync_api")
    from agents.commands.check_report import browser

    if browser() is None:
        pytest.skip("Chromium is not installed")
    measure = """() => [
        document.documentElement.scrollWidth,
        [...document.images].filter(one => one.complete && !one.naturalWidth).length,
    ]"""
    pages = [page for page in site.rglob("*.html") if "_modules" not in page.parts]
    wrong = {}
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=browser(), args=["--no-sandbox"])
        screen = chromium.new_page()
        for page in pages:
            screen.goto(page.as_uri())
            for width in (390, 1280):
                screen.set_viewport_size({"width": width, "height": 844})
                found = screen.evaluate(measure)
                if found != [width, 0]:
                    wrong[page.relative_to(site).as_posix(), width] = found
        chromium.close()
    assert len(pages) > 40
    assert wrong == {}
