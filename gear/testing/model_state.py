"""Snapshots of a model's weights and modes, to check that code that uses the model leaves it unchanged."""

from __future__ import annotations

import hashlib
from typing import Any

import torch

from gear.plugins.attacks.optimisation.frozen_model import networks_of


def state_of(model: Any) -> dict[str, str]:
    """A snapshot of a model: hashes of parameters, gradients and buffers, `requires_grad`, and modes, by name.

    Args:
        model: a torch module, or a model whose attributes and taps are torch modules.
    """
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
    """The sorted names of the entries that differ between two snapshots of `state_of`.

    Args:
        before, after: hashes of the entries by name, as `state_of` returns them.
    """
    return sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))


def _hash(tensor: torch.Tensor) -> str:
    plain = tensor.detach().cpu().contiguous().reshape(-1).view(torch.uint8)
    return hashlib.sha256(plain.numpy().tobytes()).hexdigest()
