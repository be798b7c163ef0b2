"""Experiments: grids of settings, computed block by block into stores, judged, drawn and reported.

The machinery is `design` (what an experiment is), `training` (the work behind trained numbers),
`sweep`, `workers` and `store` (how it is computed and kept), `statistics`, `verdict`, `figures` and
`report`. Every other file is one subject of the paper: its grid, its analysis, its claims and its
figures with their captions. `listing` names them all.

The store needs `pip install "gnm-env[reproduce]"`; declaring an experiment does not.
"""

from agents.experiments.design import Axis, Block, Coordinate, Experiment, Variable
from agents.experiments.training import class_counts, learners, pattern_seeds, training

__all__ = [
    "Axis",
    "Block",
    "Coordinate",
    "Experiment",
    "Variable",
    "class_counts",
    "learners",
    "pattern_seeds",
    "training",
]
