"""Monocular depth on DDRNet-23-slim: gear's reference network for depth, which two CPU cores train in minutes."""

from __future__ import annotations

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.depth.options import DepthOptions

NAME = "ddrnet23_slim_depth"

HABIT = 0.5
"""Default factor by which input pictures are resized. With half the width and height the network is fast on CPUs.
Little accuracy is lost, because depth is smooth nearly everywhere.
"""


def build(options: DepthOptions) -> Model:
    """Builds the depth network on DDRNet-23-slim and loads its weights.

    Args:
        options: options of the network, such as device and weights.

    Raises:
        GearError: the weights are missing.
    """
    from gear.networks.depth.ddrnet_depth import DdrnetDepth, ddrnet_depth_graph
    from gear.networks.input_scale import input_scale_of
    from gear.networks.weights import build_graph

    graph = build_graph(ddrnet_depth_graph, options, NAME)
    return DdrnetDepth(graph, options, input_scale=input_scale_of(options, NAME, HABIT))


spec = ModelSpec(
    name=NAME,
    summary="DDRNet-23-slim with one output channel, log-depth: fast reference network for depth.",
    config=DepthOptions,
    build=build,
    tasks=("depth",),
    views=("left",),
    taps=("rb1", "rb2", "rbb1", "rbb2"),
    recipe=Recipe(learning_rate=1e-3, batch=8, epochs=40, scales=(0.8, 1.25)),
    normalisation="ImageNet's mean and standard deviation; half the picture's sides by default (input_scale)",
    parameters=5_694_817,
    input_scale=HABIT,
)


@hookimpl
def gear_models() -> list[ModelSpec[DepthOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [spec]
