"""The same as `gnm train`: see `python scripts/train.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("train")
