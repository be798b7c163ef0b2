"""`import gnm_env, agents` costs only what it needs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

SCRIPT = """
import json, sys
import gymnasium, numba
before = set(sys.modules)
import gnm_env, agents
print(json.dumps(sorted(set(sys.modules) - before)))
"""


def test_the_core_imports_nothing_heavy() -> None:
    """Nothing of torch, SB3, matplotlib or SciPy beyond what numba itself imports."""
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=ROOT, capture_output=True, text=True, check=True
    )
    modules = json.loads(result.stdout)
    packages = {name.partition(".")[0] for name in modules}
    assert {"gnm_env", "agents"} <= packages
    heavy = ("torch", "stable_baselines3", "sb3_contrib", "matplotlib", "scipy", "pygame", "xarray")
    assert not packages & {*heavy, "pandas", "tensorboard", "tqdm"}
    rooms = ("network", "rl", "chemistry", "continuous")
    assert not any(name.startswith(f"agents.{room}") for name in modules for room in rooms)
    assert "gnm_env.rendering" not in modules
