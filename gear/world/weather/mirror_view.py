"""Renders what wet ground mirrors: the placed scene seen from below, without its ground and with neutral surfaces."""

from __future__ import annotations

from gear.camera.pipeline import CameraPipeline
from gear.camera.reflection import MirrorView
from gear.contracts.rendering import Renderer
from gear.values.scene import SceneRecord
from gear.world.world import PlacedStage, World


def render_mirror_view(
    world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord, pipeline: CameraPipeline
) -> tuple[MirrorView | None, ...]:
    """Renders the mirrored view of each camera of a sample.

    Surfaces are neutral, so that a patch changes no pixel outside of its own surface.

    Args:
        world: that the scene was placed in.
        renderer: of that world.
        placed: the sample, placed last.
        record: the scene, with its cameras.
        pipeline: the camera pipeline of this weather; it says which cameras need a mirror view.

    Returns:
        One view for each camera; None for a camera that needs none, such as in dry weather.
    """
    cameras = [pipeline.mirror_camera(camera, record) for camera in record.cameras]
    looking = [camera for camera in cameras if camera is not None]
    if not looking:
        return (None,) * len(cameras)
    with world.without_ground(placed) as stage:
        raws = iter(renderer.render(stage, looking))
    return tuple(None if camera is None else (next(raws), camera) for camera in cameras)
