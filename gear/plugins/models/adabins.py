"""AdaBins (Bhat et al., CVPR 2021): depth as a weighted mean of bins that are adapted to each picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.depth.options import AdaBinsOptions

if TYPE_CHECKING:
    from torch import Tensor

NAME = "adabins"


def build(options: AdaBinsOptions) -> Model:
    """Builds AdaBins and loads its weights.

    Args:
        options: options of the network, such as device and weights.

    Raises:
        GearError: timm, torchvision or the weights are missing.
    """
    from gear.networks.depth.adabins import AdaBins
    from gear.networks.depth.adabins_graph import AdaBinsGraph
    from gear.networks.input_scale import input_scale_of
    from gear.networks.weights import build_graph

    graph = build_graph(lambda: AdaBinsGraph(options), options, NAME)
    return AdaBins(graph, options, input_scale=input_scale_of(options, NAME))


def convert(state: Mapping[str, Tensor]) -> Mapping[str, Any]:
    """Renames the tensors of the AdaBins authors' checkpoint to the names in gear's network.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.depth.adabins_official import from_official

    return from_official(state)


spec = ModelSpec(
    name=NAME,
    summary="AdaBins with EfficientNet-B5: monocular depth with adaptive bins (a network of the paper).",
    config=AdaBinsOptions,
    build=build,
    tasks=("depth",),
    views=("left",),
    taps=("stem", "trunk", "decoder"),
    recipe=Recipe(learning_rate=3.57e-4, weight_decay=0.1, batch=16, epochs=25, gradient_norm=0.1),
    published=(
        PublishedWeights(
            data="KITTI, Eigen split, up to 80 m",
            source="AdaBins_kitti.pt, which github.com/shariqfarooq123/AdaBins links to",
            licence="none stated for the weights (the authors' code is GPL-3.0); KITTI is CC BY-NC-SA 3.0: "
            "non-commercial",
            size_mb=940.0,
        ),
    ),
    normalisation="ImageNet's mean and standard deviation; pictures of more than 500 patches of 32 x 32 are reduced",
    parameters=78_257_328,
    needs=("torchvision", "timm"),
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[AdaBinsOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [spec]
