"""Stereo networks that find objects by their centres: gear's reference networks for stereo 3D detection."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.stereo.options import INPUT_SCALE, LEFT, RIGHT, StereoCentreOptions

if TYPE_CHECKING:
    from gear.networks.stereo.centre_network import StereoCentreNetwork

RESNET, LITE0 = "stereo_centre", "stereo_centre_lite0"

TAPS = ("layer1", "volume", "layer2", "layer3", "layer4")

LITE0_TAPS = ("trunk.blocks.1", "volume", "trunk.blocks.2", "trunk.blocks.4", "trunk.blocks.6")

RECIPE = Recipe(learning_rate=1e-3, weight_decay=1e-2, batch=4, epochs=20, gradient_norm=10.0)


def build_resnet(options: StereoCentreOptions) -> StereoCentreNetwork:
    """Builds the stereo network on ResNet-18 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.network import Normalise
    from gear.networks.stereo.centre_network import StereoCentreNetwork
    from gear.networks.stereo.centre_resnet import StereoCentre

    return StereoCentreNetwork(options, RESNET, StereoCentre, Normalise(), dict(zip(TAPS, TAPS, strict=True)))


def build_lite0(options: StereoCentreOptions) -> StereoCentreNetwork:
    """Builds the stereo network on EfficientNet-Lite0 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.efficientnet_lite0 import MEAN, STD
    from gear.networks.network import Normalise
    from gear.networks.stereo.centre_lite0 import StereoCentreLite0
    from gear.networks.stereo.centre_network import StereoCentreNetwork

    taps = dict(zip(TAPS, LITE0_TAPS, strict=True))
    return StereoCentreNetwork(options, LITE0, StereoCentreLite0, Normalise(MEAN, STD), taps)


def start_from_imagenet(model: Any) -> None:
    """Loads ImageNet weights into the network's EfficientNet-Lite0 trunk, as a starting point of training.

    Args:
        model: the network; its weights are changed in place.
    """
    from gear.networks.efficientnet_lite0 import start_from_imagenet

    start_from_imagenet(model.graph)


stereo_centre: ModelSpec[StereoCentreOptions] = ModelSpec(
    name=RESNET,
    summary="Stereo network with ResNet-18 that finds objects by their centres: reference for stereo3d.",
    config=StereoCentreOptions,
    build=build_resnet,
    tasks=("stereo3d",),
    views=(LEFT, RIGHT),
    taps=TAPS,
    recipe=RECIPE,
    normalisation="ImageNet's mean and standard deviation",
    parameters=4_962_314,
    input_scale=INPUT_SCALE,
)

stereo_centre_lite0: ModelSpec[StereoCentreOptions] = ModelSpec(
    name=LITE0,
    summary="Stereo network with EfficientNet-Lite0, like stereo_centre; --init imagenet has ImageNet weights.",
    config=StereoCentreOptions,
    build=build_lite0,
    tasks=("stereo3d",),
    views=(LEFT, RIGHT),
    taps=TAPS,
    recipe=RECIPE,
    normalisation="RGB in 0..255, minus 127, divided by 128",
    parameters=3_364_394,
    input_scale=INPUT_SCALE,
    needs=("torchvision", "timm"),
    starts={"imagenet": start_from_imagenet},
)


@hookimpl
def gear_models() -> list[ModelSpec[StereoCentreOptions]]:
    """Hook of the plugin system: returns the two model plugins that this module defines."""
    return [stereo_centre, stereo_centre_lite0]
