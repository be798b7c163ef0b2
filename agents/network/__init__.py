"""A network of GNM neurons with a hidden layer, trained by backpropagated error traces.

The compiled network needs numpy and numba alone. `NetworkModule`, the same network as a
torch.nn.Module, and what goes with it are imported at their first use; they need torch,
`pip install "gnm-env[rl]"`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from agents.network.network_agent import NetworkAgent, NetworkRecording
from agents.network.parameters import BackPropagation, Network

if TYPE_CHECKING:
    from agents.network.module import NetworkModule as NetworkModule
    from agents.network.module import error_traces as error_traces
    from agents.network.module import padded as padded

_OF_TORCH = ("NetworkModule", "error_traces", "padded")

# Without the names that need torch, so that `import *` does not.
__all__ = ["BackPropagation", "Network", "NetworkAgent", "NetworkRecording"]


def __getattr__(name: str) -> Any:
    if name not in _OF_TORCH:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        module = importlib.import_module("agents.network.module")
    except ModuleNotFoundError as error:
        raise ImportError(
            f'{name} needs torch, and {error.name} is missing: pip install "gnm-env[rl]"'
        ) from error
    return getattr(module, name)
