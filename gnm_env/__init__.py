"""Spike patterns hidden in noise, as Gymnasium environments with the aggregate label as feedback.

Importing this package registers `gnm/PatternTrial-v0`, `gnm/PatternStream-v0`, and both for every
level of `suite()`. If the module `agents` on the path is another project's, a
warning says so.
"""

from gymnasium.envs.registration import register

from gnm_env.levels import Level, register_levels, suite
from gnm_env.neighbour import warn_of_foreign_agents
from gnm_env.rules import MAX_EPISODE_BINS
from gnm_env.stream_task.env import PatternStreamEnv
from gnm_env.task import Patterns, Task
from gnm_env.trial import Trial, draw_trial
from gnm_env.trial_task.env import PatternTrialEnv
from gnm_env.trials import Trials

__version__ = "0.1.0"

__all__ = [
    "__version__",
    "Level",
    "PatternStreamEnv",
    "PatternTrialEnv",
    "Patterns",
    "Task",
    "Trial",
    "Trials",
    "draw_trial",
    "suite",
]

register(
    "gnm/PatternTrial-v0",
    entry_point="gnm_env.trial_task.env:PatternTrialEnv",
    vector_entry_point="gnm_env.trial_task.vector:PatternTrialVectorEnv",
)
register(
    "gnm/PatternStream-v0",
    entry_point="gnm_env.stream_task.env:PatternStreamEnv",
    vector_entry_point="gnm_env.stream_task.vector:PatternStreamVectorEnv",
    max_episode_steps=MAX_EPISODE_BINS,
)
register_levels()
warn_of_foreign_agents()
