"""The network as a torch.nn.Module: the same equations, differentiable, for batches of trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor, nn

from agents.network.backpropagation import error_trace_of
from agents.network.dynamics import largest_ratio
from agents.network.network_agent import NetworkAgent
from agents.network.parameters import BackPropagation, Network
from gnm_env.checks import whole
from gnm_env.trial import Trial


class NetworkModule(nn.Module):
    """A layer of hidden GNM neurons and one or more GNM readouts; spikes in, potentials out.

    Takes input spikes, or any other input currents, of shape (batch, T, N) and gives the potentials
    of the readouts, (batch, T, n_outputs); see `Network` for the equations. Differentiable
    throughout, also by its input, so that it can be a layer of a larger model.

    Args:
        network: its size and parameters; None: the defaults.
        n_inputs: N.
        n_outputs: number of readouts; a NetworkAgent has one.
        initial_weight: upper end of the initial weights, uniform on [0, initial_weight).
        generator: of the initial weights; None: torch's own.
        dtype, device: of the weights; None: torch's defaults.

    Attributes:
        W: parameter (N, H); None without a hidden layer.
        u: parameter (H, n_outputs), or (N, n_outputs) without a hidden layer.

    Raises:
        ValueError: if an argument is out of range.
    """

    W: nn.Parameter | None

    def __init__(
        self,
        network: Network | None = None,
        n_inputs: int = 100,
        n_outputs: int = 1,
        *,
        initial_weight: float = Network.default_initial_weight,
        generator: torch.Generator | None = None,
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        self.network = Network() if network is None else network
        if not isinstance(self.network, Network):
            raise ValueError(f"network must be a Network, got {network!r}")
        self.n_inputs = whole("n_inputs", n_inputs, low=1)
        n_outputs = whole("n_outputs", n_outputs, low=1)

        def drawn(*shape: int) -> nn.Parameter:
            where = generator.device if generator is not None else device
            values = torch.rand(*shape, generator=generator, dtype=dtype, device=where)
            return nn.Parameter((values * initial_weight).to(device))

        hidden = self.network.hidden
        self.W = None if hidden is None else drawn(self.n_inputs, hidden)
        self.u = drawn(self.n_inputs if hidden is None else hidden, n_outputs)

    @classmethod
    def from_agent(
        cls,
        agent: NetworkAgent,
        *,
        dtype: torch.dtype = torch.float64,
        device: torch.device | str | None = None,
    ) -> NetworkModule:
        """A module with the parameters and (copied) weights of `agent`."""
        module = cls(agent.network, agent.n_inputs, dtype=dtype, device=device)
        with torch.no_grad():
            if module.W is not None:
                module.W.copy_(torch.from_numpy(agent.hidden_weights))
            module.u.copy_(torch.from_numpy(agent.output_weights)[:, None])
        return module

    def write_to(self, agent: NetworkAgent) -> None:
        """Copy the weights into `agent`. ValueError unless it is a network of this size."""
        mine = (self.network.hidden, self.n_inputs, 1)
        if (agent.network.hidden, agent.n_inputs, self.u.shape[1]) != mine:
            raise ValueError(
                f"the agent must have hidden = {mine[0]} and n_inputs = {mine[1]} and the module "
                f"one output, got {agent.network.hidden}, {agent.n_inputs} and {self.u.shape[1]}"
            )
        if self.W is not None:
            agent.hidden_weights = self.W.detach().cpu().numpy()
        agent.output_weights = self.u.detach().cpu().numpy()[:, 0]

    def forward(self, spikes: Tensor, mask: Tensor | None = None) -> Tensor:
        """Potentials of the readouts, (batch, T, n_outputs), of `spikes`, (batch, T, N).

        `mask`, bool (batch, T), is False in bins that only fill up a trial to the longest of the
        batch; potentials are 0 there. Fill up at the end: bins before would be heard as silence.
        """
        if spikes.ndim != 3 or spikes.shape[2] != self.n_inputs:
            raise ValueError(
                f"spikes must have shape (batch, T, n_inputs = {self.n_inputs}), "
                f"got {tuple(spikes.shape)}"
            )
        V = self._leaky(self._currents(spikes) @ self.u, self.network.alpha)
        if mask is None:
            return V
        if mask.shape != spikes.shape[:2]:
            raise ValueError(
                f"mask must have shape (batch, T) = {tuple(spikes.shape[:2])}, "
                f"got {tuple(mask.shape)}"
            )
        return V * mask[:, :, None].to(V.dtype)

    def _currents(self, spikes: Tensor) -> Tensor:
        """What the readouts weigh: j, (batch, T, H), or the input itself."""
        spikes = spikes.to(self.u.dtype)
        if self.W is None:
            return spikes
        drives = spikes @ self.W
        v = torch.zeros_like(drives[:, 0])
        z = torch.zeros_like(v)
        outputs = []
        for drive in drives.unbind(1):
            others = z.sum(dim=1, keepdim=True) - z
            v = v - self.network.alpha * v - self.network.inhibition * others + drive
            z = self._hill(v)
            outputs.append(z)
        return self._leaky(torch.stack(outputs, 1), self.network.kappa)

    def _hill(self, v: Tensor) -> Tensor:
        """H(v) = v^h / (ϑ_B^h + v^h), 0 for v <= 0."""
        h = self.network.h
        # Not relu: its result for NaN depends on the device.
        ratio = torch.where(v <= 0, torch.zeros_like(v), v / self.network.theta_b)
        ratio = ratio.clamp(max=largest_ratio(h))
        power = ratio**h
        return power / (1 + power)

    @staticmethod
    def _leaky(drives: Tensor, decay: float) -> Tensor:
        """x(t) = (1 − decay) x(t−1) + drive(t), from x = 0, along axis 1."""
        x = torch.zeros_like(drives[:, 0])
        values = []
        for drive in drives.unbind(1):
            x = x - decay * x + drive
            values.append(x)
        return torch.stack(values, 1)


def padded(
    trials: Sequence[Trial],
    *,
    dtype: torch.dtype | None = None,
    device: torch.device | str | None = None,
) -> tuple[Tensor, Tensor]:
    """Trials of any lengths as one batch: spikes (batch, T, N), and mask (batch, T), bool.

    T is the longest trial's length; the others are filled up with silence at their ends.
    """
    if not trials:
        raise ValueError("a batch must have at least one trial, got none")
    longest = max(trial.n_bins for trial in trials)
    raster = np.zeros((len(trials), longest, trials[0].n_inputs), np.bool_)
    mask = np.zeros((len(trials), longest), np.bool_)
    for k, trial in enumerate(trials):
        raster[k, : trial.n_bins] = trial.dense()
        mask[k, : trial.n_bins] = True
    spikes = torch.from_numpy(raster).to(device)
    return spikes.to(dtype or torch.get_default_dtype()), torch.from_numpy(mask).to(device)


def error_traces(
    V: Tensor, trials: Sequence[Trial], network: Network, rule: BackPropagation | None = None
) -> Tensor:
    """E(t) of a batch of trials, (batch, T, 1), from the potentials V that `forward` gave for them.

    Held fixed, as the rule wants it: `(error_traces(V, …) * V).sum()` is J, and its gradient by the
    weights is what a NetworkAgent learns from these trials. 0 beyond the end of each trial.
    """
    potentials = V.detach().to("cpu", torch.float64).numpy()[:, :, 0]
    if len(potentials) != len(trials) or potentials.shape[1] < max(t.n_bins for t in trials):
        raise ValueError(
            f"V must have shape (batch, T, 1) for {len(trials)} trials of up to "
            f"{max(t.n_bins for t in trials)} bins, got {tuple(V.shape)}"
        )
    numbers = (BackPropagation() if rule is None else rule).numbers()
    E = np.zeros_like(potentials)
    for k, trial in enumerate(trials):
        of_trial = np.ascontiguousarray(potentials[k, : trial.n_bins])
        E[k, : trial.n_bins] = error_trace_of(numbers, network.theta_r, of_trial, trial.arrays)
    return torch.from_numpy(E).to(V)[:, :, None]
