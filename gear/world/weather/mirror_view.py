"""Renders the mirror image in wet ground: a view of the scene from below, without the ground and with neutral
surfaces.
"""

from __future__ import annotations

from gear.camera.pipeline import CameraPipeline
from gear.camera.reflection import MirrorView
from gear.contracts.rendering import Renderer
from gear.values.scene import SceneRecord
from gear.world.world import PlacedStage, World


def render_mirror_view(
    world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord, pipeline: CameraPipeline
) -> tuple[MirrorView | None, ...]:
    """Renders the mirrored view for each camera of a sample.

    Surfaces are neutral, so that a patch changes no pixels outside its own surface.

    Args:
        world: the world in which the scene was placed.
        renderer: renderer of that world.
        placed: result of the last `World.place`.
        record: the scene, with its cameras.
        pipeline: camera pipeline of the weather, which determines the mirrored cameras.

    Returns:
        One view for each camera; None for cameras that need none, such as in dry weather.
    """
    cameras = [pipeline.mirror_camera(camera, record) for camera in record.cameras]
    looking = [camera for camera in cameras if camera is not None]
    if not looking:
        return (None,) * len(cameras)
    with world.without_ground(placed) as stage:
        raws = iter(renderer.render(stage, looking))
    return tuple(None if camera is None else (next(raws), camera) for camera in cameras)
