"""A model that is only borrowed: it is attacked, and left as it was."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from torch import nn


def networks_of(model: Any) -> list[nn.Module]:
    """The torch modules of a model: itself, or those among its attributes and taps."""
    if isinstance(model, nn.Module):
        return [model]
    found = [value for value in getattr(model, "__dict__", {}).values() if isinstance(value, nn.Module)]
    return [*found, *model.taps().values()]


@contextlib.contextmanager
def frozen(model: Any) -> Iterator[None]:
    """Inside, no parameter asks for a gradient: backward passes reach the picture alone, and cost less."""
    parameters = {id(p): p for network in networks_of(model) for p in network.parameters() if p.requires_grad}
    for parameter in parameters.values():
        parameter.requires_grad_(False)
    try:
        yield
    finally:
        for parameter in parameters.values():
            parameter.requires_grad_(True)
