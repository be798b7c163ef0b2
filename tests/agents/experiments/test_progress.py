from __future__ import annotations

import io

import pytest

from agents.experiments.progress import Progress, duration


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(8.4, "8 s"), (59.7, "1 min 0 s"), (250, "4 min 10 s"), (7_500, "2 h 5 min")],
)
def test_durations_read_as_a_person_says_them(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_without_a_terminal_there_is_a_line_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("agents.experiments.progress.time.monotonic", lambda: now[0])
    out = io.StringIO()
    with Progress("F3", total=10, done=4, stream=out) as progress:
        for now[0] in (20.0, 40.0, 59.0):
            progress.tick()
        assert out.getvalue() == ""
        now[0] = 60.0
        progress.tick()
        now[0] = 90.0
        progress.advance()
        now[0] = 120.0
        progress.advance()

    assert out.getvalue().splitlines() == [
        "F3: 4/10 blocks, 1 min 0 s so far",
        "F3: 6/10 blocks, 1.0/min, 4 min 0 s left",
        "F3: 6/10 blocks, 120 s",
    ]


def test_on_a_terminal_there_is_a_bar() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    out = Terminal()
    with Progress("F3", total=4, done=1, stream=out) as progress:
        progress.advance()

    assert "2/4" in out.getvalue()
    assert "blocks/min" not in out.getvalue()
