"""A window for human eyes, and what is said where it cannot be had."""

from __future__ import annotations

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

from gnm_env import window

each_id = pytest.mark.parametrize("id", ["gnm/PatternTrial-v0", "gnm/PatternStream-v0"])


@pytest.fixture
def _no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")


@each_id
@pytest.mark.usefixtures("_no_screen")
def test_reset_and_step_show_the_picture_of_rgb_array(
    id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Any] = []
    show = window.Window.show
    monkeypatch.setattr(
        window.Window, "show", lambda self, frame: (shown.append(frame), show(self, frame))
    )
    env, twin = gym.make(id, render_mode="human"), gym.make(id, render_mode="rgb_array")
    env.reset(seed=0)
    twin.reset(seed=0)
    for _ in range(3):
        assert np.array_equal(shown[-1], twin.render())  # type: ignore[arg-type]
        env.step(0)
        twin.step(0)
    assert len(shown) == 4 and env.render() is None
    again = pickle.loads(pickle.dumps(env.unwrapped))
    again.step(0)
    again.close()
    env.close()
    env.close()


@each_id
def test_without_pygame_the_extra_is_named_and_the_mode_is_not_offered(
    id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window, "can_open", lambda: False)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "gnm-env\[rendering\]"'):
        gym.make(id, render_mode="human")
    assert gym.make(id).unwrapped.metadata["render_modes"] == ["rgb_array"]
