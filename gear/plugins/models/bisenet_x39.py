"""BiSeNet with Xception39: real-time semantic segmentation, one of the networks in the CARLA-GeAR paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.options import SegmentationOptions

if TYPE_CHECKING:
    from gear.networks.segmentation.network import SemsegNetwork

NAME = "bisenet_x39"

EASY = 0.7
LEAST = 1 / 16
AUXILIARY_WEIGHT = 1.0


def build(options: SegmentationOptions) -> SemsegNetwork:
    """Builds BiSeNet with Xception39 and loads its weights.

    Args:
        options: options of the network, such as device and weights.
    """
    from gear.networks.input_scale import input_scale_of
    from gear.networks.segmentation.bisenet import BiSeNetX39
    from gear.networks.segmentation.losses import SegmentationLosses
    from gear.networks.segmentation.network import CLASSES, SemsegNetwork
    from gear.networks.weights import build_graph

    return SemsegNetwork(
        build_graph(lambda: BiSeNetX39(CLASSES, auxiliary=options.auxiliary), options, NAME),
        options,
        SegmentationLosses(easy=EASY, least=LEAST, auxiliary_weight=AUXILIARY_WEIGHT),
        input_scale=input_scale_of(options, NAME),
    )


def convert(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """Renames the tensors of a published BiSeNet checkpoint to the names in gear's network.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.segmentation.bisenet_official import from_official

    return from_official(state)


bisenet_x39: ModelSpec[SegmentationOptions] = ModelSpec(
    name=NAME,
    summary="BiSeNet with Xception39 (Yu et al., 2018): semantic segmentation (a network of the paper).",
    config=SegmentationOptions,
    build=build,
    tasks=("semseg",),
    views=("left",),
    taps=("spatial_7x7", "spatial_1x1", "ct2", "ct1", "ct0"),
    recipe=Recipe(learning_rate=1e-3, weight_decay=1e-2, batch=8, epochs=40, scales=(0.75, 1.5)),
    published=(
        PublishedWeights(
            data="Cityscapes, 19 classes (validation mIoU 70.3)",
            source="github.com/ycszen/TorchSeg, README, Google Drive 1hb_qk3QLwZtQUmevZUFOHNiRHhRr0IQB",
            licence="code MIT; Cityscapes' terms: trained models may be shared, no commercial use",
            size_mb=7.5,  # size of the network's tensors; the file may also contain an optimiser's state
        ),
    ),
    normalisation="RGB in 0..1, minus ImageNet's mean, divided by its standard deviation",
    parameters=1_842_289,
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[SegmentationOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [bisenet_x39]
