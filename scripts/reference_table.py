"""The same as `gnm reference-table`: see `python scripts/reference_table.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("reference-table")
