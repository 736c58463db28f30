"""Faster R-CNN with EfficientNet-Lite0: the paper's two-stage detector with a trunk that two CPU cores can train."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ModelSpec
from gear.networks.detection.options import ReferenceDetectorOptions
from gear.plugins.models.retinanet_r18_fpn import CATEGORIES, INPUT_SCALE, RECIPE, scale_of, start_from_imagenet

if TYPE_CHECKING:
    from gear.networks.detection.fasterrcnn_lite0 import LiteFasterRcnnDetector

NAME = "fasterrcnn_lite0_fpn"


def build(options: ReferenceDetectorOptions) -> LiteFasterRcnnDetector:
    """Builds Faster R-CNN with EfficientNet-Lite0 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.detection.fasterrcnn_lite0 import LiteFasterRcnnDetector, fasterrcnn_lite0_fpn
    from gear.networks.detection.network import Sizing, scaled
    from gear.networks.efficientnet_lite0 import MEAN, STD
    from gear.networks.weights import build_graph

    categories = (None, *CATEGORIES)  # class 0 is the background
    return LiteFasterRcnnDetector(
        build_graph(lambda: fasterrcnn_lite0_fpn(len(categories), options.score_threshold), options, NAME),
        options,
        sizing=Sizing(inner_px=scaled(scale_of(options, NAME)), smooth=True, mean=MEAN, std=STD),
        categories=categories,
    )


fasterrcnn_lite0: ModelSpec[ReferenceDetectorOptions] = ModelSpec(
    name=NAME,
    summary="Faster R-CNN with EfficientNet-Lite0: two-stage 2D detection; --init imagenet has ImageNet weights.",
    config=ReferenceDetectorOptions,
    build=build,
    tasks=("detect2d",),
    views=("left",),
    taps=("layer1", "layer2", "layer3", "layer4"),
    recipe=RECIPE,
    normalisation="RGB in 0..255, minus 127, divided by 128",
    parameters=5_598_057,
    input_scale=INPUT_SCALE,
    needs=("torchvision", "timm"),
    starts={"imagenet": start_from_imagenet},
)


@hookimpl
def gear_models() -> list[ModelSpec[ReferenceDetectorOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [fasterrcnn_lite0]
