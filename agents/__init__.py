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
from agents.learning import (
    MPDAL,
    MSTDPET,
    PSD,
    SPAN,
    STDP,
    AggregateLabel,
    Chronotron,
    CriticalThreshold,
    ErrorTrace,
    PeakError,
    PolicyGradient,
    ReSuMe,
    SurrogateGradient,
    Tempotron,
)
from agents.neuron_agent import NeuronAgent
from agents.neurons.gnm import GNM
from agents.neurons.lif import LIF
from agents.neurons.mst import MST
from agents.plotting import plot
from agents.recording import Recording, record
from agents.trained import pretrained
from agents.training.batch import Answers
from agents.training.loop import WeightOverflow, train
from agents.training.many import train_many
from agents.watching import play

__all__ = [
    "GNM",
    "LIF",
    "MPDAL",
    "MST",
    "MSTDPET",
    "PSD",
    "SPAN",
    "STDP",
    "AggregateLabel",
    "Answers",
    "Checkpoint",
    "Chronotron",
    "CriticalThreshold",
    "ErrorTrace",
    "History",
    "MistakeRate",
    "NeuronAgent",
    "PeakError",
    "PolicyGradient",
    "ReSuMe",
    "Recording",
    "SurrogateGradient",
    "Tempotron",
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
    "pretrained",
    "record",
    "train",
    "train_many",
]
