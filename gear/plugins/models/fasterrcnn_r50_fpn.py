"""Faster R-CNN with ResNet-50 and a feature pyramid: 2D detection, one of the networks in the CARLA-GeAR paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.detection.options import OfficialDetectorOptions

if TYPE_CHECKING:
    from gear.networks.detection.fasterrcnn import FasterRcnnDetector

NAME = "fasterrcnn_r50_fpn"


def build(options: OfficialDetectorOptions) -> FasterRcnnDetector:
    """Builds Faster R-CNN with ResNet-50 and a feature pyramid, and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.detection.fasterrcnn import FasterRcnnDetector
    from gear.networks.detection.graphs import fasterrcnn_r50_fpn
    from gear.networks.detection.network import OFFICIAL_CATEGORIES, Sizing, fitted
    from gear.networks.weights import build_graph

    return FasterRcnnDetector(
        build_graph(lambda: fasterrcnn_r50_fpn(options.score_threshold), options, NAME),
        options,
        sizing=Sizing(inner_px=fitted(options.min_size_px, options.max_size_px)),
        categories=OFFICIAL_CATEGORIES,
    )


def convert(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Converts a published checkpoint to the tensors of gear's Faster R-CNN.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.detection.torchvision_official import from_official

    return from_official(state)


fasterrcnn: ModelSpec[OfficialDetectorOptions] = ModelSpec(
    name=NAME,
    summary="Faster R-CNN with ResNet-50 and FPN, from torchvision: two-stage 2D detection (a network of the paper).",
    config=OfficialDetectorOptions,
    build=build,
    tasks=("detect2d",),
    views=("left",),
    taps=("layer1", "layer2", "layer3", "layer4"),
    recipe=Recipe(optimiser="sgd", learning_rate=5e-3, weight_decay=1e-4, batch=4, epochs=12, gradient_norm=10.0),
    published=(
        PublishedWeights(
            data="COCO 2017, 91 outputs (box mAP 37.0)",
            source="download.pytorch.org/models/fasterrcnn_resnet50_fpn_coco-258fb6c6.pth",
            licence="none stated for the weights; code BSD-3, COCO's annotations CC BY 4.0",
            size_mb=159.7,
        ),
    ),
    normalisation="RGB in 0..1, minus ImageNet's mean, divided by its standard deviation",
    parameters=41_755_286,
    needs=("torchvision",),
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[OfficialDetectorOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [fasterrcnn]
