"""DDRNet-23-slim: real-time semantic segmentation, one of the networks in the CARLA-GeAR paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.options import SegmentationOptions

if TYPE_CHECKING:
    from gear.networks.segmentation.network import SemsegNetwork

NAME = "ddrnet23_slim"

EASY = 0.9
LEAST = 1 / 16
AUXILIARY_WEIGHT = 0.4


def build(options: SegmentationOptions) -> SemsegNetwork:
    """Builds DDRNet-23-slim and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.input_scale import input_scale_of
    from gear.networks.segmentation.ddrnet import DDRNet23Slim
    from gear.networks.segmentation.losses import SegmentationLosses
    from gear.networks.segmentation.network import CLASSES, SemsegNetwork
    from gear.networks.weights import build_graph

    return SemsegNetwork(
        build_graph(lambda: DDRNet23Slim(CLASSES, auxiliary=options.auxiliary), options, NAME),
        options,
        SegmentationLosses(easy=EASY, least=LEAST, auxiliary_weight=AUXILIARY_WEIGHT),
        input_scale=input_scale_of(options, NAME),
    )


def convert(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Renames the tensors of a published DDRNet checkpoint to the names in gear's network.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.segmentation.ddrnet_official import from_official

    return from_official(state)


ddrnet23_slim: ModelSpec[SegmentationOptions] = ModelSpec(
    name=NAME,
    summary="DDRNet-23-slim (Hong et al., 2021): semantic segmentation with two branches (a network of the paper).",
    config=SegmentationOptions,
    build=build,
    tasks=("semseg",),
    views=("left",),
    taps=("rb1", "rb2", "rbb1", "rbb2"),
    recipe=Recipe(learning_rate=1e-3, weight_decay=1e-2, batch=8, epochs=40, scales=(0.75, 1.5)),
    published=(
        PublishedWeights(
            data="Cityscapes, 19 classes (validation mIoU 77.8)",
            source="github.com/ydhongHIT/DDRNet, README, Google Drive 1d_K3Af5fKHYwxSo8HkxpnhiekhwovmiP",
            licence="code MIT; Cityscapes' terms: trained models may be shared, no commercial use",
            size_mb=23.0,  # size of the network's tensors alone
        ),
    ),
    normalisation="RGB in 0..1, minus ImageNet's mean, divided by its standard deviation",
    parameters=5_734_342,
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[SegmentationOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [ddrnet23_slim]
