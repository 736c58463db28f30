"""Objects by their centres in a rectified pair: gear's trainable reference for stereo 3D detection."""

from __future__ import annotations

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model, Recipe
from gear.contracts.specs import ModelSpec
from gear.nn.stereo_options import INPUT_SCALE, LEFT, RIGHT, StereoCentreOptions


def build(options: StereoCentreOptions) -> Model:
    """The network with its weights."""
    from gear.nn.stereo_centre_network import StereoCentreNetwork

    return StereoCentreNetwork(options)


stereo_centre: ModelSpec[StereoCentreOptions] = ModelSpec(
    name="stereo_centre",
    summary="Siamese ResNet-18-FPN with a correlation volume and centre heads: trains on two cores.",
    config=StereoCentreOptions,
    build=build,
    tasks=("stereo3d",),
    views=(LEFT, RIGHT),
    taps=("layer1", "volume", "layer2", "layer3", "layer4"),
    recipe=Recipe(learning_rate=1e-3, weight_decay=1e-2, batch=4, epochs=20, gradient_norm=10.0),
    normalisation="ImageNet mean and deviation",
    parameters=4_962_314,
    input_scale=INPUT_SCALE,
)


@hookimpl
def gear_models() -> list[ModelSpec[StereoCentreOptions]]:
    """This network."""
    return [stereo_centre]
