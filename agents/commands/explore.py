"""Explore a neuron in the browser: move a slider, and it learns anew at once.

    gnm explore
    gnm explore --import my_neurons.py --link "neuron=mine&n.alpha=0.1"

The page is served to this machine alone, by the code that trains and scores everywhere else, and
loads nothing from elsewhere. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import webbrowser
from typing import Any
from urllib.parse import parse_qsl

from agents.commands.terminal import Parser, Stopped, at_least
from agents.registry import load_module
from gnm_env.checks import whole

PORT = 8765


def options(parser: Parser) -> None:
    add = parser.add_argument
    # fmt: off
    add("--port", type=at_least(0), metavar="N",
        help=f"(default {PORT}, or any that is free where that is taken; 0: any that is free)")
    add("--no-browser", action="store_true", help="print the address, open nothing")
    add("--link", default="", metavar="STATE", help="what the page begins with: what stands in "
        "the address after the question mark")
    add("--import", dest="modules", action="append", default=[], metavar="MODULE",
        help="a module or file.py with neurons and rules of yours; may be given several times")
    # fmt: on


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Serve the page until Ctrl-C."""
    from agents.explorer.server import serve
    from agents.explorer.settings import parse

    for module in options.modules:
        load_module(module)
    link = dict(parse_qsl(options.link, keep_blank_values=True))
    for state in (dict(parse_qsl(link.pop("versus", ""), keep_blank_values=True)), link):
        parse(state)  # refuses what means nothing
    if options.port is not None:
        whole("--port", options.port, low=0, high=65_535)

    def ready(address: str) -> None:
        link = f"{address}?{options.link}" if options.link else address
        print(f"{link}\nCtrl-C ends it.", flush=True)
        if not options.no_browser and not webbrowser.open(link):
            print("no browser could be opened: open the address yourself", file=sys.stderr)

    try:
        asyncio.run(_serve_on(options.port, ready, serve))
    except KeyboardInterrupt:
        raise Stopped("the page is closed", {"stopped": True}) from None
    return {}


async def _serve_on(port: int | None, ready: Any, serve: Any) -> None:
    try:
        await serve(PORT if port is None else port, ready)
    except OSError as error:
        if port is not None:
            raise ValueError(
                f"port {port} cannot be used ({error.strerror}): choose another with --port, "
                "or leave it out"
            ) from None
        await serve(0, ready)
