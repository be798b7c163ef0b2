"""Agents that learn from the aggregate label: spiking neurons, their rules, and how to score them.

`import agents` needs numpy, numba and gymnasium only; torch and Stable-Baselines3 belong to
`agents.network` and `agents.rl`.
"""

from agents.check import check_neuron, check_rule
from agents.checkpoint import Checkpoint, load_checkpoint
from agents.evaluation import (
    MistakeRate,
    answers,
    bootstrap_interval,
    mistake_rate,
    noisy_performance,
)
from agents.history import History
from agents.learning.aggregate_label import AggregateLabel
from agents.learning.error_trace import ErrorTrace
from agents.neuron_agent import NeuronAgent
from agents.neurons.gnm import GNM
from agents.neurons.lif import LIF
from agents.neurons.mst import MST
from agents.plotting import plot
from agents.recording import Recording, record
from agents.training.batch import Answers
from agents.training.loop import WeightOverflow, train
from agents.training.many import train_many
from agents.watching import play

__all__ = [
    "GNM",
    "LIF",
    "MST",
    "AggregateLabel",
    "Answers",
    "Checkpoint",
    "ErrorTrace",
    "History",
    "MistakeRate",
    "NeuronAgent",
    "Recording",
    "WeightOverflow",
    "answers",
    "bootstrap_interval",
    "check_neuron",
    "check_rule",
    "load_checkpoint",
    "mistake_rate",
    "noisy_performance",
    "play",
    "plot",
    "record",
    "train",
    "train_many",
]
