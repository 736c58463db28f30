"""GLPDepth with its published encoder, MiT-b4 (Kim et al., arXiv 2201.07436): monocular depth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, PublishedWeights, Recipe
from gear.contracts.specs import ModelSpec
from gear.networks.depth.options import GlpnOptions

if TYPE_CHECKING:
    from torch import Tensor

NAME = "glpdepth"


def build(options: GlpnOptions) -> Model:
    """Builds GLPDepth with the encoder MiT-b4 and loads its weights.

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


def convert(state: Mapping[str, Tensor]) -> Mapping[str, Any]:
    """Renames the tensors of a GLPDepth checkpoint (the authors' or transformers') to the names in gear's network.

    Args:
        state: tensors of the checkpoint by their published names.

    Returns:
        Tensors by the names in gear's network.
    """
    from gear.networks.depth.glpn_official import from_official

    return from_official(state)


spec = ModelSpec(
    name=NAME,
    summary="GLPDepth with the encoder MiT-b4: monocular depth with a transformer (a network of the paper).",
    config=GlpnOptions,
    build=build,
    tasks=("depth",),
    views=("left",),
    taps=("stem", "trunk", "decoder"),
    recipe=Recipe(learning_rate=1e-4, batch=12, epochs=25),
    published=(
        PublishedWeights(
            data="KITTI, Eigen split, up to 80 m",
            source="vinvino02/glpn-kitti on the Hugging Face hub: its weights file; or the checkpoint that "
            "github.com/vinvino02/GLPDepth links to",
            licence="non-commercial by the authors' repository (the hub's card says Apache-2.0); KITTI is "
            "CC BY-NC-SA 3.0",
            size_mb=245.0,
        ),
    ),
    normalisation="RGB in 0..1; sides are extended by reflection to multiples of 32",
    parameters=61_220_903,
    needs=("transformers",),
    convert=convert,
)


@hookimpl
def gear_models() -> list[ModelSpec[GlpnOptions]]:
    """Hook of the plugin system: returns the model plugin that this module defines."""
    return [spec]
