"""Train the agents that come with the package anew: agents/trained."""

import json

from agents.trained.make import make

if __name__ == "__main__":
    for name, entry in make().items():
        print(name, json.dumps(entry["score"]))
