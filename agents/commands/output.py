"""The folder that a training fills: beside what is there, and in its place at the end."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

UNFINISHED = "unfinished"


class Output:
    """A folder whose files are replaced by those of a new training once they are whole.

    Until then everything is in its subfolder "unfinished", from which a training that was killed
    can be resumed. So an agent that is there is never replaced by one that has learned less.

    Args:
        folder: made if need be.
        agent: name of the agent's file.
        resumed: the agent that training goes on with, if it does.

    Raises ValueError if the folder cannot be written.
    """

    def __init__(self, folder: Path, agent: str, resumed: Path | None = None) -> None:
        self.folder, self.fresh = folder, folder / UNFINISHED
        self._agent = agent
        self._resumed = resumed is not None and resumed.resolve() == (folder / agent).resolve()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if resumed is None or resumed.resolve().parent != self.fresh.resolve():
                shutil.rmtree(self.fresh, ignore_errors=True)
            self.fresh.mkdir(exist_ok=True)
        except OSError as error:
            raise ValueError(
                f"cannot make the folder {self.fresh}: {error.strerror}; choose another with --out"
            ) from None

    def finish(self) -> Path:
        """Training has come to its end: put everything in place. Returns the agent's path."""
        for path in sorted(self.fresh.iterdir()):
            os.replace(path, self.folder / path.name)
        self.fresh.rmdir()
        return self.folder / self._agent

    def stop(self) -> Path | None:
        """Training was stopped: put the agent in place unless another is there already.

        Returns where it is now; None if there is none, since nothing was learned.
        """
        if not (self.fresh / self._agent).exists():
            shutil.rmtree(self.fresh)
            return None
        if self._resumed or not (self.folder / self._agent).exists():
            return self.finish()
        return self.fresh / self._agent
