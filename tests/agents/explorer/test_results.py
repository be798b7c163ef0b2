"""What the page shows is what the library computes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from agents import load_checkpoint, noisy_performance, train_many
from agents.commands.terminal import EVALUATION_SEED
from agents.explorer.game import Game
from agents.explorer.results import Superseded, Trainer, checkpoint, result, teaching
from agents.explorer.settings import parse

LINK = {"trials": "400", "r.learning_rate": "0.001", "seed": "3"}


def test_the_score_is_that_of_the_library_on_the_same_seed() -> None:
    settings, trainer = parse(LINK), Trainer()
    shown = result(settings, trainer.trained(settings))
    agent, patterns = settings.agent(), settings.patterns()
    history = train_many([agent], settings.task, patterns, 400, seed=3, block=6)
    survived = noisy_performance(agent, settings.task, patterns, seed=EVALUATION_SEED)
    assert shown["score"]["noisy_performance"]["mean"] == survived.mean()
    np.testing.assert_allclose(shown["weights"]["learned"], agent.weights, rtol=1e-4)
    np.testing.assert_allclose(shown["curve"]["wrong"], history.of(0).error_rate, rtol=1e-4)
    json.dumps([shown, teaching(settings, trainer.trained(settings))])


def test_another_trial_needs_no_training() -> None:
    trainer = Trainer()
    first, second = parse(LINK), parse({**LINK, "shown": "8"})
    trained = trainer.trained(first)
    assert trainer.trained(second) is trained
    trials = [result(one, trained)["trial"] for one in (first, second)]
    assert trials[0] != trials[1]


def test_a_training_that_nobody_waits_for_ends_and_is_not_kept() -> None:
    trainer, settings = Trainer(), parse({**LINK, "trials": "10000000"})
    asked = iter([False, False, True, True])
    with pytest.raises(Superseded):
        trainer.trained(parse({**LINK, "trials": "600"}), lambda: next(asked))
    with pytest.raises(Superseded):
        trainer.trained(settings, lambda: True)


def test_a_checkpoint_holds_the_agent_and_its_place_in_the_stream(tmp_path: Path) -> None:
    settings, trainer = parse(LINK), Trainer()
    trained = trainer.trained(settings)
    path = tmp_path / "agent.npz"
    path.write_bytes(checkpoint(settings, trained))
    saved = load_checkpoint(path)
    assert np.array_equal(saved.agent.weights, trained.agent.weights)
    assert saved.task == settings.task and saved.rng is not None
    train_many([saved.agent], saved.task, saved.patterns, 50, saved.rng)
    whole = settings.agent()
    train_many([whole], settings.task, settings.patterns(), 450, seed=3)
    assert np.array_equal(saved.agent.weights, whole.weights)


@pytest.mark.parametrize(
    ("link", "state"),
    [
        ({"initial_weight": "0", "mute": "1"}, "silent"),
        ({"n.alpha": "0.02", "initial_weight": "1", "mute": "1"}, "above"),
        (LINK, "alive"),
    ],
)
def test_why_a_neuron_never_spikes_is_told(link: dict[str, str], state: str) -> None:
    settings = parse({**link, "trials": "400"})
    assert result(settings, Trainer().trained(settings))["state"] == state


# --- the game ------------------------------------------------------------------------------------


def test_whoever_answers_as_the_neuron_gets_its_score() -> None:
    settings = parse({"trials": "6000", "r.learning_rate": "0.001"})
    game = Game(settings, Trainer().trained(settings), seed=5)
    said = {"survived": 0}
    while not game.over:
        said = game.answer(game.look()["neuron"])
    assert said["survived"] == game.neuron_score()


def test_a_spike_in_noise_and_silence_end_the_game_as_they_end_a_run() -> None:
    settings = parse({"trials": "10"})
    trained = Trainer().trained(settings)
    eager = Game(settings, trained, seed=2)
    while eager.look()["class"] >= 0:
        eager.answer(0)
    assert eager.answer(1)["mistake"] == "noise"
    with pytest.raises(ValueError, match="over"):
        eager.answer(0)
    silent = Game(settings, trained, seed=2)
    said = {"mistake": None}
    classes = []
    while not silent.over:
        classes.append(silent.look()["class"])
        said = silent.answer(0)
    assert said["mistake"] == "too few"
    assert classes[-50:] == [0] * 50 and set(classes[:-50]) == {-1}
