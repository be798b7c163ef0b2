"""Without torch and Stable-Baselines3 everything else works, and agents.rl says what to install."""

from __future__ import annotations

import subprocess
import sys

import pytest

WITHOUT = """
import sys
for name in {missing!r}:
    sys.modules[name] = None
import gnm_env, agents
assert agents.noisy_performance
try:
    import agents.rl
except ImportError as error:
    print(error)
"""


@pytest.mark.parametrize("missing", [["torch"], ["stable_baselines3"], ["sb3_contrib"]])
def test_the_missing_extra_is_named(missing):
    run = subprocess.run(
        [sys.executable, "-c", WITHOUT.format(missing=missing)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 0, run.stderr
    assert 'pip install "gnm-env[rl]"' in run.stdout
    assert missing[0] in run.stdout


def test_the_core_imports_neither_torch_nor_stable_baselines():
    code = "import sys, gnm_env, agents, agents.policy, gnm_env.wrappers; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert not {"torch", "stable_baselines3", "sb3_contrib"} & set(run.stdout.split())
