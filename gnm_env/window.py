"""A window on the screen for `render_mode="human"`."""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray


def can_open() -> bool:
    """Whether the library that draws windows is installed."""
    return importlib.util.find_spec("pygame") is not None


class Window:
    """Shows frames, at most `fps` a second; opens at the first.

    Raises DependencyNotInstalled if pygame is missing.
    """

    def __init__(self, fps: int) -> None:
        if not can_open():
            raise DependencyNotInstalled(
                'render_mode="human" needs pygame: pip install "gnm-env[rendering]"'
            )
        self._fps = fps
        self._screen: Any = None
        self._clock: Any = None

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Put `frame`, uint8 (height, width, 3), on the screen."""
        import pygame

        if self._screen is None:
            pygame.display.init()
            self._screen = pygame.display.set_mode((frame.shape[1], frame.shape[0]))
            self._clock = pygame.time.Clock()
        surface = pygame.surfarray.make_surface(frame.transpose(1, 0, 2))
        self._screen.blit(surface, (0, 0))
        pygame.event.pump()
        self._clock.tick(self._fps)
        pygame.display.flip()

    def close(self) -> None:
        """Close the window, if it is open."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = None

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy opens a window of its own."""
        return Window, (self._fps,)
