"""GLPDepth with the smallest encoder, MiT-b0: a reference network for depth that one GPU trains in minutes."""

from __future__ import annotations

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.depth.options import GlpnB0Options
from gear.plugins.models.glpdepth import convert

NAME = "glpn_b0"


def build(options: GlpnB0Options) -> Model:
    """Builds GLPDepth with the encoder MiT-b0 and loads its weights.

    Args:
        options: options of the network, such as device and weights.

    Raises:
        GearError: transformers or the weights are missing.
    """
    from gear.networks.depth.glpn import Glpn, glpn_graph
    from gear.networks.input_scale import input_scale_of
    from gear.networks.weights import build_graph

    graph = build_graph(lambda: glpn_graph(options), options, NAME)
    return Glpn(graph, options, input_scale=input_scale_of(options, NAME))


spec = ModelSpec(
    name=NAME,
    summary="GLPDepth with the small encoder MiT-b0, a 17th of the parameters: reference network for depth.",
    config=GlpnB0Options,
    build=build,
    tasks=("depth",),
    views=("left",),
    taps=("stem", "trunk", "decoder"),
    recipe=Recipe(learning_rate=5e-4, batch=8, epochs=40, scales=(0.8, 1.25), gradient_norm=1.0),
    normalisation="RGB in 0..1; sides are extended by reflection to multiples of 32",
    parameters=3_414_807,
    needs=("transformers",),
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[GlpnB0Options]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [spec]
