"""The same as `gnm show`: see `python scripts/show.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("show")
