"""Two RetinaNets that are trained on gear's own data: with ResNet-18, and with EfficientNet-Lite0.

The trunk EfficientNet-Lite0 starts from ImageNet weights.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.detection.options import ReferenceDetectorOptions

if TYPE_CHECKING:
    from gear.networks.detection.retinanet import RetinaNetDetector

R18, LITE0 = "retinanet_r18_fpn", "retinanet_lite0_fpn"

CATEGORIES = (1, 2, 3, 4, 6, 8, 10, 11, 13, 14, 15)
"""COCO category ids of the classes in gear's towns: person, bicycle, car, motorcycle, bus, truck, traffic light, fire
hydrant, stop sign, parking meter, bench.
"""

INPUT_SCALE = 0.5

RECIPE = Recipe(
    learning_rate=1e-3,
    weight_decay=1e-2,
    batch=8,
    epochs=24,
    gradient_norm=10.0,
    crop_px=(384, 640),
    scales=(0.8, 1.25),
)


def build_r18(options: ReferenceDetectorOptions) -> RetinaNetDetector:
    """Builds RetinaNet with ResNet-18 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.detection.graphs import retinanet_r18_fpn
    from gear.networks.detection.network import Sizing, scaled
    from gear.networks.detection.retinanet import RetinaNetDetector
    from gear.networks.weights import build_graph

    return RetinaNetDetector(
        build_graph(lambda: retinanet_r18_fpn(len(CATEGORIES), options.score_threshold), options, R18),
        options,
        sizing=Sizing(inner_px=scaled(scale_of(options, R18)), smooth=True),
        categories=CATEGORIES,
    )


def build_lite0(options: ReferenceDetectorOptions) -> RetinaNetDetector:
    """Builds RetinaNet with EfficientNet-Lite0 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.detection.graphs import retinanet_lite0_fpn
    from gear.networks.detection.network import Sizing, scaled
    from gear.networks.detection.retinanet import LiteRetinaNetDetector
    from gear.networks.efficientnet_lite0 import MEAN, STD
    from gear.networks.weights import build_graph

    return LiteRetinaNetDetector(
        build_graph(lambda: retinanet_lite0_fpn(len(CATEGORIES), options.score_threshold), options, LITE0),
        options,
        sizing=Sizing(inner_px=scaled(scale_of(options, LITE0)), smooth=True, mean=MEAN, std=STD),
        categories=CATEGORIES,
    )


def scale_of(options: ReferenceDetectorOptions, name: str) -> float:
    """Returns the factor by which input pictures are resized: from the options, otherwise from the weights,
    otherwise 0.5.

    Args:
        options: options of the network.
        name: name of the network, whose weights may state the factor.
    """
    from gear.networks.input_scale import input_scale_of

    return input_scale_of(options, name, INPUT_SCALE)


def start_from_imagenet(model: Any) -> None:
    """Loads ImageNet weights into the network's EfficientNet-Lite0 trunk, as a starting point of training.

    Args:
        model: the network; its weights are changed in place.
    """
    from gear.networks.efficientnet_lite0 import start_from_imagenet

    start_from_imagenet(model.graph.get_submodule("backbone"))


retinanet_r18: ModelSpec[ReferenceDetectorOptions] = ModelSpec(
    name=R18,
    summary="RetinaNet with ResNet-18 and FPN: reference network for 2D detection that CPUs can train.",
    config=ReferenceDetectorOptions,
    build=build_r18,
    tasks=("detect2d",),
    views=("left",),
    taps=("layer1", "layer2", "layer3", "layer4"),
    recipe=RECIPE,
    normalisation="RGB in 0..1, minus ImageNet's mean, divided by its standard deviation",
    parameters=13_366_855,
    input_scale=INPUT_SCALE,
    needs=("torchvision",),
)

retinanet_lite0: ModelSpec[ReferenceDetectorOptions] = ModelSpec(
    name=LITE0,
    summary="RetinaNet with EfficientNet-Lite0: reference for 2D detection; --init imagenet has ImageNet weights.",
    config=ReferenceDetectorOptions,
    build=build_lite0,
    tasks=("detect2d",),
    views=("left",),
    taps=("layer1", "layer2", "layer3", "layer4"),
    recipe=RECIPE,
    normalisation="RGB in 0..255, minus 127, divided by 128",
    parameters=4_504_071,
    input_scale=INPUT_SCALE,
    needs=("torchvision", "timm"),
    starts={"imagenet": start_from_imagenet},
)


@hookimpl
def gear_models() -> list[ModelSpec[ReferenceDetectorOptions]]:
    """Hook of the plugin system: returns the two model plugins that this module defines."""
    return [retinanet_r18, retinanet_lite0]
