"""The same as `gnm explore`: see `python scripts/explore.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("explore")
