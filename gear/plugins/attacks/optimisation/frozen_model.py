"""Freezes the parameters of an attacked model."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from torch import nn


def networks_of(model: Any) -> Iterator[tuple[str, nn.Module]]:
    """The torch modules of a model, with their names: the model itself or those of its attributes that are
    modules, and its taps.
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
    """Context in which no parameter requires a gradient, so that backward passes compute only gradients of the
    pictures.
    """
    parameters = {id(p): p for _, network in networks_of(model) for p in network.parameters() if p.requires_grad}
    for parameter in parameters.values():
        parameter.requires_grad_(False)
    try:
        yield
    finally:
        for parameter in parameters.values():
            parameter.requires_grad_(True)
