"""The generalised neuron model in continuous time: exact for η = 0, solved in small steps else."""

from agents.continuous.agent import ContinuousAgent
from agents.continuous.neuron import ContinuousGNM
from agents.continuous.reacting import ReactingGNM
from agents.continuous.reference import reference
from agents.continuous.simulate import InputSpikes, Trajectory, simulate

__all__ = [
    "ContinuousAgent",
    "ContinuousGNM",
    "InputSpikes",
    "ReactingGNM",
    "Trajectory",
    "reference",
    "simulate",
]
