"""The same as `gnm watch`: see `python scripts/watch.py --help`."""

from agents.commands import run

if __name__ == "__main__":
    run("watch")
