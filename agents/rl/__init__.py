"""Reinforcement learning on the same stream: Stable-Baselines3's algorithms, and their scoring.

Needs torch, Stable-Baselines3 and sb3-contrib: `pip install "gnm-env[rl]"`.
"""

try:
    import sb3_contrib  # noqa: F401
    import stable_baselines3  # noqa: F401
    import torch  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"agents.rl needs torch, stable-baselines3 and sb3-contrib, and {error.name} is missing: "
        'pip install "gnm-env[rl]"'
    ) from error

from agents.rl.checkpoint import load, save
from agents.rl.hyperparameters import (
    HYPERPARAMETERS,
    Hyperparameters,
    make_rl_agent,
    read_hyperparameters,
    training_env,
)
from agents.rl.memory import LeakyPolicy, LstmPolicy
from agents.rl.observation import RAW, TRACES, ObservationConfig
from agents.rl.sb3_agent import SB3Agent
from agents.rl.spiking import GnmPolicy, SpikingPolicy
from agents.rl.vec_env import PatternVecEnv

__all__ = [
    "HYPERPARAMETERS",
    "RAW",
    "TRACES",
    "GnmPolicy",
    "Hyperparameters",
    "LeakyPolicy",
    "LstmPolicy",
    "ObservationConfig",
    "PatternVecEnv",
    "SB3Agent",
    "SpikingPolicy",
    "load",
    "make_rl_agent",
    "read_hyperparameters",
    "save",
    "training_env",
]
