"""The command line: `gnm VERB …`, one file a verb beside this one.

A verb is a module with

    options(parser)   adds its options; those that several verbs have stand in `terminal.SHARED`
    main(options)     does it, and returns what `--json` prints
    RESUMES           optional: True if a run that was stopped goes on when it is started again

and a docstring, which `gnm VERB --help` shows. Its line in the list of `gnm --help` stands here, so
that the list needs no import of any verb.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from gnm_env import __version__

VERBS = {
    "train": "train a neuron or a network; score it, save it, draw it",
    "evaluate": "score a saved agent of any kind",
    "show": "draw how a neuron works",
    "explore": "move sliders in the browser and see a neuron learn anew",
    "watch": "see a saved agent answer, in a window or as a GIF or MP4",
    "card": "write a model card with a replay beside a saved agent",
    "train-rl": "train a Stable-Baselines3 agent on the aggregate label",
    "sweep": "compute an experiment, the paper's or your own, into its store",
    "reproduce": "run the paper's experiments and write the report",
    "findings": "ask what the paper could not: run, judge and draw it",
    "forensics": "find the protocol that explains the paper's numbers best",
    "figures": "draw the paper's figures from finished experiments",
    "report": "place agents of your own in the league; or judge the paper's claims",
    "reference-table": "print every neuron and rule on one to four classes",
    "league": "neurons, network and RL agents in one table",
    "speech": "hear a word in speech, told only how often it was said",
    "chemistry": "a trained continuous neuron as a chemical reaction network",
    "publish": "keep a finished report in docs/reproduction",
    "check-report": "open the report in headless Chromium and look for errors",
}

EXTRAS = {
    "chemistry": ("chemistry", "reproduce"),
    "league": ("reproduce", "rl"),
    "reproduce": ("chemistry", "reproduce"),
}
"""What a verb needs of extras, where it is more than one: they are named together."""


def main(words: Sequence[str] | None = None) -> None:
    """Run `gnm` with the given command line, by default that of the process, and end it."""
    width = max(map(len, VERBS))
    parser = argparse.ArgumentParser(
        prog="gnm",
        usage="gnm VERB [options]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description="\n".join(f"  {verb:{width}}  {what}" for verb, what in VERBS.items()),
        epilog="gnm VERB --help tells the options of a verb.",
    )
    parser.add_argument("--version", action="version", version=f"gnm {__version__}")
    parser.add_argument("verb", help=argparse.SUPPRESS)
    parser.add_argument("rest", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    given = list(sys.argv[1:] if words is None else words)
    chosen = parser.parse_args(given or ["--help"])
    if chosen.verb not in VERBS:
        print(f"gnm: there is no verb {chosen.verb!r}: one of {', '.join(VERBS)}", file=sys.stderr)
        sys.exit(2)
    run(chosen.verb, chosen.rest, f"gnm {chosen.verb}")


def run(verb: str, words: Sequence[str] | None = None, name: str | None = None) -> None:
    """Run one verb and end the process. `words` and `name`: by default those of the process."""
    from agents.commands import terminal

    terminal.run(
        lambda: importlib.import_module(f"agents.commands.{verb.replace('-', '_')}"),
        sys.argv[1:] if words is None else list(words),
        name or Path(sys.argv[0]).name,
        EXTRAS.get(verb, ()),
    )
