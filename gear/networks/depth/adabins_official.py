"""Renames parameters of AdaBins' published weights to the names of `AdaBinsGraph`."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

OLD_NAMES = (
    ("adaptive_bins_layer.embedding_conv.", "adaptive_bins_layer.conv3x3."),
    (
        "adaptive_bins_layer.patch_transformer.embedding_encoder.",
        "adaptive_bins_layer.patch_transformer.embedding_convPxP.",
    ),
)
"""Pairs of key prefixes: the names of two layers in the published files, and their names in the authors' current
code.
"""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Renames the keys of AdaBins' published weights to the parameter names of `AdaBinsGraph`.

    Args:
        state: tensors of the checkpoint by their published names.
    """
    renamed = {}
    for key, tensor in state.items():
        for old, new in OLD_NAMES:
            key = new + key.removeprefix(old) if key.startswith(old) else key
        renamed[key] = tensor
    return renamed
