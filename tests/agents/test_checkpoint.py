"""Checkpoints: whole or not at all, one file, and damage is never mistaken for a neuron."""

from __future__ import annotations

import errno
import json
import os
import stat
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from agents import (
    GNM,
    LIF,
    MST,
    AggregateLabel,
    ErrorTrace,
    NeuronAgent,
    load_checkpoint,
    noisy_performance,
)
from agents.continuous import ContinuousAgent, ContinuousGNM
from agents.learning.rule import Rule
from agents.network import BackPropagation, Network, NetworkAgent
from agents.neurons.neuron import Neuron
from gnm_env import Patterns, Task
from tests.agents.worlds import BUSY, BUSY_PATTERNS

NEURONS: list[Neuron] = [
    GNM(alpha=0.1),
    GNM(eta=0.7, h=float("inf"), readout="D"),
    GNM(eta=0.1 + 0.2, h=7.3, theta_b=1 / 3),
    LIF(refractory=np.int64(4)),  # type: ignore[arg-type]
    MST(tau_m=np.float64(17.0), tau_s=np.float32(0.1)),  # type: ignore[arg-type]
]
RULES: list[Rule] = [
    AggregateLabel(learning_rate=1 / 3, fraction=0.25, trace_decay=0.3),
    ErrorTrace(momentum=0.1),
    ErrorTrace(modulate=np.True_),  # type: ignore[arg-type]
]


def small_agent(seed: int = 0) -> NeuronAgent:
    agent = NeuronAgent(GNM(), AggregateLabel(fraction=0.25), 4, seed)
    agent.velocity[:] = np.random.default_rng(seed).standard_normal(4)
    return agent


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A small checkpoint with all that one can hold."""
    task = Task(n_inputs=4, pattern_bins=5, rate=0.2)
    rng = np.random.default_rng(3)
    small_agent().save(tmp_path / "a", task=task, patterns=Patterns.draw(task, 1), rng=rng)
    return tmp_path / "a"


@pytest.mark.parametrize("bounds", [(0.0, 1.0), None, (-np.inf, 0.5)], ids=str)
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
@pytest.mark.parametrize("neuron", NEURONS, ids=lambda neuron: neuron.name)
def test_every_neuron_and_rule_comes_back_as_it_was(
    neuron: Neuron, rule: Rule, bounds: Any, tmp_path: Path
) -> None:
    agent = NeuronAgent(neuron, rule, BUSY.n_inputs, seed=3, weight_bounds=bounds)
    agent.velocity[:] = np.random.default_rng(0).standard_normal(BUSY.n_inputs)
    rng = np.random.default_rng(8)
    rng.random(5)
    agent.save(tmp_path / "agent", task=BUSY, patterns=BUSY_PATTERNS, rng=rng)
    again = load_checkpoint(tmp_path / "agent")
    assert type(again.agent) is NeuronAgent
    assert again.agent.neuron == neuron
    assert again.agent.rule == rule
    assert again.agent.weight_bounds == bounds
    assert np.array_equal(again.agent.weights, agent.weights)
    assert np.array_equal(again.agent.velocity, agent.velocity)
    assert again.task == BUSY
    assert again.patterns == BUSY_PATTERNS
    assert again.rng is not None
    assert again.rng.random(9).tolist() == rng.random(9).tolist()


@pytest.mark.parametrize("overflowed", [False, True])
@pytest.mark.parametrize(
    "agent",
    [
        small_agent(),
        NetworkAgent(Network(hidden=2), BackPropagation(), 4),
        ContinuousAgent(ContinuousGNM(), AggregateLabel(fraction=0.25), 4),
    ],
    ids=lambda agent: type(agent).__name__,
)
def test_learning_that_has_ended_stays_ended(agent: Any, overflowed: bool, tmp_path: Path) -> None:
    agent.overflowed = overflowed
    agent.save(tmp_path / "agent")
    assert load_checkpoint(tmp_path / "agent").agent.overflowed is overflowed


def test_what_was_not_saved_is_not_there(tmp_path: Path) -> None:
    small_agent().save(tmp_path / "agent")
    loaded = load_checkpoint(tmp_path / "agent")
    assert (loaded.task, loaded.patterns, loaded.rng) == (None, None, None)


@pytest.mark.parametrize("generator", [np.random.PCG64, np.random.MT19937, np.random.SFC64])
def test_generators_of_any_kind_go_on(generator: Any, tmp_path: Path) -> None:
    rng = np.random.Generator(generator(1))
    rng.standard_normal(3)
    small_agent().save(tmp_path / "agent", rng=rng)
    again = load_checkpoint(tmp_path / "agent").rng
    assert again is not None
    assert again.random(5).tolist() == rng.random(5).tolist()


def test_a_task_with_everything_set_comes_back(tmp_path: Path) -> None:
    task = Task(
        n_inputs=4, pattern_bins=3, rate=0.3, n_classes=2, targets=(0, 3), background_bins=7,
        mean_occurrences=0.1, onset_probability=0.0, jitter_bins=2, deletion=0.25,
    )  # fmt: skip
    patterns = Patterns.draw(task, 5)
    small_agent().save(tmp_path / "agent", task=task, patterns=patterns)
    loaded = load_checkpoint(tmp_path / "agent")
    assert loaded.task == task
    assert loaded.patterns == patterns


def test_a_loaded_agent_is_ready_for_use(tmp_path: Path) -> None:
    agent = NeuronAgent(GNM(), AggregateLabel(fraction=0.25), BUSY.n_inputs, initial_weight=0.3)
    agent.save(tmp_path / "agent")
    again = NeuronAgent.load(tmp_path / "agent")
    scores = [noisy_performance(a, BUSY, BUSY_PATTERNS, runs=5) for a in (agent, again)]
    assert np.array_equal(*scores)
    assert again.weights.flags.writeable


# --- one file, whole ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["agent", "agent.npz", "agent.pt", "ägent 1.tar.gz", ".hidden"])
def test_exactly_one_file_of_exactly_that_name_is_made(name: str, tmp_path: Path) -> None:
    small_agent().save(tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    NeuronAgent.load(tmp_path / name)
    NeuronAgent.load(str(tmp_path / name))


def test_a_file_has_the_permissions_of_any_new_file(saved: Path) -> None:
    plain = saved.with_name("plain")
    plain.write_bytes(b"")
    assert stat.S_IMODE(saved.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_a_path_relative_to_the_working_folder_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    small_agent().save("agent")
    assert np.array_equal(NeuronAgent.load("agent").weights, small_agent().weights)


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (OSError(errno.ENOSPC, "disk full"), ValueError),
        (OSError(errno.EACCES, "other"), OSError),
        (KeyboardInterrupt(), KeyboardInterrupt),
    ],
)
def test_a_failure_in_the_middle_leaves_the_old_file_and_no_litter(
    saved: Path,
    error: BaseException,
    raised: type[BaseException],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = saved.read_bytes()

    def fail(file: Any, array: Any, **keywords: Any) -> None:
        file.write(b"half a checkpo")
        raise error

    monkeypatch.setattr(np.lib.format, "write_array", fail)
    with pytest.raises(raised):
        small_agent(seed=1).save(saved)
    assert saved.read_bytes() == before
    assert [p.name for p in saved.parent.iterdir()] == [saved.name]


def test_a_save_takes_the_place_of_the_old_file(saved: Path) -> None:
    small_agent(seed=1).save(saved)
    assert np.array_equal(NeuronAgent.load(saved).weights, small_agent(seed=1).weights)


def test_a_folder_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    for path in (tmp_path / "missing" / "agent", tmp_path / "file" / "agent"):
        with pytest.raises(ValueError, match=r"cannot write .*agent.*choose a folder"):
            small_agent().save(path)

    def denied(*args: Any, **keywords: Any) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(ValueError, match="Permission denied; choose a folder"):
        small_agent().save(tmp_path / "agent")


def test_a_path_that_is_a_folder_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match=r"cannot write .*folder: it is a folder"):
        small_agent().save(tmp_path / "folder")
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


# --- damage ---------------------------------------------------------------------------------------


def assert_refused_or_unharmed(path: Path, content: bytes) -> bool:
    """Load `content`: either a ValueError (True), or exactly what had been saved."""
    whole = load_checkpoint(path)
    damaged = path.with_name("damaged")
    damaged.write_bytes(content)
    try:
        loaded = load_checkpoint(damaged)
    except ValueError as refusal:
        assert "damaged" in str(refusal)  # the path: which file it is
        return True
    assert np.array_equal(loaded.agent.weights, whole.agent.weights)
    assert np.array_equal(loaded.agent.velocity, whole.agent.velocity)
    assert loaded.agent.neuron == whole.agent.neuron
    assert loaded.agent.rule == whole.agent.rule
    assert loaded.agent.weight_bounds == whole.agent.weight_bounds
    assert (loaded.task, loaded.patterns) == (whole.task, whole.patterns)
    assert loaded.rng is not None and whole.rng is not None
    assert loaded.rng.bit_generator.state == whole.rng.bit_generator.state
    return False


def test_a_truncated_file_is_refused_wherever_it_ends(saved: Path) -> None:
    content = saved.read_bytes()
    for length in [*range(0, len(content), 64), len(content) - 1]:
        assert assert_refused_or_unharmed(saved, content[:length]), length


def test_a_flipped_bit_is_refused_or_does_no_harm(saved: Path) -> None:
    """Bits that carry nothing, such as a date, may flip unnoticed; no other exception, ever."""
    content = saved.read_bytes()
    refused = 0
    places = range(0, len(content), 3)
    for place in places:
        flipped = bytearray(content)
        flipped[place] ^= 1 << (place // 3 % 8)
        refused += assert_refused_or_unharmed(saved, bytes(flipped))
    assert refused > 0.7 * len(places)


def test_a_file_that_is_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "file"
    np.savez(tmp_path / "arrays.npz", a=np.arange(3))
    np.save(tmp_path / "array.npy", np.arange(3))
    others = [b"", b"no checkpoint", os.urandom(500)]
    others += [(tmp_path / name).read_bytes() for name in ("arrays.npz", "array.npy")]
    for content in others:
        path.write_bytes(content)
        with pytest.raises(ValueError, match="not a readable checkpoint"):
            NeuronAgent.load(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no checkpoint .*missing; give the path"):
        NeuronAgent.load(tmp_path / "missing")
    with pytest.raises(ValueError, match="not a readable checkpoint"):
        NeuronAgent.load(tmp_path)


def rewritten(path: Path, arrays: dict[str, Any] | None = None, **header: Any) -> Path:
    """A sound file whose header, or arrays, say something else; None removes an entry."""
    with np.load(path) as file:
        contents: dict[str, NDArray[Any]] = {name: file[name] for name in file.files}
    old = json.loads(contents["header"].tobytes())
    new = {name: v for name, v in {**old, **header}.items() if v is not None}
    contents["header"] = np.frombuffer(json.dumps(new).encode(), np.uint8)
    for name, array in (arrays or {}).items():
        if array is None:
            del contents[name]
        else:
            contents[name] = np.asarray(array)
    with open(path, "wb") as file:
        np.savez(file, **contents)  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize(
    ("arrays", "header", "message"),
    [
        ({}, {"format": 3}, "format is 3, and this version reads 1 and 2"),
        ({}, {"format": None}, "format"),
        ({}, {"agent": {"name": "oracle", "class": "delphi:Oracle"}}, "import delphi first"),
        ({}, {"model": {"name": "izhikevich", "parameters": {}}}, "izhikevich"),
        ({}, {"model": {"name": "nobodys", "class": "my.own:Nobodys"}}, "import my.own first"),
        ({}, {"model": {"name": "gnm", "parameters": {"alpha": 7.0}}}, "alpha must be in 0 … 1"),
        ({}, {"model": {"name": "gnm", "parameters": {"omega": 7.0}}}, "omega"),
        ({}, {"rule": None}, "rule"),
        ({}, {"rule": "all"}, "does not name the class of its rule, but 'all"),
        ({}, {"agent": [1]}, r"does not name the class of its agent, but \[1\]"),
        ({}, {"n_inputs": 5}, "weights and velocity must have length 5"),
        ({}, {"trials": -1}, "how far"),
        ({}, {"weight_bounds": [1.0, 0.0]}, "lowest < highest"),
        ({}, {"task": {"rate": 2.0}}, "rate must be in 0 … 1, got 2.0"),
        ({}, {"patterns_shape": [1, 5, 5]}, "patterns"),
        ({}, {"rng": {"bit_generator": "PCG63"}}, "PCG63"),
        ({}, {"rng": {"bit_generator": "seed", "state": {}}}, "seed"),
        ({}, {"rng": {"bit_generator": "PCG64", "state": {"state": -1, "inc": 0}}}, "not a reada"),
        ({}, {"rng": 7}, "not a readable"),
        ({"weights": None}, {}, "weights"),
        ({"weights": [0.1, np.nan, 0.1, 0.1]}, {}, "weights must be finite, got nan for input 1"),
        ({"weights": [[0.1] * 4] * 4}, {}, "'weights' must have shape"),
        ({"velocity": [0.1] * 5}, {}, "weights and velocity must have length 4"),
        ({"velocity": [0.1, np.inf, 0.1, 0.1]}, {}, "velocity must be finite"),
        ({"patterns": None}, {}, "patterns"),
        ({"other": [0.1]}, {}, "'other' that does not belong there"),
    ],
)
def test_a_sound_file_with_contents_that_make_no_sense_is_refused(
    saved: Path, arrays: dict[str, Any], header: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        load_checkpoint(rewritten(saved, arrays, **header))


def test_an_agent_of_another_kind_is_refused_by_the_class_but_not_by_load_checkpoint(
    saved: Path,
) -> None:
    class Other(NeuronAgent):
        pass

    with pytest.raises(
        ValueError, match=r"holds a NeuronAgent, not a Other; use .*load_checkpoint"
    ):
        Other.load(saved)


# --- no pickle ------------------------------------------------------------------------------------


def test_nothing_in_a_checkpoint_is_a_pickle(saved: Path) -> None:
    with zipfile.ZipFile(saved) as file:
        for name in file.namelist():
            assert name.endswith(".npy")
            content = file.read(name)
            assert content.startswith(b"\x93NUMPY")
            assert b"'|O'" not in content  # an array of objects is what NumPy would pickle


def test_a_pickle_that_pretends_to_be_a_checkpoint_is_not_run(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> Any:
            return os.mkdir, (str(tmp_path / "exploded"),)

    arrays = {"header": np.array([Bomb()], dtype=object)}
    with open(tmp_path / "bomb", "wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]
    with zipfile.ZipFile(tmp_path / "bomb") as file:
        assert b"mkdir" in file.read("header.npy")  # it is loaded
    with pytest.raises(ValueError, match="not a readable checkpoint"):
        load_checkpoint(tmp_path / "bomb")
    assert not (tmp_path / "exploded").exists()
