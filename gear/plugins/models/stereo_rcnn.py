"""Stereo R-CNN (Li, Chen, Shen, CVPR 2019): stereo 3D detection, one of the networks in the CARLA-GeAR paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.stereo.options import LEFT, RIGHT, StereoRcnnOptions


def build(options: StereoRcnnOptions) -> Model:
    """Builds Stereo R-CNN and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.stereo.rcnn_network import StereoRcnnNetwork

    return StereoRcnnNetwork(options)


def from_official(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Converts a published Stereo R-CNN checkpoint to gear's tensors; missing loss variances are initialised.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.stereo.rcnn_official import from_official

    return from_official(state)


stereo_rcnn: ModelSpec[StereoRcnnOptions] = ModelSpec(
    name="stereo_rcnn",
    summary="Stereo R-CNN with ResNet-101 and FPN: stereo 3D detection of cars (a network of the paper).",
    config=StereoRcnnOptions,
    build=build,
    tasks=("stereo3d",),
    views=(LEFT, RIGHT),
    taps=("layer1", "layer2", "layer3", "layer4"),
    recipe=Recipe(optimiser="sgd", learning_rate=1e-3, weight_decay=5e-4, batch=1, epochs=12, gradient_norm=10.0),
    published=(
        PublishedWeights(
            data="KITTI object, cars",
            source="github.com/HKUST-Aerial-Robotics/Stereo-RCNN: stereo_rcnn_12_6477.pth, linked in its README",
            licence="code MIT; trained on KITTI, CC BY-NC-SA 3.0",
            size_mb=848.0,
        ),
    ),
    normalisation="BGR in 0..255, minus (102.98, 115.95, 122.77); shorter side 600 pixels",
    parameters=105_891_452,
    convert=from_official,
)


@hookimpl
def gear_models() -> list[ModelSpec[StereoRcnnOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [stereo_rcnn]
