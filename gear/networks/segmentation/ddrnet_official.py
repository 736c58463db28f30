"""Converts checkpoints published by the authors of DDRNet to the parameter names of `DDRNet23Slim`."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

WRAPPER = "model."
"""Prefix of the keys in the authors' checkpoints, which hold a training wrapper: the network and a loss module
with weights of its own.
"""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of DDRNet from a published checkpoint, without the wrapper's prefix `model.` and without the
    loss module.

    Args:
        state: tensors of the checkpoint by their published names.
    """
    kept = {key: value for key, value in state.items() if not key.startswith("loss.")}
    return {key.removeprefix(WRAPPER): value for key, value in kept.items()}
