"""Renames parameters of GLPDepth's published checkpoints to the names of the GLPN in transformers."""

from __future__ import annotations

import re
from collections.abc import Mapping

from torch import Tensor

RENAMES: tuple[tuple[str, str], ...] = (
    (r"^encoder\.", "glpn.encoder."),
    (r"^decoder\.bot_conv\.", "decoder.stages.0.convolution."),
    (r"^decoder\.skip_conv([12])\.", r"decoder.stages.\1.convolution."),
    (r"^decoder\.fusion(\d)\.conv(\d)\.", r"decoder.stages.\1.fusion.convolutional_layer\2."),
    (r"^last_layer_depth\.", "head.head."),
)
BLOCK_RENAMES: tuple[tuple[str, str], ...] = (
    (r"\.norm([12])\.", r".layer_norm_\1."),
    (r"\.attn\.q\.", ".attention.self.query."),
    (r"\.attn\.sr\.", ".attention.self.sr."),
    (r"\.attn\.norm\.", ".attention.self.layer_norm."),
    (r"\.attn\.proj\.", ".attention.output.dense."),
    (r"\.mlp\.fc([12])\.", r".mlp.dense\1."),
)
NUMBERED: tuple[tuple[str, str], ...] = (
    (r"^glpn\.encoder\.patch_embed(\d)\.norm\.", "glpn.encoder.patch_embeddings.{}.layer_norm."),
    (r"^glpn\.encoder\.patch_embed(\d)\.", "glpn.encoder.patch_embeddings.{}."),
    (r"^glpn\.encoder\.block(\d)\.", "glpn.encoder.block.{}."),
    (r"^glpn\.encoder\.norm(\d)\.", "glpn.encoder.layer_norm.{}."),
)
"""Pairs of a pattern for published keys and the key in transformers. Published files number stages from 1,
transformers from 0.
"""

JOINT = ".attn.kv."
"""Part of the key of layers that compute attention keys and values jointly in published files; the first half of
their outputs are the keys.
"""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Renames the keys of GLPDepth's published weights to the parameter names of the GLPN in transformers.

    Keys that already have transformers' names, and unknown keys, are not changed.

    Args:
        state: tensors of the checkpoint by their published names.
    """
    renamed: dict[str, Tensor] = {}
    for key, tensor in state.items():
        if not key.startswith(("encoder.", "decoder.", "last_layer_depth.")):
            renamed[key] = tensor
            continue
        name = _renamed(key)
        if JOINT in name:
            for part, half in zip(("key", "value"), tensor.chunk(2), strict=True):
                renamed[name.replace(JOINT, f".attention.self.{part}.")] = half.clone()
        else:
            renamed[name] = tensor
    return renamed


def _renamed(key: str) -> str:
    for pattern, replacement in RENAMES:
        key = re.sub(pattern, replacement, key)
    for pattern, name in NUMBERED:
        key = re.sub(pattern, lambda found, name=name: name.format(int(found[1]) - 1), key)  # type: ignore[misc]
    if key.startswith("glpn.encoder.block."):
        for pattern, replacement in BLOCK_RENAMES:
            key = re.sub(pattern, replacement, key)
    return key
