"""The same as `gnm publish`: see `python scripts/publish.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("publish")
