"""`python -m agents.commands`: what the console command `gnm` does."""

from agents.commands import main

if __name__ == "__main__":
    main()
