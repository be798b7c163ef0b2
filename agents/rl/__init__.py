"""Reinforcement learning on the same stream: recipes over Stable-Baselines3, and their scoring.

Needs torch, Stable-Baselines3 and sb3-contrib: `pip install -e ".[rl]"`.
"""

try:
    import sb3_contrib  # noqa: F401
    import stable_baselines3  # noqa: F401
    import torch  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"agents.rl needs torch, stable-baselines3 and sb3-contrib, and {error.name} is missing: "
        'pip install -e ".[rl]"'
    ) from error

from agents.rl.folder import load, save
from agents.rl.recipes import RECIPES, Recipe, make_rl_agent, training_env
from agents.rl.sb3_agent import SB3Agent
from agents.rl.senses import RAW, TRACES, Senses
from agents.rl.vec_env import PatternVecEnv

__all__ = [
    "RAW",
    "RECIPES",
    "TRACES",
    "PatternVecEnv",
    "Recipe",
    "SB3Agent",
    "Senses",
    "load",
    "make_rl_agent",
    "save",
    "training_env",
]
