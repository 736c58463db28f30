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
from gear.render.raster import gl
from gear.render.raster.scene import Scene
from gear.render.raster.shadow_squares import ENDS_M, Maps, Square, square_about, squares_before
from gear.values.geometry import Array

_NEAR_PX, _TOWN_PX = 2048, 4096
_SIZE_PX = 4096, 6144
_PARTS_PX = ((0, 4096, _NEAR_PX), (2048, 4096, _NEAR_PX), (0, 0, _TOWN_PX))
"""Corners and sides of the maps in one texture: of everything near, of what moves, of the town."""

_UNIT = 4
_SLOPE_BIAS, _UNIT_BIAS = 1.5, 2.0
_SEEN_TEXELS = 2
"""What is smaller than so many texels of a map throws no shadow there."""


class SunShadows:
    """Maps of one model's shadows."""

    def __init__(self, model: mujoco.MjModel, scene: Scene) -> None:
        """Makes room; the town's map is drawn when it is wanted first."""
        self._model, self._scene = model, scene
        self._program = gl.Program("shapes.vert", "depth_only.frag")
        self._texture = gl.shadow_map(*_SIZE_PX)
        self._target = gl.Target.of(*_SIZE_PX, None, depth=self._texture)
        self._moves = _moves(model)[scene.geom_of_piece]
        self._size_m = bounding_radii(model)[scene.geom_of_piece]
        self._town: tuple[Array, Square] | None = None

    def draw(self, stage: Stage, frustum: Frustum, towards_sun: Array, spheres: tuple[Array, Array]) -> Maps:
        """Draws what is new, for a scene that is posed for this camera, and binds all maps.

        Args:
            stage: what throws shadows.
            frustum: who looks.
            towards_sun: (3,) unit vector.
            spheres: of the stage, as `Scene.spheres` has them.
        """
        centres_m, radii_m = spheres
        if self._town is None or not np.array_equal(self._town[0], towards_sun):
            self._town = towards_sun, self._draw_town(towards_sun)
            self._scene.pose(stage, frustum.position_world_m)
        squares = (*squares_before(frustum, towards_sun), self._town[1])
        for part, square, chosen in zip(
            _PARTS_PX[:2], squares[:2], (np.ones_like(self._moves), self._moves), strict=True
        ):
            in_light = in_beam(square.centre_m, towards_sun, square.half_side_m, centres_m, radii_m)
            self._draw(part, square, frustum.position_world_m, chosen & in_light, centres_m)
        GL.glBindTextureUnit(_UNIT, self._texture)
        return _maps(squares, frustum.position_world_m)

    def _draw_town(self, towards_sun: Array) -> Square:
        """The map of what stands still, where the model has it: it must not depend on what is looked at first."""
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        stage = Stage(model=self._model, data=data)
        centres_m, _ = self._scene.spheres(stage)
        square = square_about(self._scene.landmarks(stage, ~self._moves), towards_sun)
        self._scene.pose(stage, square.centre_m)
        self._draw(_PARTS_PX[2], square, square.centre_m, ~self._moves, centres_m)
        return square

    def _draw(
        self, part: tuple[int, int, int], square: Square, origin_m: Array, chosen: Mask, centres_m: Array
    ) -> None:
        """Draws one map, for a scene that is posed for this origin."""
        left, top, side = part
        self._target.begin((left, top, side, side))
        GL.glDepthFunc(GL.GL_LESS)
        GL.glDepthMask(True)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glEnable(GL.GL_DEPTH_CLAMP)
        GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
        GL.glPolygonOffset(_SLOPE_BIAS, _UNIT_BIAS)
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.ones(1, np.float32))
        self._program.use(clip_from_place=square.matrix(origin_m))
        is_large = self._size_m > _SEEN_TEXELS * 2 * square.half_side_m / side
        try:
            self._scene.draw(near_to_far(chosen & is_large, -(centres_m @ square.axes[2])))
        finally:
            GL.glEnable(GL.GL_CULL_FACE)
            GL.glDisable(GL.GL_DEPTH_CLAMP)
            GL.glDisable(GL.GL_POLYGON_OFFSET_FILL)


def _maps(squares: tuple[Square, ...], camera_m: Array) -> Maps:
    """Where the three maps lie in the texture, for places relative to a camera."""
    corners_px, sides_px = np.array(_PARTS_PX)[:, :2], np.array(_PARTS_PX)[:, 2:]
    # OpenGL's square reaches from -1 to 1, the first row on top.
    half = np.concatenate([sides_px * (0.5, -0.5) / _SIZE_PX, np.ones((3, 1))], axis=1)
    middle = np.concatenate([(corners_px + sides_px / 2) / _SIZE_PX, np.zeros((3, 1))], axis=1)
    return Maps(
        axes=squares[0].axes,
        scale=half * [square.scale for square in squares],
        offset=half * [square.offset(camera_m) for square in squares] + middle,
        texel_m=np.array([2 * square.half_side_m for square in squares]) / sides_px[:, 0],
        end_m=np.array(ENDS_M),
        # A texel earlier, since looks take in the next one.
        town_ends=(_PARTS_PX[2][1] + _TOWN_PX - 1) / _SIZE_PX[1],
    )


def _moves(model: mujoco.MjModel) -> Mask:
    """(ngeom,) whether a geom's body has a joint above it, or is moved by hand."""
    root = model.body_rootid[model.geom_bodyid]
    return np.asarray((model.body_weldid[model.geom_bodyid] != 0) | (model.body_mocapid[root] >= 0))
