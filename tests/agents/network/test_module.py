"""NetworkModule: the same potentials and the same gradients as the compiled network."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from torch import nn  # noqa: E402

from agents.network import (  # noqa: E402
    BackPropagation,
    Network,
    NetworkAgent,
    NetworkModule,
    error_traces,
    padded,
)
from gnm_env import Patterns, Task, draw_trial  # noqa: E402
from tests.agents.network.reference import gradient_learner  # noqa: E402
from tests.agents.network.test_backpropagation import RULES  # noqa: E402
from tests.agents.network.test_dynamics import NETWORKS  # noqa: E402
from tests.agents.worlds import BUSY, BUSY_PATTERNS, play  # noqa: E402

NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
DEVICES = ["cpu", pytest.param("cuda", marks=NEEDS_GPU)]


@pytest.fixture(autouse=True)
def one_thread() -> Any:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def busy_trials(n: int, seed: int = 0) -> list[Any]:
    rng = np.random.default_rng(seed)
    return [draw_trial(BUSY, BUSY_PATTERNS, rng) for _ in range(n)]


def gradient(module: NetworkModule, trials: list[Any], rule: BackPropagation) -> Any:
    """∂J/∂w summed over the trials, laid out as an agent's weights are."""
    spikes, mask = padded(trials, dtype=module.u.dtype, device=module.u.device)
    V = module(spikes, mask)
    J = (error_traces(V, trials, module.network, rule) * V).sum()
    parts = torch.autograd.grad(J, list(module.parameters()))
    by_name = dict(zip([name for name, _ in module.named_parameters()], parts, strict=True))
    layers = [by_name[name].flatten().cpu() for name in ("W", "u") if name in by_name]
    return torch.cat(layers).numpy()


CASES = [(name, rule, "cpu") for name in (*NETWORKS, "no hidden layer") for rule in RULES]


@pytest.mark.parametrize(
    ("name", "rule", "device"),
    [*CASES, pytest.param("all differ", "default", "cuda", marks=NEEDS_GPU)],
)
def test_gradients_are_those_of_the_compiled_network(name: str, rule: str, device: str) -> None:
    network = NETWORKS.get(name, Network(hidden=None))
    trials = busy_trials(6)
    start = gradient_learner(network, BUSY.n_inputs, 2, **RULES[rule])
    expected = np.zeros(len(start.weights))
    for trial in trials:
        agent = gradient_learner(network, BUSY.n_inputs, 2, **RULES[rule])
        play(agent, trial)
        expected += agent.velocity
    module = NetworkModule.from_agent(start, device=device)
    found = gradient(module, trials, start.rule)
    scale = np.abs(expected).max()
    assert scale > 0
    assert np.abs(found - expected).max() <= 1e-9 * max(scale, 1.0)


@pytest.mark.parametrize("classes", [1, 2])
def test_gradients_agree_on_full_size_trials(classes: int) -> None:
    task = Task(n_classes=classes)
    patterns = Patterns.draw(task, 0)
    rng = np.random.default_rng(0)
    for seed in range(3):
        trial = draw_trial(task, patterns, rng)
        agent = NetworkAgent(
            rule=BackPropagation(1.0, 1.0, max_step=np.inf), seed=seed, initial_weight=0.6
        )
        module = NetworkModule.from_agent(agent)
        found = gradient(module, [trial], agent.rule)
        play(agent, trial)
        assert np.abs(agent.velocity).max() > 1
        np.testing.assert_allclose(found, agent.velocity, rtol=0, atol=1e-9)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(("dtype", "rtol"), [(torch.float64, 1e-12), (torch.float32, 1e-4)])
def test_potentials_are_those_of_the_compiled_network(dtype: Any, rtol: float, device: str) -> None:
    agent = gradient_learner(Network(hidden=5), BUSY.n_inputs)
    trials = busy_trials(4)
    module = NetworkModule.from_agent(agent, dtype=dtype, device=device)
    V = module(*padded(trials, device=device))
    assert V.dtype == dtype
    for k, trial in enumerate(trials):
        expected = agent.record(trial).V
        np.testing.assert_allclose(
            V[k, : trial.n_bins, 0].detach().cpu(), expected, rtol=rtol, atol=rtol
        )
        assert (V[k, trial.n_bins :] == 0).all()
    assert len({trial.n_bins for trial in trials}) > 1, "some trials should need filling up"


@pytest.mark.parametrize("name", NETWORKS)
def test_gradcheck_passes_for_weights_and_input(name: str) -> None:
    network = NETWORKS[name]
    torch.manual_seed(3)
    module = NetworkModule(network, 3, 2, initial_weight=1.5, dtype=torch.float64)
    currents = torch.rand(2, 6, 3, dtype=torch.float64, requires_grad=True)

    def potentials(currents: Any, W: Any, u: Any) -> Any:
        return torch.func.functional_call(module, {"W": W, "u": u}, (currents,))

    assert torch.autograd.gradcheck(potentials, (currents, module.W, module.u))


def test_a_batch_is_its_trials_one_by_one() -> None:
    module = NetworkModule(Network(hidden=3), BUSY.n_inputs, 2, initial_weight=1.0)
    trials = busy_trials(5)
    together = module(*padded(trials))
    for k, trial in enumerate(trials):
        by_itself = module(*padded([trial]))
        torch.testing.assert_close(together[k : k + 1, : trial.n_bins], by_itself)


def test_what_fills_up_a_trial_teaches_nothing() -> None:
    module = NetworkModule(Network(hidden=3), BUSY.n_inputs, dtype=torch.float64)
    spikes, mask = padded(busy_trials(3), dtype=torch.float64)
    spikes.requires_grad_()
    module(spikes, mask).sum().backward()
    assert spikes.grad is not None
    assert (spikes.grad[~mask] == 0).all()
    assert (spikes.grad[mask] != 0).any()


@pytest.mark.parametrize("device", DEVICES)
def test_it_is_a_layer_of_a_larger_model(device: str) -> None:
    """Two in a row, with a linear map between them, learn to tell early from late input."""
    torch.manual_seed(0)
    model = nn.Sequential(
        nn.Linear(4, 6), NetworkModule(Network(hidden=8), 6, 3), nn.Linear(3, 1)
    ).to(device)
    x = torch.zeros(32, 20, 4, device=device)
    early = torch.arange(32) % 2 == 0
    x[early, 2:5] = 1.0
    x[~early, 12:15] = 1.0
    y = early.float().to(device)
    optimiser = torch.optim.Adam(model.parameters(), lr=0.05)
    losses = []
    for _ in range(40):
        loss = nn.functional.binary_cross_entropy_with_logits(model(x)[:, -1, 0], y)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
    assert losses[-1] < 0.1 < 0.5 < losses[0]
    state = model.state_dict()
    assert {"1.W", "1.u"} <= set(state)


def test_weights_go_from_agent_to_module_and_back() -> None:
    agent = NetworkAgent(Network(hidden=3), n_inputs=5, seed=1)
    weights = agent.weights.copy()
    module = NetworkModule.from_agent(agent)
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.mul_(2.0)
    assert np.array_equal(agent.weights, weights), "the module has weights of its own"
    module.write_to(agent)
    assert np.array_equal(agent.weights, 2.0 * weights)


def test_equal_generators_give_equal_weights() -> None:
    one, other = (
        NetworkModule(n_inputs=5, generator=torch.Generator().manual_seed(4)) for _ in range(2)
    )
    assert torch.equal(one.W, other.W)
    assert torch.equal(one.u, other.u)
    W = one.W.detach()
    assert 0 <= W.min() < 0.1 < 0.2 < W.max() < 0.3


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m(torch.zeros(2, 7)), r"spikes must have shape \(batch, T, n_inputs = 5\)"),
        (lambda m: m(torch.zeros(2, 7, 4)), r"got \(2, 7, 4\)"),
        (
            lambda m: m(torch.zeros(2, 7, 5), torch.ones(2, 6, dtype=torch.bool)),
            r"mask must have shape \(batch, T\) = \(2, 7\), got \(2, 6\)",
        ),
        (lambda m: m.write_to(NetworkAgent(Network(hidden=3), n_inputs=5)), "hidden = 10"),
        (lambda m: NetworkModule(3), "network must be a Network, got 3"),
        (lambda m: NetworkModule(n_outputs=0), "n_outputs must be >= 1, got 0"),
        (lambda m: padded([]), "at least one trial"),
    ],
)
def test_what_does_not_fit_is_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(NetworkModule(n_inputs=5))


def test_potentials_that_are_no_number_do_not_pass_for_silence() -> None:
    module = NetworkModule(Network(hidden=2), 1)
    spikes = torch.tensor([[[1.0], [float("nan")], [0.0]]])
    V = module(spikes)[0, :, 0]
    assert torch.isfinite(V[0])
    assert torch.isnan(V[1:]).all()
