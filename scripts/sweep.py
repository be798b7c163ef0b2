"""The same as `gnm sweep`: see `python scripts/sweep.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("sweep")
