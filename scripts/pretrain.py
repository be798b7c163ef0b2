"""Train the agents that come with the package anew: `agents.pretrained`.

python scripts/pretrain.py                 in their place, agents/trained
python scripts/pretrain.py --out mine      in a folder of yours
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # run by itself, from a checkout
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from agents.commands.terminal import Parser, run, share
from agents.trained.make import HERE, make


def options(parser: Parser) -> None:
    share(parser, "--out", default=HERE, help="folder (default %(default)s)")


def main(options: argparse.Namespace) -> dict[str, Any]:
    """Train, choose, save and score them."""
    options.out.mkdir(parents=True, exist_ok=True)
    made = make(options.out)
    for name, entry in made.items():
        print(name, json.dumps(entry["score"]))
    return made


if __name__ == "__main__":
    run(lambda: sys.modules[__name__], sys.argv[1:], "pretrain.py")
