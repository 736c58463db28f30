"""Optimiser, learning rate schedule, and the moving average of the weights."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from gear.verbs.train.config import TrainConfig

MOMENTUM = 0.9


def optimiser_of(module: nn.Module, config: TrainConfig) -> torch.optim.Optimizer:
    """AdamW or SGD over the trainable parameters; one-dimensional parameters (biases, normalisation) have no
    weight decay.
    """
    trained = [parameter for parameter in module.parameters() if parameter.requires_grad]
    groups = [
        {"params": [p for p in trained if p.dim() > 1], "weight_decay": config.weight_decay},
        {"params": [p for p in trained if p.dim() <= 1], "weight_decay": 0.0},
    ]
    if config.optimiser == "sgd":
        return torch.optim.SGD(groups, lr=config.learning_rate, momentum=MOMENTUM)
    return torch.optim.AdamW(groups, lr=config.learning_rate)


def rate_share(progress: float, *, warm_up: float, final: float) -> float:
    """The learning rate as a share of its peak: a linear rise, then half a cosine (Loshchilov and Hutter, "SGDR",
    2017,
    eq. 5, without restarts).

    Args:
        progress: share of the training that is finished, 0..1.
        warm_up: share during which the rate rises.
        final: share of the peak at the end.
    """
    if progress < warm_up:
        return final + (1 - final) * progress / warm_up
    fallen = min(1.0, (progress - warm_up) / (1 - warm_up))
    return final + (1 - final) * (1 + math.cos(math.pi * fallen)) / 2


class RunningMean:
    """An average of the weights over the last steps (Polyak and Juditsky, 1992), over fewer steps at the
    beginning.

    Attributes:
        state: averaged tensors by the module's keys; integer tensors are the module's newest.
    """

    def __init__(self, module: nn.Module, decay: float) -> None:
        self.decay = decay
        self.state = {key: value.detach().clone() for key, value in module.state_dict().items()}

    @torch.no_grad()
    def update(self, module: nn.Module, step: int) -> None:
        """Adds the weights after a step to the average; steps count from 0."""
        decay = min(self.decay, (1 + step) / (10 + step))
        newest = module.state_dict()
        moving = [key for key, value in newest.items() if value.is_floating_point()]
        if moving:
            torch._foreach_lerp_([self.state[key] for key in moving], [newest[key] for key in moving], 1 - decay)
        for key in newest.keys() - moving:
            self.state[key].copy_(newest[key])


class Buffers:
    """A copy of a module's buffers, such as running statistics, that can be restored."""

    def __init__(self, module: nn.Module) -> None:
        self._module = module
        self._buffers: list[Tensor] = []
        self._kept: list[Tensor] = []
        self.keep()

    @torch.no_grad()
    def keep(self) -> None:
        """Stores the buffers in their current state."""
        buffers = list(self._module.buffers())
        if list(map(id, buffers)) == list(map(id, self._buffers)) and buffers:
            torch._foreach_copy_(self._kept, buffers)
        else:
            self._buffers, self._kept = buffers, [buffer.clone() for buffer in buffers]

    @torch.no_grad()
    def put_back(self) -> None:
        """Restores the stored buffers."""
        if self._kept:
            torch._foreach_copy_(self._buffers, self._kept)


def clip_gradients(module: nn.Module, most: float) -> Tensor:
    """Scales gradients to a norm of at most `most`, or not at all if that is 0; returns the original norm."""
    return nn.utils.clip_grad_norm_(module.parameters(), most if most > 0 else math.inf)
