"""The same as `gnm evaluate`: see `python scripts/evaluate.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("evaluate")
