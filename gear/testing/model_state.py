"""A model's state, so that whoever borrows a model can be held to leaving it as it was."""

from __future__ import annotations

import hashlib
from typing import Any

import torch

from gear.plugins.attacks.optimisation.frozen_model import networks_of


def state_of(model: Any) -> dict[str, str]:
    """Every parameter and buffer as a hash, with whether it wants a gradient and has one, and every module's mode."""
    state: dict[str, str] = {}
    for root, network in networks_of(model):
        for name, module in network.named_modules():
            state[f"{root}.{name} mode"] = "train" if module.training else "eval"
        for name, parameter in network.named_parameters():
            grad = "" if parameter.grad is None else _hash(parameter.grad)
            state[f"{root}.{name}"] = f"{_hash(parameter)} requires_grad={parameter.requires_grad} grad={grad}"
        for name, buffer in network.named_buffers():
            state[f"{root}.{name}"] = _hash(buffer)
    return state


def changes(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """Names whose state differs."""
    return sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))


def _hash(tensor: torch.Tensor) -> str:
    plain = tensor.detach().cpu().contiguous().reshape(-1).view(torch.uint8)
    return hashlib.sha256(plain.numpy().tobytes()).hexdigest()
