"""The same as `gnm report`: see `python scripts/report.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("report")
