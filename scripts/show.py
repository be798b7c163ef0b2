"""Draw how a neuron works.

python scripts/show.py hysteresis                       figures 1c and 1d of the paper
python scripts/show.py responses runs/train/agent.npz   V(t) of a trained agent over each class
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import commandline
from agents import load_checkpoint


def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "what", choices=("hysteresis", "responses"), nargs="?", default="hysteresis"
    )
    parser.add_argument("checkpoint", type=Path, nargs="?", help="for responses: a saved agent")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/show"), metavar="FOLDER", help="(default runs/show)"
    )
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


def main(options: argparse.Namespace) -> dict[str, Any]:
    from pictures import response_picture, save

    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"cannot make the folder {options.out}: {error.strerror}") from None
    if options.what == "hysteresis":
        from hysteresis import hysteresis_picture

        figure = hysteresis_picture()
    else:
        if options.checkpoint is None:
            raise ValueError("responses needs a checkpoint: show.py responses CHECKPOINT")
        saved = load_checkpoint(options.checkpoint)
        if saved.task is None or saved.patterns is None:
            raise ValueError(f"{options.checkpoint} was saved without its task and patterns")
        figure = response_picture(saved.agent, saved.task, saved.patterns)
    path = save(figure, options.out / f"{options.what}.png")
    print(f"picture {path}")
    return {"picture": str(path)}


if __name__ == "__main__":
    arguments = parser().parse_args()
    commandline.run(lambda: main(arguments), as_json=arguments.json, name="show.py")
