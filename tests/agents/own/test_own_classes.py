"""A neuron and a rule of one's own train side by side, are saved, loaded, scored and commanded."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from agents import (
    GNM,
    LIF,
    AggregateLabel,
    ErrorTrace,
    NeuronAgent,
    check_neuron,
    check_rule,
    load_checkpoint,
    noisy_performance,
    train,
    train_many,
)
from agents.learning.rule import Rule
from agents.neurons.neuron import Neuron, PSPKernel, Response
from agents.registry import find_neuron, find_rule, neurons, rules
from tests.agents.worlds import BUSY, BUSY_PATTERNS, trial_env

HERE = Path(__file__).parent
ALIF: Any = find_neuron(f"{HERE / 'my_neurons.py'}:ALIF")
Tempotron: Any = find_rule(f"{HERE / 'my_rules.py'}:OwnTempotron")
Squared: Any = find_rule(f"{HERE / 'my_rules.py'}:Squared")


def agent_of(rule: Rule, seed: int, neuron: Any = None) -> NeuronAgent:
    return NeuronAgent(neuron or ALIF(alpha=0.2), rule, BUSY.n_inputs, seed, 0.6, (-1.0, 1.0))


def test_files_with_classes_of_ones_own_are_short() -> None:
    for file in HERE.glob("my_*.py"):
        assert len(file.read_text().splitlines()) <= 60, file


@pytest.mark.parametrize(
    "rule", [Tempotron(), Squared(1e-2), ErrorTrace(1e-3)], ids=lambda r: r.name
)
def test_sixty_four_train_with_the_bits_of_one_in_the_loop(rule: Rule) -> None:
    together = [agent_of(rule, seed) for seed in range(64)]
    train_many(together, BUSY, BUSY_PATTERNS, trials=120, seed=5)
    for k in (0, 63):
        alone = agent_of(rule, k)
        before = alone.weights.copy()
        train(alone, trial_env(), 120, seed=5)
        assert not np.array_equal(alone.weights, before)
        assert np.array_equal(alone.weights, together[k].weights)
        assert np.array_equal(alone.velocity, together[k].velocity)


def test_a_fresh_process_loads_what_was_saved_once_it_knows_the_module(tmp_path: Path) -> None:
    agent = agent_of(Tempotron(), 3)
    train_many([agent], BUSY, BUSY_PATTERNS, trials=50, seed=5)
    agent.save(tmp_path / "agent.npz", task=BUSY, patterns=BUSY_PATTERNS)
    again = load_checkpoint(tmp_path / "agent.npz").agent
    assert type(again.neuron) is ALIF
    assert np.array_equal(again.weights, agent.weights)
    score = noisy_performance(agent, BUSY, BUSY_PATTERNS, runs=5, cap=200, seed=9)

    program = (
        "import sys\n"
        "from agents import load_checkpoint, noisy_performance\n"
        "for name in sys.argv[2:]: __import__(name)\n"
        "c = load_checkpoint(sys.argv[1])\n"
        "print(noisy_performance(c.agent, c.task, c.patterns, runs=5, cap=200, seed=9).tolist())"
    )

    def run(*modules: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", program, str(tmp_path / "agent.npz"), *modules]
        return subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False)

    known = run("my_neurons", "my_rules")
    assert known.returncode == 0, known.stderr
    assert known.stdout.strip() == str(score.tolist())
    missing = run("my_rules")
    assert "ValueError" in missing.stderr
    assert "import my_neurons first" in missing.stderr
    assert "damaged" not in missing.stderr


def test_the_registry_lists_them_beside_those_of_the_package() -> None:
    assert neurons()["alif"] is ALIF
    assert {"gnm", "lif", "mst"} <= set(neurons())
    assert rules()["own-tempotron"] is Tempotron
    assert find_neuron("lif") is LIF
    with pytest.raises(ValueError, match=r"there is no neuron 'izhikevich'; known: .*alif"):
        find_neuron("izhikevich")


@pytest.mark.parametrize("neuron", [GNM(), LIF(refractory=3), ALIF()], ids=lambda n: n.name)
def test_neurons_that_are_well_pass_the_check(neuron: Any) -> None:
    check_neuron(neuron)


@pytest.mark.parametrize("rule", [AggregateLabel(fraction=0.25), Tempotron(), Squared()])
def test_rules_that_are_well_pass_the_check(rule: Any) -> None:
    check_rule(rule)


def returned(p: Any, trial: Any, y: Any) -> Any:
    return trial.error * trial.V


def misread(p: Any, trial: Any, y: Any) -> None:
    y[0] = trial.sign


@dataclass(frozen=True)
class Returned(Rule):
    """Returns what it should have written."""

    learning_rate: float = 0.01
    momentum: float = 0.0

    name: ClassVar[str] = "returned"
    feedback: ClassVar[str] = "sign"
    teach: ClassVar[Any] = returned


@dataclass(frozen=True)
class Misread(Rule):
    """Asks a trial for what it does not have."""

    learning_rate: float = 0.01
    momentum: float = 0.0

    name: ClassVar[str] = "misread"
    feedback: ClassVar[str] = "sign"
    teach: ClassVar[Any] = misread


@dataclass(frozen=True)
class Rateless(Rule):
    """Forgets what every rule has."""

    name: ClassVar[str] = "rateless"
    feedback: ClassVar[str] = "sign"
    teach: ClassVar[Any] = returned


def test_a_rule_without_a_learning_rate_is_told_to_have_one() -> None:
    with pytest.raises(ValueError, match="Rateless needs the fields learning_rate and momentum"):
        Rateless()


@pytest.mark.parametrize(
    ("rule", "told"),
    [
        (Returned(), "must write into y, what it returns is not read"),
        (Misread(), "a trial has no sign; it has V, X, spikes, .* error, thresh"),
    ],
)
def test_a_rule_that_teaches_nothing_or_misreads_its_trial_is_told(rule: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        check_rule(rule)


def test_a_class_that_keeps_its_parents_name_is_refused_when_it_is_defined() -> None:
    with pytest.raises(ValueError, match="Mine has its own step but keeps the name 'lif'"):

        class Mine(LIF):
            step: ClassVar[Any] = None


def test_two_classes_of_one_name_are_refused() -> None:
    with pytest.raises(ValueError, match=r"cannot be called 'gnm': agents.neurons.gnm:GNM has"):

        @dataclass(frozen=True)
        class Other(Neuron):
            name: ClassVar[str] = "gnm"


def test_a_class_in_place_of_an_instance_is_told_so() -> None:
    with pytest.raises(ValueError, match=r"got the class GNM; write GNM\(\)"):
        NeuronAgent(GNM, AggregateLabel(), 10)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"got the class AggregateLabel; write AggregateLabel\(\)"):
        NeuronAgent(GNM(), AggregateLabel, 10)  # type: ignore[arg-type]


def test_a_step_that_branches_is_refused_by_its_line_and_what_to_write() -> None:
    with pytest.raises(ValueError, match=r"test_own_classes.py, line \d+.*`if …:` cannot serve"):

        @dataclass(frozen=True)
        class Branching(Neuron):
            name: ClassVar[str] = "branching"

            @staticmethod
            def step(p: Any, static: Any, state: Any, current: Any) -> Any:
                if current > 0.0:
                    return state, current
                return state, 0.0

    assert "branching" not in neurons()


def test_a_rule_that_is_refused_is_not_known_by_its_name() -> None:
    with pytest.raises(ValueError, match="Mute must say what it teaches"):

        class Mute(Rule):
            name: ClassVar[str] = "mute"
            feedback: ClassVar[str] = "sign"

    assert "mute" not in rules()


@dataclass(frozen=True)
class Broken(Neuron):
    """Calls what there is not."""

    alpha: float = 0.3
    theta: float = 1.0
    name: ClassVar[str] = "broken"
    default_initial_weight: ClassVar[float] = 0.1
    state_type: ClassVar[type] = ALIF.state_type

    @staticmethod
    def step(p: Any, static: Any, state: Any, current: Any) -> Any:
        V = np.floor(state.V) + current
        return state, Response(V, V, V, V, V > 1.0, V > 1.0)

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(0.7)


@dataclass(frozen=True)
class Restless(Neuron):
    """Is not at rest when its state is 0."""

    alpha: float = 0.3
    theta: float = 1.0
    name: ClassVar[str] = "restless"
    default_initial_weight: ClassVar[float] = 0.1
    state_type: ClassVar[type] = ALIF.state_type

    @staticmethod
    def step(p: Any, static: Any, state: Any, current: Any) -> Any:
        V = state.V - p.alpha * (state.V + 65.0) + current
        spike = V >= p.theta
        return type(state)(V, state.raised) if False else state, Response(V, V, V, V, spike, spike)

    def psp_kernel(self) -> PSPKernel:
        return PSPKernel(0.7)


def test_what_cannot_be_compiled_is_told_in_one_sentence_with_its_line() -> None:
    with pytest.raises(ValueError, match=r"Broken.*line \d+, `V = np.floor") as refusal:
        check_neuron(Broken())
    assert "\n" not in str(refusal.value)


def writes_into_its_state(p: Any, static: Any, state: Any, current: Any) -> Any:
    state.V += current
    return state, Response(state.V, 0.0, 0.0, state.V, state.V >= p.theta, state.V >= p.theta)


def returns_a_spike_alone(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = (1.0 - p.alpha) * state.V + current
    return type(state)(V, state.raised), V >= p.theta


def asks_for_what_is_no_field(p: Any, static: Any, state: Any, current: Any) -> Any:
    V = (1.0 - p.leak) * state.V + current
    return type(state)(V, state.raised), Response(V, V, V, V, V >= p.theta, V >= p.theta)


@pytest.mark.parametrize(
    ("mistake", "told"),
    [
        (writes_into_its_state, r"nothing can be written into a State; make a new one, State\(V="),
        (returns_a_spike_alone, r"a step returns its new state and a Response\(V, D, R, X, above"),
        (asks_for_what_is_no_field, "there is no parameter leak; parameters are the numeric field"),
    ],
)
def test_the_commonest_mistakes_in_a_step_are_told(mistake: Any, told: str) -> None:
    body = {"name": f"mistake-{mistake.__name__}", "step": mistake, "__module__": __name__}
    with pytest.raises(ValueError, match=told) as refusal:
        check_neuron(dataclass(frozen=True)(type("Mistaken", (ALIF,), body))())
    assert "\n" not in str(refusal.value)


def test_a_neuron_that_is_not_at_rest_without_input_is_told_so() -> None:
    with pytest.raises(ValueError, match="that hears nothing must stay at rest"):
        check_neuron(Restless())


def test_the_command_line_takes_them(tmp_path: Path) -> None:
    command = [
        sys.executable, "-m", "agents.commands", "train", "--neuron", "my_neurons:ALIF",
        "--learner", "my_rules.py:OwnTempotron", "--trials", "300", "--alpha", "0.2",
        "--out", str(tmp_path / "out"), "--json",
    ]  # fmt: skip
    ended = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    saved = load_checkpoint(json.loads(ended.stdout.splitlines()[-1])["checkpoint"]).agent
    assert (type(saved.neuron), type(saved.rule)) == (ALIF, Tempotron)
    assert saved.neuron.alpha == 0.2


@pytest.mark.parametrize("spec", [None, 3, b"gnm"])
def test_what_names_no_class_is_refused(spec: Any) -> None:
    for find in (find_neuron, find_rule):
        with pytest.raises(ValueError, match="must be given by its name, or as module:Class"):
            find(spec)
    with pytest.raises(ValueError, match=r"cannot import \.x: give the module's whole name"):
        find_neuron(".x:A")


@pytest.mark.parametrize("neuron", [3, "gnm", GNM])
def test_a_rule_is_tried_on_a_neuron(neuron: Any) -> None:
    with pytest.raises(ValueError, match="neuron must be an instance of a class derived from Neur"):
        check_rule(AggregateLabel(), neuron)


def test_a_class_among_the_agents_is_told_so() -> None:
    with pytest.raises(ValueError, match="must be instances, got the class NeuronAgent as agent 0"):
        train_many([NeuronAgent], BUSY, BUSY_PATTERNS, trials=3, seed=1)


def test_parameters_that_hold_an_array_are_refused_by_a_sentence(tmp_path: Path) -> None:
    body = {"name": "array-held", "__annotations__": {"held": Any}, "held": None}
    holding = dataclass(frozen=True)(type("Holding", (ALIF,), {**body, "__module__": __name__}))
    agent = NeuronAgent(holding(held=np.zeros(3)), AggregateLabel(), 10)
    with pytest.raises(ValueError, match=r"Holding\(.* cannot be saved: it would be loaded as"):
        agent.save(tmp_path / "agent.npz")
