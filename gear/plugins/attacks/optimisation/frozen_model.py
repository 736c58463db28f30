"""A model that is only borrowed: it is attacked, and left as it was."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from torch import nn


def networks_of(model: Any) -> Iterator[tuple[str, nn.Module]]:
    """The torch modules of a model: itself, or its attributes that are modules, and those that it taps."""
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
    """Inside, no parameter asks for a gradient: backward passes reach the picture alone, and cost less."""
    parameters = {id(p): p for _, network in networks_of(model) for p in network.parameters() if p.requires_grad}
    for parameter in parameters.values():
        parameter.requires_grad_(False)
    try:
        yield
    finally:
        for parameter in parameters.values():
            parameter.requires_grad_(True)
