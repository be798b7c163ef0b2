"""Frames: constant size, the right things in the right places, and wrappers that use them."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import AddRenderObservation, HumanRendering, RenderCollection
from numpy.typing import NDArray

from gnm_env import Patterns, Task, glyphs
from gnm_env import rendering as r
from gnm_env.colours import FAINT, GREY, INK, MISTAKE, WHITE, class_colour, tint
from gnm_env.rendering import Scroll

each_id = pytest.mark.parametrize("id", ["gnm/PatternTrial-v0", "gnm/PatternStream-v0"])

SPIKES_TOP = r.TOP + r.RASTER_HEIGHT + r.GAP
COUNTS_TOP = SPIKES_TOP + r.SPIKE_HEIGHT


def new_scroll(**fields: Any) -> Scroll:
    task = Task(**fields)
    return Scroll(task.n_inputs, task, Patterns.draw(task, 0))


def has(area: NDArray[np.uint8], colour: tuple[int, int, int]) -> bool:
    return bool((area == colour).all(axis=-1).any())


def column(frame: NDArray[np.uint8], bins_ago: int, top: int, height: int) -> NDArray[np.uint8]:
    """The pixels of one bin, 0 being the newest, within rows top … top + height."""
    x = r.LEFT + (r.WINDOW - 1 - bins_ago) * r.BIN_WIDTH
    return frame[top : top + height, x : x + r.BIN_WIDTH]


@pytest.mark.parametrize("n_inputs", [1, 3, 100, 200, 201, 1000])
@pytest.mark.parametrize("n_classes", [1, 4, 40])
def test_frames_keep_their_size(n_inputs: int, n_classes: int) -> None:
    task = Task(n_inputs=n_inputs, n_classes=n_classes, rate=0.05, mean_occurrences=0.1)
    scroll = Scroll(n_inputs, task, Patterns.draw(task, 0))
    shape = scroll.frame().shape
    rng = np.random.default_rng(0)
    for t in range(260):
        row = (rng.random(n_inputs) < 0.05).astype(np.int8)
        if t % 70 == 20:
            scroll.present(t % n_classes, t % 4, 50)
        scroll.push(row, t % 3, float(t % 5) - 2)
        if t % 40 == 0:
            assert scroll.frame().shape == shape
    assert scroll.frame().dtype == np.uint8
    assert shape == (500, 696, 3)  # even numbers, as video encoders ask for


@pytest.mark.parametrize(
    ("n_inputs", "channel"), [(1, 0), (7, 3), (100, 99), (1000, 0), (1000, 999)]
)
def test_a_spike_is_drawn_where_its_channel_is(n_inputs: int, channel: int) -> None:
    scroll = new_scroll(n_inputs=n_inputs)
    row = np.zeros(n_inputs, np.int8)
    row[channel] = 1
    scroll.push(row, 0)
    newest = column(scroll.frame(), 0, r.TOP, r.RASTER_HEIGHT)
    inked = np.flatnonzero((newest == INK).all(axis=2).any(axis=1))
    assert len(inked) >= 1
    centre = (channel + 0.5) / n_inputs * r.RASTER_HEIGHT
    assert inked.min() - 1 <= centre <= inked.max() + 1


def test_an_occurrence_is_shaded_in_the_colour_of_its_class() -> None:
    scroll = new_scroll(n_classes=2, pattern_bins=4)
    for t in range(6):
        if t == 1:
            scroll.present(1, 2, 4)
        scroll.push(np.zeros(100, np.int8), 0)
    frame = scroll.frame()
    for ago, colour in enumerate([WHITE, *[tint(class_colour(1))] * 4, WHITE]):
        assert (column(frame, ago, r.TOP, r.RASTER_HEIGHT) == colour).all()
    assert (column(frame, 6, r.TOP, r.RASTER_HEIGHT) == FAINT).all()  # before the beginning


def test_spikes_that_are_not_owed_are_marked() -> None:
    scroll = new_scroll()
    for t, spike in enumerate((1, 1, 0, 1, 0, 1)):
        if t in (1, 5):
            scroll.present(0, 1, 4)
        scroll.push(np.zeros(100, np.int8), spike)
    colours = [
        MISTAKE if has(bar, MISTAKE) else INK if has(bar, INK) else None
        for bar in (column(scroll.frame(), ago, SPIKES_TOP, r.SPIKE_HEIGHT) for ago in range(6))
    ]
    # the last bin belongs to a new occurrence of the same class, right after the first
    assert colours == [INK, None, MISTAKE, None, INK, MISTAKE]


@pytest.mark.parametrize(
    ("spikes", "ended", "colour"),
    [(1, True, INK), (0, True, MISTAKE), (2, False, MISTAKE), (0, False, GREY)],
)
def test_given_and_owed_are_written_below_each_occurrence(
    spikes: int, ended: bool, colour: tuple[int, int, int]
) -> None:
    scroll = new_scroll()
    scroll.present(0, 1, 10)
    for t in range(10 if ended else 5):
        scroll.push(np.zeros(100, np.int8), int(t < spikes))
    for _ in range(20):
        if ended:
            scroll.push(np.zeros(100, np.int8), 0)
    counts = scroll.frame()[COUNTS_TOP : COUNTS_TOP + r.COUNT_HEIGHT, r.LEFT :]
    assert has(counts, colour)
    assert not any(has(counts, other) for other in {INK, MISTAKE, GREY} - {colour})


def test_the_potential_appears_when_it_is_known() -> None:
    scroll = new_scroll()
    top = COUNTS_TOP + r.COUNT_HEIGHT + r.GAP
    area = slice(top, top + r.POTENTIAL_HEIGHT), slice(r.LEFT, None)
    scroll.push(np.zeros(100, np.int8), 0)
    assert (scroll.frame()[area] == 255).all()
    for value in (0.5, -3.0, 7.0, float("inf")):
        scroll.push(np.zeros(100, np.int8), 0, value)
        plot = scroll.frame()[area]
        assert has(plot, INK) and has(plot, MISTAKE)  # the line and the threshold


def test_clear_forgets_everything() -> None:
    scroll = new_scroll()
    empty = scroll.frame()
    for _ in range(30):
        scroll.push(np.ones(100, np.int8), 1, 0.5)
    assert not np.array_equal(scroll.frame(), empty)
    scroll.clear()
    assert np.array_equal(scroll.frame(), empty)


def test_colours_of_neighbouring_classes_differ_and_none_is_that_of_a_mistake() -> None:
    colours = [class_colour(class_) for class_ in range(6)]
    assert len({*colours, MISTAKE, INK}) == 8
    assert class_colour(6) == colours[0]


def test_text_is_ink_on_the_right_grid() -> None:
    assert glyphs.mask("0").shape == (glyphs.HEIGHT, 5)
    assert glyphs.mask("10").shape == (glyphs.HEIGHT, glyphs.width("10"))
    assert glyphs.mask("1", 2).shape == (2 * glyphs.HEIGHT, 10)
    assert not np.array_equal(glyphs.mask("8"), glyphs.mask("0"))
    assert not glyphs.mask("~").any()  # unknown: blank
    assert glyphs.mask("").size == 0


@each_id
class TestEnvironments:
    def test_frames_follow_the_steps(self, id: str) -> None:
        env = gym.make(id, render_mode="rgb_array", rate=0.2)
        env.reset(seed=0)
        before: Any = env.render()
        env.step(0)
        after: Any = env.render()
        assert before.shape == after.shape and not np.array_equal(before, after)
        assert np.array_equal(after, env.render())  # drawing changes nothing
        env.reset()
        assert np.array_equal(env.render(), before)  # type: ignore[arg-type]

    def test_the_bin_that_was_answered_is_the_newest_shown(self, id: str) -> None:
        env = gym.make(id, render_mode="rgb_array", rate=0.2)
        obs, _ = env.reset(seed=0)
        for _ in range(5):
            following, *_ = env.step(0)
            newest = column(env.render(), 0, r.TOP, r.RASTER_HEIGHT)  # type: ignore[arg-type]
            inked = (newest[:, 0] == INK).all(axis=1)[::2]  # two rows a channel
            assert np.array_equal(inked, obs.astype(bool))
            obs = following

    def test_pictures_do_not_change_what_is_heard(self, id: str) -> None:
        plain, drawn = gym.make(id), gym.make(id, render_mode="rgb_array")
        plain.reset(seed=1)
        drawn.reset(seed=1)
        for _ in range(300):
            (a, *rest), (b, *same) = plain.step(0), drawn.step(0)
            assert np.array_equal(a, b) and rest == same
            if rest[1]:
                plain.reset()
                drawn.reset()

    def test_an_agent_may_show_its_potential(self, id: str) -> None:
        env = gym.make(id, render_mode="rgb_array")
        frames = []
        for potential in (float("nan"), 0.7):
            env.reset(seed=0)
            env.unwrapped.potential = potential  # type: ignore[attr-defined]
            env.step(0)
            frames.append(env.render())
        assert not np.array_equal(frames[0], frames[1])  # type: ignore[arg-type]

    @pytest.mark.parametrize("value", ["x", None, [1, 2], True, {}], ids=repr)
    def test_a_potential_is_one_number(self, id: str, value: Any) -> None:
        env: Any = gym.make(id).unwrapped
        with pytest.raises(ValueError, match="potential must be one number"):
            env.potential = value

    def test_any_potential_can_be_drawn(self, id: str) -> None:
        env: Any = gym.make(id, render_mode="rgb_array").unwrapped
        env.reset(seed=0)
        for value in (1e308, -1e308, np.inf, np.float32(0.5), np.array(0.7)):
            env.potential = value
            env.step(0)
            env.render()

    def test_without_a_render_mode_there_is_no_picture(self, id: str) -> None:
        env = gym.make(id).unwrapped
        env.reset(seed=0)
        assert env.render() is None

    def test_wrappers_that_collect_frames(self, id: str) -> None:
        env = RenderCollection(gym.make(id, render_mode="rgb_array"))
        env.reset(seed=0)
        for _ in range(4):
            env.step(0)
        frames: Any = env.render()
        assert np.array(frames).shape == (5, 500, 696, 3)

    def test_frames_as_observations(self, id: str) -> None:
        env = AddRenderObservation(gym.make(id, render_mode="rgb_array"))
        obs, _ = env.reset(seed=0)
        assert obs in env.observation_space

    def test_a_window_for_human_eyes(self, id: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
        monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        env = HumanRendering(gym.make(id, render_mode="rgb_array"))
        env.reset(seed=0)
        env.step(0)
        env.close()
