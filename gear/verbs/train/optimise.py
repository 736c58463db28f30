"""The optimiser, the learning rate schedule, and the moving average of the weights."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from gear.verbs.train.config import TrainConfig

MOMENTUM = 0.9


def optimiser_of(module: nn.Module, config: TrainConfig) -> torch.optim.Optimizer:
    """Returns AdamW or SGD for the trainable parameters; one-dimensional parameters (biases, normalisation) have
    no weight decay.

    Args:
        module: the network.
        config: config of the training, with the optimiser's name, learning rate and weight decay.
    """
    trained = [parameter for parameter in module.parameters() if parameter.requires_grad]
    groups = [
        {"params": [p for p in trained if p.dim() > 1], "weight_decay": config.weight_decay},
        {"params": [p for p in trained if p.dim() <= 1], "weight_decay": 0.0},
    ]
    if config.optimiser == "sgd":
        return torch.optim.SGD(groups, lr=config.learning_rate, momentum=MOMENTUM)
    return torch.optim.AdamW(groups, lr=config.learning_rate)


def rate_share(progress: float, *, warmup_fraction: float, final: float) -> float:
    """Returns the learning rate as a share of its peak: a linear rise, then half a cosine.

    The cosine is eq. 5 of Loshchilov and Hutter, "SGDR", 2017, without restarts.

    Args:
        progress: share of the training that is finished, 0..1.
        warmup_fraction: share of the training during which the rate rises.
        final: learning rate at the end, as a share of the peak.
    """
    if progress < warmup_fraction:
        return final + (1 - final) * progress / warmup_fraction
    fallen = min(1.0, (progress - warmup_fraction) / (1 - warmup_fraction))
    return final + (1 - final) * (1 + math.cos(math.pi * fallen)) / 2


class RunningMean:
    """An exponential moving average of a network's weights (cf. Polyak and Juditsky, 1992), with a smaller decay
    in the first steps.

    Attributes:
        decay: largest decay per step.
        state: averaged tensors by key of the state dict; integer tensors are the network's current ones.
    """

    def __init__(self, module: nn.Module, decay: float) -> None:
        """Starts the average with the current weights of `module`; `decay` is the largest decay per step."""
        self.decay = decay
        self.state = {key: value.detach().clone() for key, value in module.state_dict().items()}

    @torch.no_grad()
    def update(self, module: nn.Module, step: int) -> None:
        """Adds the current weights to the average; the first steps have more weight, so the average soon forgets the
        initial weights.

        Args:
            module: the trained network.
            step: number of the step, counted from 0.
        """
        decay = min(self.decay, (1 + step) / (10 + step))
        newest = module.state_dict()
        moving = [key for key, value in newest.items() if value.is_floating_point()]
        if moving:
            torch._foreach_lerp_([self.state[key] for key in moving], [newest[key] for key in moving], 1 - decay)
        for key in newest.keys() - moving:
            self.state[key].copy_(newest[key])


class Buffers:
    """A copy of a module's buffers, such as batch normalisation statistics, from which the buffers can be restored."""

    def __init__(self, module: nn.Module) -> None:
        """Prepares copies of the buffers of `module`."""
        self._module = module
        self._buffers: list[Tensor] = []
        self._kept: list[Tensor] = []
        self.keep()

    @torch.no_grad()
    def keep(self) -> None:
        """Copies the current values of the module's buffers."""
        buffers = list(self._module.buffers())
        if list(map(id, buffers)) == list(map(id, self._buffers)) and buffers:
            torch._foreach_copy_(self._kept, buffers)
        else:
            self._buffers, self._kept = buffers, [buffer.clone() for buffer in buffers]

    @torch.no_grad()
    def put_back(self) -> None:
        """Restores the buffers from the copy."""
        if self._kept:
            torch._foreach_copy_(self._buffers, self._kept)


def clip_gradients(module: nn.Module, max_norm: float) -> Tensor:
    """Scales the gradients of all parameters, in place, to a total norm of at most `max_norm`.

    Args:
        module: the network after the backward pass.
        max_norm: largest norm; 0 means no limit.

    Returns:
        The norm before scaling.
    """
    return nn.utils.clip_grad_norm_(module.parameters(), max_norm if max_norm > 0 else math.inf)
