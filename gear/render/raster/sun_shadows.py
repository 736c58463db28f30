"""Maps of the sun's shadows.

What stands still throws the same shadows in every picture, so one map of a whole town is drawn once. Near the camera it
is too coarse: there a map of everything is drawn for each picture, and farther off one of what can move.
"""

from __future__ import annotations

import mujoco
import numpy as np
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Stage
from gear.render.culling import Mask, bounding_radii, in_beam, near_to_far
from gear.render.pinhole import Frustum
from gear.render.raster import device
from gear.render.raster.scene import Scene
from gear.render.raster.shadow_squares import ENDS_M, Maps, Square, square_about, squares_before
from gear.values.geometry import Array

NEAR_PX, TOWN_PX = 2048, 4096
"""Sides of the maps."""

_NEAR_UNIT, _TOWN_UNIT = 4, 8
_SLOPE_BIAS, _UNIT_BIAS = 1.5, 2.0
_SEEN_TEXELS = 2
"""What is smaller than so many texels of a map throws no shadow there."""


class SunShadows:
    """Maps of one model's shadows."""

    def __init__(self, model: mujoco.MjModel, scene: Scene) -> None:
        """Makes room; the town's map is drawn when it is wanted first."""
        self._model, self._scene = model, scene
        self._program = device.Program("shapes.vert", "nothing.frag")
        self._near = device.shadow_maps(NEAR_PX, len(ENDS_M))
        self._near_target = device.Target.of(NEAR_PX, NEAR_PX, None, depth=0)
        self._moves = _moves(model)[scene.geom_of_piece]
        self._size_m = bounding_radii(model)[scene.geom_of_piece]
        self._town: tuple[Array, int, Square] | None = None

    def draw(self, stage: Stage, frustum: Frustum, towards_sun: Array) -> Maps:
        """Draws what is new, for a scene that is posed for this camera, and binds all maps."""
        centres_m, radii_m = self._scene.spheres(stage)
        squares = squares_before(frustum, towards_sun)
        if self._town is None or not np.array_equal(self._town[0], towards_sun):
            self._draw_town(towards_sun)
            self._scene.pose(stage, frustum.position_world_m)
        assert self._town is not None
        _, town_map, town = self._town
        for layer, (square, chosen) in enumerate(zip(squares, (np.ones_like(self._moves), self._moves), strict=True)):
            self._near_target.attach_layer(self._near, layer)
            in_light = in_beam(square.centre_m, towards_sun, square.half_side_m, centres_m, radii_m)
            large = self._size_m > _SEEN_TEXELS * _texel_m(square, NEAR_PX)
            self._draw(self._near_target, square, frustum.position_world_m, chosen & in_light & large, centres_m)
        GL.glBindTextureUnit(_NEAR_UNIT, self._near)
        GL.glBindTextureUnit(_TOWN_UNIT, town_map)
        return Maps(
            map_from_camera=np.stack([square.matrix(frustum.position_world_m) for square in (*squares, town)]),
            texel_m=np.array([*(_texel_m(square, NEAR_PX) for square in squares), _texel_m(town, TOWN_PX)]),
            end_m=np.array(ENDS_M),
        )

    def _draw_town(self, towards_sun: Array) -> None:
        """The map of what stands still, where the model has it: it must not depend on what is looked at first."""
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        stage = Stage(model=self._model, data=data)
        centres_m, _ = self._scene.spheres(stage)
        square = square_about(self._scene.landmarks(stage, ~self._moves), towards_sun)
        maps = device.shadow_maps(TOWN_PX, 1)
        target = device.Target.of(TOWN_PX, TOWN_PX, None, depth=0)
        target.attach_layer(maps, 0)
        self._scene.pose(stage, square.centre_m)
        large = self._size_m > _SEEN_TEXELS * _texel_m(square, TOWN_PX)
        self._draw(target, square, square.centre_m, ~self._moves & large, centres_m)
        target.free()
        if self._town is not None:
            device.free_textures([self._town[1]])
        self._town = towards_sun, maps, square

    def _draw(self, target: device.Target, square: Square, origin_m: Array, chosen: Mask, centres_m: Array) -> None:
        target.begin()
        GL.glDepthFunc(GL.GL_LESS)
        GL.glDepthMask(True)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glEnable(GL.GL_DEPTH_CLAMP)
        GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
        GL.glPolygonOffset(_SLOPE_BIAS, _UNIT_BIAS)
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.ones(1, np.float32))
        self._program.use(clip_from_place=square.matrix(origin_m))
        try:
            self._scene.draw(near_to_far(chosen, -(centres_m @ square.axes[2])))
        finally:
            GL.glDisable(GL.GL_DEPTH_CLAMP)
            GL.glDisable(GL.GL_POLYGON_OFFSET_FILL)


def _texel_m(square: Square, size: int) -> float:
    return 2 * square.half_side_m / size


def _moves(model: mujoco.MjModel) -> Mask:
    """(ngeom,) whether a geom's body has a joint above it, or is moved by hand."""
    root = model.body_rootid[model.geom_bodyid]
    return np.asarray((model.body_weldid[model.geom_bodyid] != 0) | (model.body_mocapid[root] >= 0))
