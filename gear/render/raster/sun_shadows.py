"""Draws the shadow maps of the sun.

Static geoms cast the same shadows in every picture, so one map of the whole town is drawn only once. Near the camera
this map is too coarse. Two further maps are therefore drawn for each picture: one of all geoms near the camera, and
one, reaching farther, of geoms that can move.

On a CPU the map of a town takes a second, so it is kept on the world's shelf.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Stage
from gear.render.culling import Mask, bounding_radii, may_shadow, near_to_far
from gear.render.pinhole import Frustum
from gear.render.raster import gl
from gear.render.raster.scene import Scene
from gear.render.raster.shadow_cascades import CASCADE_ENDS_M, Cascade, ShadowMaps, town_cascade, view_cascades
from gear.values.array_shelf import NO_SHELF, ArrayShelf, code_digest
from gear.values.frames import FloatImage
from gear.values.geometry import Array

_NEAR_PX, _TOWN_PX = 2048, 4096
_SIZE_PX = 4096, 6144
_PARTS_PX = ((0, 4096, _NEAR_PX), (2048, 4096, _NEAR_PX), (0, 0, _TOWN_PX))
"""Left, top and side in pixels of the three maps in one texture: of all near geoms, of moving geoms, of the town."""

_UNIT = 4
_SLOPE_BIAS, _UNIT_BIAS = 1.5, 2.0
_SEEN_TEXELS = 2
"""Size in texels of the smallest geom that casts a shadow in a map."""

_READ_TEXELS = 4
"""Largest distance in texels from a surface at which its shader reads the shadow map: 1.5 along the normal, 0.75 to the
side, and 1 for the filter.
"""


class SunShadows:
    """Draws the shadow maps of the sun for one model."""

    def __init__(self, model: mujoco.MjModel, scene: Scene, shelf: ArrayShelf = NO_SHELF, device: str = "") -> None:
        """Allocates the texture of the shadow maps. The first call of `draw` draws the town's map.

        Args:
            model: the compiled world.
            scene: the same model on the graphics device.
            shelf: shelf of this model, on which the town's map is kept.
            device: names of the driver and of the device, whose maps differ in last bits.
        """
        self._model, self._scene = model, scene
        self._shelf, self._device = shelf, device
        self._program = gl.Program("positions.vert", "depth_only.frag")
        self._texture = gl.shadow_map(*_SIZE_PX)
        self._target = gl.RenderTarget.create(*_SIZE_PX, None, depth=self._texture)
        self._can_move = _can_move(model)[scene.geom_of_piece]
        self._size_m = bounding_radii(model)[scene.geom_of_piece]
        self._town: tuple[Array, Cascade] | None = None

    def draw(self, stage: Stage, frustum: Frustum, towards_sun: Array, spheres: tuple[Array, Array]) -> ShadowMaps:
        """Draws the two shadow maps that change with the picture, and binds all three maps. The scene must be posed for
        this camera.

        Args:
            stage: the posed world that casts shadows.
            frustum: the camera's view volume.
            towards_sun: (3,) unit vector, world axes.
            spheres: bounding spheres of the pieces, from `Scene.spheres`.

        Returns:
            The positions and scales of the three maps, in the form that shaders read.
        """
        centres_m, _ = spheres
        if self._town is None or not np.array_equal(self._town[0], towards_sun):
            self._town = towards_sun, self._draw_town(towards_sun)
            self._scene.set_poses(stage, frustum.position_world_m)
        cascades = (*view_cascades(frustum, towards_sun), self._town[1])
        present = self._scene.present(stage)
        for part, cascade, chosen in zip(_PARTS_PX[:2], cascades[:2], (present, present & self._can_move), strict=True):
            assert cascade.receivers_m is not None
            casts = may_shadow(cascade.receivers_m, cascade.axes, _margin_m(cascade, part[2]), *spheres)
            self._draw(part, cascade, frustum.position_world_m, chosen & casts, centres_m)
        GL.glBindTextureUnit(_UNIT, self._texture)
        return _maps(cascades, frustum.position_world_m)

    def _draw_town(self, towards_sun: Array) -> Cascade:
        """Draws the map of static geoms, at their initial poses so that it does not depend on the first stage."""
        data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, data)
        stage = Stage(model=self._model, data=data)
        centres_m, _ = self._scene.spheres(stage)
        cascade = town_cascade(self._scene.sample_vertices(stage, ~self._can_move), towards_sun)
        part = _PARTS_PX[2]
        left, top, side = part
        is_drawn = False

        def draw() -> None:
            self._scene.set_poses(stage, cascade.centre_m)
            self._draw(part, cascade, cascade.centre_m, ~self._can_move, centres_m)

        def drawn() -> tuple[FloatImage]:
            nonlocal is_drawn
            draw()
            is_drawn = True
            return (self._target.read_depth((left, top, side, side)),)

        if self._shelf.folder is None:
            draw()
            return cascade
        inputs = (_code(), self._device.encode(), cascade.matrix(cascade.centre_m).tobytes())
        (depth,) = self._shelf.arrays("town-shadow", inputs, drawn)
        if not is_drawn:
            gl.upload_depth(self._texture, left, top, depth)
        return cascade

    def _draw(
        self, part: tuple[int, int, int], cascade: Cascade, origin_m: Array, chosen: Mask, centres_m: Array
    ) -> None:
        """Draws one map; the scene must be posed relative to `origin_m`."""
        left, top, side = part
        self._target.bind((left, top, side, side))
        GL.glScissor(*_rectangle(cascade, part))
        GL.glDepthFunc(GL.GL_LESS)
        GL.glDepthMask(True)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glEnable(GL.GL_DEPTH_CLAMP)
        GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
        GL.glPolygonOffset(_SLOPE_BIAS, _UNIT_BIAS)
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.ones(1, np.float32))
        self._program.use(clip_from_relative=cascade.matrix(origin_m))
        is_large = self._size_m > _SEEN_TEXELS * 2 * cascade.half_side_m / side
        try:
            self._scene.draw_depth(near_to_far(chosen & is_large, -(centres_m @ cascade.axes[2])))
        finally:
            GL.glEnable(GL.GL_CULL_FACE)
            GL.glDisable(GL.GL_DEPTH_CLAMP)
            GL.glDisable(GL.GL_POLYGON_OFFSET_FILL)


def _code() -> bytes:
    """Hash of everything that draws a map of the town, beside the model."""
    folder = Path(__file__).parent
    files = sorted(path for path in folder.iterdir() if path.suffix in (".py", ".glsl"))
    return code_digest(*map(str, (*files, folder.parent / "culling.py", folder.parent / "pinhole.py")))


def _maps(cascades: tuple[Cascade, ...], camera_m: Array) -> ShadowMaps:
    """The maps for positions relative to a camera at `camera_m`."""
    corners_px, sides_px = np.array(_PARTS_PX)[:, :2], np.array(_PARTS_PX)[:, 2:]
    # OpenGL's cascade reaches from -1 to 1, the first row on top.
    half = np.concatenate([sides_px * (0.5, -0.5) / _SIZE_PX, np.ones((3, 1))], axis=1)
    middle = np.concatenate([(corners_px + sides_px / 2) / _SIZE_PX, np.zeros((3, 1))], axis=1)
    return ShadowMaps(
        axes=cascades[0].axes,
        scale=half * [cascade.scale for cascade in cascades],
        offset=half * [cascade.offset(camera_m) for cascade in cascades] + middle,
        texel_m=np.array([2 * cascade.half_side_m for cascade in cascades]) / sides_px[:, 0],
        end_m=np.array(CASCADE_ENDS_M),
        # One texel earlier, since filtered reads include the next one.
        town_ends=(_PARTS_PX[2][1] + _TOWN_PX - 1) / _SIZE_PX[1],
    )


def _margin_m(cascade: Cascade, side_px: int) -> float:
    """Distance in metres from a surface at which its shader may read a map whose side is `side_px`."""
    return _READ_TEXELS * 2 * cascade.half_side_m / side_px


def _rectangle(cascade: Cascade, part: tuple[int, int, int]) -> tuple[int, int, int, int]:
    """Left, top, width and height in pixels of the part of a map that shaders read."""
    left, top, side = part
    low, high = cascade.seen_part(_margin_m(cascade, side))
    # The first row is on top, where the second coordinate is 1.
    begin = np.floor(np.array((low[0] + 1, 1 - high[1])) * side / 2).astype(int)
    end = np.ceil(np.array((high[0] + 1, 1 - low[1])) * side / 2).astype(int)
    return left + int(begin[0]), top + int(begin[1]), int(end[0] - begin[0]), int(end[1] - begin[1])


def _can_move(model: mujoco.MjModel) -> Mask:
    """(ngeom,) bool: whether a geom's body can move, because it or a parent has a joint or is a mocap body."""
    root = model.body_rootid[model.geom_bodyid]
    return np.asarray((model.body_weldid[model.geom_bodyid] != 0) | (model.body_mocapid[root] >= 0))
