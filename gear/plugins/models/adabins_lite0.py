"""The head of AdaBins on EfficientNet-Lite0: a reference network for depth that two CPU cores can train."""

from __future__ import annotations

from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.depth.options import AdaBinsLite0Options

NAME = "adabins_lite0"

INPUT_SCALE = 0.5


def build(options: AdaBinsLite0Options) -> Model:
    """Builds AdaBins' head on EfficientNet-Lite0 and loads its weights.

    Args:
        options: options of the network, such as device and weights.

    Raises:
        GearError: timm, torchvision or the weights are missing.
    """
    from gear.networks.depth.adabins_lite0 import LiteAdaBins, adabins_lite0_graph
    from gear.networks.input_scale import input_scale_of
    from gear.networks.weights import build_graph

    graph = build_graph(lambda: adabins_lite0_graph(options), options, NAME)
    return LiteAdaBins(graph, options, input_scale=input_scale_of(options, NAME, INPUT_SCALE))


def start_from_imagenet(model: Any) -> None:
    """Loads ImageNet weights into the network's EfficientNet-Lite0, as a starting point of training.

    Args:
        model: the network; its weights are changed in place.
    """
    from gear.networks.efficientnet_lite0 import start_from_imagenet

    start_from_imagenet(model.graph.get_submodule("encoder"))


spec = ModelSpec(
    name=NAME,
    summary="AdaBins' head on EfficientNet-Lite0: reference for depth; --init imagenet has ImageNet weights.",
    config=AdaBinsLite0Options,
    build=build,
    tasks=("depth",),
    views=("left",),
    taps=("stem", "trunk", "decoder"),
    recipe=Recipe(learning_rate=5e-4, weight_decay=1e-2, batch=8, epochs=24, scales=(0.8, 1.25), gradient_norm=1.0),
    normalisation="RGB in 0..255, minus 127, divided by 128",
    parameters=5_637_984,
    input_scale=INPUT_SCALE,
    needs=("torchvision", "timm"),
    starts={"imagenet": start_from_imagenet},
)


@hookimpl
def gear_models() -> list[ModelSpec[AdaBinsLite0Options]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [spec]
