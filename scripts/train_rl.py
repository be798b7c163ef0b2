"""The same as `gnm train-rl`: see `python scripts/train_rl.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("train-rl")
