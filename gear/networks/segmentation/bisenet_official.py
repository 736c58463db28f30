"""Converts published checkpoints of BiSeNet (TorchSeg) to the parameter names of `BiSeNetX39`."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of BiSeNet from a published checkpoint of TorchSeg; tensors of its loss modules are dropped.

    Args:
        state: tensors of the checkpoint by their published names.
    """
    return {key: value for key, value in state.items() if not key.startswith(("criterion.", "ohem_criterion."))}
