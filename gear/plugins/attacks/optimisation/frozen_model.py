"""Switches off the gradients of an attacked model's parameters during an attack."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from torch import nn


def networks_of(model: Any) -> Iterator[tuple[str, nn.Module]]:
    """Yields (name, module) for every torch module of a model.

    A `model` that is a module itself yields only ("model", model). Otherwise first its attributes that are modules
    follow, then its taps (layers with feature maps) as "tap NAME", each sorted by name. A module may be yielded twice.

    Args:
        model: a torch module, or any object with `taps()`.
    """
    if isinstance(model, nn.Module):
        yield "model", model
        return
    for name, value in sorted(getattr(model, "__dict__", {}).items()):
        if isinstance(value, nn.Module):
            yield name, value
    for name, tap in sorted(model.taps().items()):
        yield f"tap {name}", tap


@contextlib.contextmanager
def frozen(model: Any) -> Iterator[None]:
    """A context in which no parameter of a model requires a gradient; `requires_grad` is restored at the end.

    Backward passes then compute only the gradients of the pictures, which is what attacks need.

    Args:
        model: a torch module, or any object with `taps()`.
    """
    parameters = {id(p): p for _, network in networks_of(model) for p in network.parameters() if p.requires_grad}
    for parameter in parameters.values():
        parameter.requires_grad_(False)
    try:
        yield
    finally:
        for parameter in parameters.values():
            parameter.requires_grad_(True)
