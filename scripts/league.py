"""The same as `gnm league`: see `python scripts/league.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("league")
