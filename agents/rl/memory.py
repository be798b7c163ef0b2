"""Policies with a memory of their own, for raw bits: an LSTM, and leaky integrators.

Both are policies of sb3-contrib's RecurrentPPO. Its LSTM, as PyTorch starts it, forgets half of its
memory in each bin, and one input spike moves it by a few per cent: the policy's answers begin, and
stay, all but independent of what was heard. Here the start is chosen for inputs that are 1 in one
bin of 200, and a sequence is walked through in one call instead of bin by bin.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from torch import Tensor, nn

States = tuple[Tensor, Tensor]


class MemoryPolicy(RecurrentActorCriticPolicy):
    """RecurrentPPO's policy, started for sparse bits; see `LstmPolicy` and `LeakyPolicy`."""

    @staticmethod
    def _process_sequence(
        features: Tensor, lstm_states: States, episode_starts: Tensor, lstm: nn.LSTM
    ) -> tuple[Tensor, Any]:
        """Outputs (n·T, hidden) of n sequences, each in one call where none begins within it.

        SB3's buffer cuts sequences where episodes begin, so that only the first bin of one can be
        the first of an episode. SB3 itself walks bin by bin all the same, five times slower.
        """
        n = lstm_states[0].shape[1]
        starts = episode_starts.reshape(n, -1)
        if starts.shape[1] > 1 and bool(starts[:, 1:].any()):
            return RecurrentActorCriticPolicy._process_sequence(
                features, lstm_states, episode_starts, lstm
            )
        goes_on = (1.0 - starts[:, 0]).view(1, n, 1)
        begin = (goes_on * lstm_states[0], goes_on * lstm_states[1])
        sequence = features.reshape(n, -1, lstm.input_size).swapaxes(0, 1)
        outputs, states = lstm(sequence, begin)
        return outputs.swapaxes(0, 1).flatten(0, 1), states

    memory_settings: dict[str, Any]
    """Arguments of a policy's own, which its file keeps."""

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), **self.memory_settings}

    def _optimise_anew(self, arguments: tuple[Any, ...], settings: dict[str, Any]) -> None:
        """A new optimiser, for what the policy now consists of."""
        schedule = settings["lr_schedule"] if "lr_schedule" in settings else arguments[2]
        learned = [parameter for parameter in self.parameters() if parameter.requires_grad]
        optimizer: Any = self.optimizer_class
        self.optimizer = optimizer(learned, lr=schedule(1), **self.optimizer_kwargs)


class LstmPolicy(MemoryPolicy):
    """An LSTM that begins as a row of leaky integrators of random sums of its inputs.

    Args:
        arguments: those of SB3's policy.
        keep: the share of its memory that it keeps from bin to bin at the start, in (0, 1).
        gain: standard deviation of the weights from the inputs to the memory.
        recurrent: factor on the weights from the last output.
    """

    def __init__(
        self,
        *arguments: Any,
        keep: float = 0.7,
        gain: float = 1.0,
        recurrent: float = 0.3,
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
        self.memory_settings = {"keep": keep, "gain": gain, "recurrent": recurrent}
        _begin_leaky(self.lstm_actor, keep, gain, recurrent)


OPEN = 2.0
"""Bias of the LSTM's gates that let in and out: they begin 88 % open."""


def _begin_leaky(lstm: Any, keep: float, gain: float, recurrent: float) -> None:
    size = lstm.hidden_size
    into, forget, cell, out = (slice(k * size, (k + 1) * size) for k in range(4))
    with torch.no_grad():
        lstm.bias_ih_l0.zero_()
        lstm.bias_hh_l0.zero_()
        lstm.bias_ih_l0[into] = OPEN
        lstm.bias_ih_l0[out] = OPEN
        lstm.bias_ih_l0[forget] = math.log(keep / (1.0 - keep))
        lstm.weight_hh_l0.mul_(recurrent)
        lstm.weight_ih_l0[cell] = gain * torch.randn(size, lstm.input_size)


class LeakyPolicy(MemoryPolicy):
    """Leaky integrators in the LSTM's place: a linear state-space layer whose decays are learned.

    Args:
        arguments: those of SB3's policy; `lstm_hidden_size` is the number of integrators.
        keep: shares kept from bin to bin at the start, spread evenly over the integrators' time
            constants from the first to the second.
        gain: standard deviation of what one input spike adds to an integrator.
    """

    def __init__(
        self,
        *arguments: Any,
        keep: tuple[float, float] = (0.7, 0.7),
        gain: float = 1.0,
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
        self.memory_settings = {"keep": tuple(keep), "gain": gain}
        size = self.lstm_actor.hidden_size
        memory: Any = LeakyIntegrators(self.features_dim, size, keep, gain)
        self.lstm_actor = memory
        self._optimise_anew(arguments, settings)


class LeakyIntegrators(nn.Module):
    """h_t = k ⊙ h_{t−1} + W x_t, output tanh(h_t + b); called as an `nn.LSTM` is.

    Attributes:
        input_size, hidden_size, num_layers: as SB3 asks for them.
    """

    num_layers = 1

    def __init__(
        self, input_size: int, hidden_size: int, keep: tuple[float, float], gain: float
    ) -> None:
        super().__init__()
        self.input_size, self.hidden_size = input_size, hidden_size
        self.weight = nn.Parameter(gain * torch.randn(hidden_size, input_size))
        self.bias = nn.Parameter(torch.zeros(hidden_size))
        # Evenly in the logarithm of the time constant −1 / ln k.
        slow, fast = (math.log(-math.log(k)) for k in keep)
        rates = torch.linspace(slow, fast, hidden_size).exp()
        kept = torch.exp(-rates)
        self.logit = nn.Parameter(torch.log(kept / (1.0 - kept)))

    def forward(self, inputs: Tensor, states: States) -> tuple[Tensor, States]:
        """Outputs (T, n, hidden) of inputs (T, n, input), and the states (1, n, hidden) after."""
        drive = inputs @ self.weight.T
        sums = LeakySum.apply(drive, states[0][0], torch.sigmoid(self.logit))
        return torch.tanh(sums + self.bias), (sums[-1:], states[1])


class LeakySum(torch.autograd.Function):
    """h_t = k ⊙ h_{t−1} + u_t over all t, with its gradient by one walk back."""

    @staticmethod
    def forward(ctx: Any, drive: Tensor, before: Tensor, kept: Tensor) -> Tensor:
        """(T, n, H) of the drive (T, n, H), the state before (n, H) and the shares kept (H,)."""
        sums = drive.clone()
        last = before
        for now in sums:
            last = now.addcmul_(last, kept)
        ctx.save_for_backward(sums, before, kept)
        return sums

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Gradients of the drive, of the state before, and of the shares kept."""
        sums, before, kept = ctx.saved_tensors
        of_drive = gradients[0].clone()
        for t in range(len(of_drive) - 1, 0, -1):
            of_drive[t - 1].addcmul_(of_drive[t], kept)
        of_kept = (of_drive[0] * before).sum(0) + (of_drive[1:] * sums[:-1]).sum((0, 1))
        return of_drive, of_drive[0] * kept, of_kept
