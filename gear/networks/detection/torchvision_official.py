"""Renames the keys of published detector weights for gear's networks."""

from __future__ import annotations

import re
from collections.abc import Mapping

from torch import Tensor

OLD_NAMES = (
    (r"(backbone\.fpn\.(?:inner|layer)_blocks\.\d)\.(weight|bias)", r"\1.0.\2"),
    (r"rpn\.head\.conv\.(weight|bias)", r"rpn.head.conv.0.0.\1"),
    (r"(head\.\w+_head\.conv)\.0\.(weight|bias)", r"\1.0.0.\2"),
    (r"(head\.\w+_head\.conv)\.2\.(weight|bias)", r"\1.1.0.\2"),
    (r"(head\.\w+_head\.conv)\.4\.(weight|bias)", r"\1.2.0.\2"),
    (r"(head\.\w+_head\.conv)\.6\.(weight|bias)", r"\1.3.0.\2"),
)
"""Pairs of a pattern for keys in weights files of 2019 and 2020, and the current key. The old keys lack the block
around a convolution and count activations as layers.
"""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Renames the keys of published torchvision weights to the names of current torchvision versions.

    Args:
        state: tensors of the checkpoint by their published names; counters of batches (`num_batches_tracked`) are
            dropped.
    """
    return {_renamed(key): value for key, value in state.items() if not key.endswith("num_batches_tracked")}


def _renamed(key: str) -> str:
    for pattern, name in OLD_NAMES:
        if re.fullmatch(pattern, key):
            return re.sub(pattern, name, key)
    return key
