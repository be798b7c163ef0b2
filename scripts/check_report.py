"""The same as `gnm check-report`: see `python scripts/check_report.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("check-report")
