"""The same as `gnm chemistry`: see `python scripts/chemistry.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("chemistry")
