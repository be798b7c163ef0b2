"""Policies made of GNMs (η = 0): one neuron that is the whole policy, and a layer that feeds one.

Both hear raw bits and are policies of sb3-contrib's RecurrentPPO; their memory is the potential.

`GnmPolicy` is a neuron of N weights. In each bin it is above its threshold with probability
σ(slope (V − ϑ)), drawn while it learns, so that PPO's gradient by the weights is exact; with
`rising_edge` in its observation config a spike is a change to above. Without chance it is the
neuron itself: `neuron_agent` gives it as a `NeuronAgent`.

`SpikingPolicy` has a layer of neurons under SB3's perceptron, which is shown their potentials and
spikes. A spike has no derivative; the triangle in its place is that of `SurrogateGradient`.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

from agents.learning.aggregate_label import AggregateLabel
from agents.neuron_agent import NeuronAgent
from agents.neurons.gnm import GNM
from agents.rl.memory import LeakySum, MemoryPolicy, States


class Spike(torch.autograd.Function):
    """1 where V rises through 1, else 0; its derivative is a triangle, 1 at the threshold."""

    @staticmethod
    def forward(ctx: Any, V: Tensor, before: Tensor) -> Tensor:
        """Spikes (T, n, H) of potentials (T, n, H) and those one bin before."""
        ctx.save_for_backward(V, before)
        return ((V >= 1.0) & (before < 1.0)).to(V.dtype)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        """Gradient of the potentials; what was one bin before is taken as given."""
        V, before = ctx.saved_tensors
        near = torch.clamp(1.0 - (V - 1.0).abs(), min=0.0)
        return gradients[0] * near * (before < 1.0), None


class NeuronLayer(nn.Module):
    """V_t = (1 − α) V_{t−1} + W x_t, called as an `nn.LSTM` is.

    Args:
        input_size: N.
        neurons: H.
        alpha: decay of the potential per bin.
        initial_weight: upper end of the uniform initial weights; the lower one is 0.
        spikes: whether the output is potentials and spikes, (T, n, 2 H), or potentials only.
    """

    num_layers = 1

    def __init__(
        self, input_size: int, neurons: int, alpha: float, initial_weight: float, spikes: bool
    ) -> None:
        super().__init__()
        self.input_size, self.spikes = input_size, spikes
        self.hidden_size = neurons * (2 if spikes else 1)
        self.weight = nn.Parameter(initial_weight * torch.rand(neurons, input_size))
        self.register_buffer("keep", torch.full((neurons,), 1.0 - alpha))

    def forward(self, inputs: Tensor, states: States) -> tuple[Tensor, States]:
        """Outputs of inputs (T, n, N), and the states (1, n, hidden) after: potentials first."""
        neurons = len(self.weight)
        before = states[0][0, :, :neurons]
        V = LeakySum.apply(inputs @ self.weight.T, before, self.keep)
        last = V[-1:]
        if not self.spikes:
            return V, (last, states[1])
        earlier = torch.cat([before[None], V[:-1]])
        z = Spike.apply(V, earlier)
        return torch.cat([V, z], dim=-1), (torch.cat([last, z[-1:]], dim=-1), states[1])


class GnmPolicy(MemoryPolicy):
    """One GNM: N weights, and nothing else that says what to do.

    Args:
        arguments: those of SB3's policy, with `lstm_hidden_size` = 1 and no layers.
        alpha: decay of the potential per bin.
        slope: how sharply the probability of being above rises at the threshold.
        initial_weight: upper end of the uniform initial weights.
    """

    starts_near_silence = True

    def __init__(
        self,
        *arguments: Any,
        alpha: float = 0.3,
        slope: float = 10.0,
        initial_weight: float | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
        largest = GNM.default_initial_weight if initial_weight is None else initial_weight
        self.memory_settings = {"alpha": alpha, "slope": slope, "initial_weight": initial_weight}
        self.lstm_actor = NeuronLayer(self.features_dim, 1, alpha, largest, spikes=False)  # type: ignore[assignment]
        logits: Any = self.action_net
        with torch.no_grad():  # their difference is slope (V − ϑ)
            logits.weight.copy_(torch.tensor([[0.0], [slope]]))
            logits.bias.copy_(torch.tensor([0.0, -slope]))
        logits.requires_grad_(False)
        self._optimise_anew(arguments, settings)

    def neuron_agent(self) -> NeuronAgent:
        """The neuron without chance: what the policy does when it is asked deterministically."""
        layer: Any = self.lstm_actor
        neuron = GNM(alpha=self.memory_settings["alpha"])
        agent = NeuronAgent(neuron, AggregateLabel(), n_inputs=layer.input_size, weight_bounds=None)
        agent.weights[:] = layer.weight.detach().double().numpy()[0]
        return agent


class SpikingPolicy(MemoryPolicy):
    """A layer of GNMs below SB3's perceptron.

    Args:
        arguments: those of SB3's policy; `lstm_hidden_size` is twice the number of neurons.
        alpha: decay of the potentials per bin.
        gain: standard deviation that noise gives to the potentials at the start, roughly.
    """

    def __init__(
        self, *arguments: Any, alpha: float = 0.3, gain: float = 1.0, **settings: Any
    ) -> None:
        super().__init__(*arguments, **settings)
        self.memory_settings = {"alpha": alpha, "gain": gain}
        neurons = self.lstm_actor.hidden_size // 2
        layer = NeuronLayer(self.features_dim, neurons, alpha, 0.0, spikes=True)
        with torch.no_grad():
            layer.weight.copy_(gain * torch.randn_like(layer.weight))
        self.lstm_actor = layer  # type: ignore[assignment]
        self._optimise_anew(arguments, settings)
