"""What wet ground mirrors: the placed scene once more, from below, without its ground and with neutral surfaces."""

from __future__ import annotations

from gear.camera.pipeline import Darkroom
from gear.camera.reflection import Below
from gear.contracts.rendering import Renderer
from gear.values.scene import SceneRecord
from gear.world.world import PlacedStage, World


def look_from_below(
    world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord, darkroom: Darkroom
) -> tuple[Below | None, ...]:
    """One a camera, None where it needs none; surfaces are neutral, so that a patch changes nothing but itself.

    Args:
        world: that the scene was placed in.
        renderer: of that world.
        placed: the sample, placed last.
        record: who looks.
        darkroom: that develops what they see.
    """
    cameras = [darkroom.camera_below(camera, record) for camera in record.cameras]
    looking = [camera for camera in cameras if camera is not None]
    if not looking:
        return (None,) * len(cameras)
    with world.without_ground(placed) as stage:
        raws = iter(renderer.render(stage, looking))
    return tuple(None if camera is None else (next(raws), camera) for camera in cameras)
