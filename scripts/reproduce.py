"""The same as `gnm reproduce`: see `python scripts/reproduce.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("reproduce")
