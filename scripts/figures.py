"""The same as `gnm figures`: see `python scripts/figures.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("figures")
