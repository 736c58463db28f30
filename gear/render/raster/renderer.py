"""The raster renderer, which draws a view in several passes: ids and depth, shadow maps, and colour of the visible
pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Quality, RawView, RendererInfo, Stage
from gear.render.culling import Mask, in_frustum, near_to_far
from gear.render.face_textures import checked_faces
from gear.render.glcontext import driver_and_device, is_software
from gear.render.linear_samples import smooth_edges
from gear.render.occlusion import openness, shade
from gear.render.pinhole import FAR_M, NEAR_M, Frustum, depth_from_reversed
from gear.render.raster import gl
from gear.render.raster.lights import lights_of
from gear.render.raster.many_samples import LOD_BIAS, at_contrasts, at_edges_and_faces
from gear.render.raster.pixel_mask import PixelMask
from gear.render.raster.scene import Scene, Selection
from gear.render.raster.sun_shadows import SunShadows
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, IdImage, UInt16Image
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

_VISIBLE_UNIT = 6
_FULL = 65535
_MASK_UNIT = 1


class RasterRenderer:
    """The raster renderer: an OpenGL context with one model in it. It is not thread-safe."""

    def __init__(
        self, model: mujoco.MjModel, context: Any, *, quality: Quality = "film", shelf: ArrayShelf = NO_SHELF
    ) -> None:
        """Uploads a model into an OpenGL context.

        Args:
            model: the compiled world; every stage must be of this model.
            context: MuJoCo's `GLContext`, current; `close` frees it.
            quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.
            shelf: shelf of this model, for its triangles and the shadow map of its static geoms.

        Raises:
            BackendError: the driver does not support OpenGL 4.5.
            ValueError: a mesh has more than two million vertices.
        """
        self._closed = True
        self._model = model
        self._quality = quality
        self._gl = context
        gl.require_version()
        driver, name = driver_and_device()
        self._info = RendererInfo(
            name="raster", backend="egl", driver=driver, device=name, is_software=is_software(name)
        )
        self._scene = Scene(model, shelf)
        # A GPU draws the map in less time than it takes to read it.
        self._shadow_shelf = shelf if self._info.is_software else NO_SHELF
        # The geom of each piece; the appended entry is found by piece id -1 (nothing).
        self._geom_of_piece = np.append(self._scene.geom_of_piece, -1).astype(np.int32)
        self._ids_program = gl.Program("positions.vert", "ids.frag")
        self._sky_program = gl.Program("fullscreen.vert", "sky.frag")
        self._downsample_program = gl.Program("tiles.vert", "downsample.frag")
        self._open_program = gl.Program("tiles.vert", "open_samples.frag")
        self._shadows: SunShadows | None = None
        self._masks: dict[tuple[int, int], PixelMask] = {}
        self._targets: dict[tuple[str, int, int], gl.RenderTarget] = {}
        GL.glClipControl(GL.GL_UPPER_LEFT, GL.GL_ZERO_TO_ONE)
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glEnable(GL.GL_CULL_FACE)
        GL.glEnable(GL.GL_TEXTURE_CUBE_MAP_SEAMLESS)
        GL.glDisable(GL.GL_DITHER)
        GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
        self._closed = False

    @property
    def info(self) -> RendererInfo:
        """Name, driver and device of this renderer."""
        return self._info

    def render(
        self,
        stage: Stage,
        cameras: Sequence[CameraRecord],
        *,
        colour: bool = True,
        shapes: Sequence[RawView] | None = None,
    ) -> tuple[RawView, ...]:
        """Renders one raw view (linear colour, depth, geom ids) per camera.

        Args:
            stage: the posed world.
            cameras: the cameras of the scene.
            colour: whether `linear_rgb` is rendered; False leaves it None.
            shapes: views of the same cameras on a stage that differs only in paint and patches; their depth and ids are
                reused.

        Raises:
            ValueError: the stage belongs to another model, or a patch does not have the size of its texture.
            RuntimeError: the renderer is closed.
        """
        if self._closed:
            raise RuntimeError("the renderer is closed")
        if stage.model is not self._model:
            raise ValueError("the stage was compiled as another model than the renderer was opened for")
        checked_faces(stage.model, stage.faces)
        self._gl.make_current()
        self._scene.set_faces(stage)
        known = [None] * len(cameras) if shapes is None else shapes
        return tuple(
            self._view(stage, camera, shape, colour=colour) for camera, shape in zip(cameras, known, strict=True)
        )

    def close(self) -> None:
        """Frees the graphics context; a second call has no effect."""
        if self._closed:
            return
        self._closed = True
        self._gl.make_current()
        self._gl.free()

    def _view(self, stage: Stage, camera: CameraRecord, shape: RawView | None, *, colour: bool) -> RawView:
        frustum = Frustum.of(camera)
        size = (camera.width_px, camera.height_px)
        centres_m, radii_m = spheres = self._scene.spheres(stage)
        self._scene.set_poses(stage, frustum.position_world_m)
        distance_m = np.linalg.norm(centres_m - frustum.position_world_m, axis=1) - radii_m
        seen = near_to_far(self._scene.present(stage) & in_frustum(frustum, centres_m, radii_m), distance_m)
        truth = None
        if shape is None:
            truth = self._render_ids(size, seen, frustum)
            geom_id, depth_m = self._read_ids(truth)
        else:
            geom_id, depth_m = shape.geom_id, shape.depth_m
        linear_rgb = None
        if colour:
            self._update_lights(stage, frustum, spheres)
            drawn, pieces = self._render_colour(size, seen, frustum, truth)
            if self._quality == "film":
                many = at_edges_and_faces(geom_id, depth_m, stage.faces) | at_contrasts(_pixels(drawn))
                self._supersample(drawn, self._among(seen, pieces[many]), frustum, many)
            # Computed while the driver draws.
            open_share = openness(depth_m, camera.focal_px) * np.float32(LINEAR_FULL_SCALE / _FULL)
            linear_rgb = shade(_pixels(drawn), open_share)
            if self._quality == "fast":
                linear_rgb = smooth_edges(linear_rgb, geom_id, depth_m)
        return RawView(linear_rgb=linear_rgb, depth_m=depth_m, geom_id=geom_id)

    def _render_ids(self, size: tuple[int, int], seen: Selection, frustum: Frustum) -> gl.RenderTarget:
        """Draws ids of pieces, and depth, at a size in pixels; the returned target is current."""
        target = self._target("truth", size, GL.GL_R32I)
        target.bind()
        GL.glClearBufferiv(GL.GL_COLOR, 0, np.full(4, -1, np.int32))
        GL.glDepthMask(True)
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.zeros(1, np.float32))
        self._draw_ids(seen, frustum)
        return target

    def _draw_ids(self, seen: Selection, frustum: Frustum) -> None:
        """Draws ids of pieces and depth over the current target."""
        _depth_state(GL.GL_GREATER, writes=True)
        self._ids_program.use(clip_from_relative=_clip_matrix(frustum))
        self._scene.draw_depth(seen)

    def _read_ids(self, truth: gl.RenderTarget) -> tuple[IdImage, FloatImage]:
        width, height = truth.width, truth.height
        reversed_depth = np.empty((height, width), np.float32)
        GL.glReadPixels(0, 0, width, height, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, reversed_depth)
        return self._geom_of_piece[_pieces(truth)], depth_from_reversed(reversed_depth)

    def _update_lights(self, stage: Stage, frustum: Frustum, spheres: tuple[Array, Array]) -> None:
        """Draws shadow maps and uploads all lights."""
        lights = lights_of(stage.model, stage.data)
        maps = None
        if lights.casts_shadows:
            # The maps take a hundred megabytes; nights and models without a sun need none.
            self._shadows = self._shadows or SunShadows(
                self._model, self._scene, self._shadow_shelf, f"{self._info.driver}\n{self._info.device}"
            )
            maps = self._shadows.draw(stage, frustum, lights.towards[0, :3], spheres)
        self._scene.set_lights(lights, maps, frustum.position_world_m)

    def _render_colour(
        self, size: tuple[int, int], seen: Selection, frustum: Frustum, truth: gl.RenderTarget | None
    ) -> tuple[gl.RenderTarget, npt.NDArray[np.int32]]:
        """Draws colour with one sample per pixel.

        Args:
            size: width and height of the picture in pixels.
            seen: pieces to draw, near ones first.
            frustum: the camera's view volume.
            truth: ids and depth of this picture if they have just been drawn, otherwise None.

        Returns:
            The target, which is current and which the device may still be drawing; and the (H, W) ids of pieces.
        """
        truth = truth or self._render_ids(size, seen, frustum)
        truth.bind()
        pieces = _pieces(truth)
        target = self._target("colour", size, GL.GL_RGBA16, truth.depth)
        flags = (f"LOD_BIAS {LOD_BIAS}",) if self._quality == "film" else ()
        self._shade(target, truth, self._among(seen, pieces), frustum, flags)
        GL.glFlush()
        return target, pieces

    def _among(self, seen: Selection, pieces: npt.NDArray[np.int32]) -> Selection:
        """Those of the pieces to draw that some pixels show."""
        is_shown = np.zeros(len(self._geom_of_piece), np.bool_)
        is_shown[pieces] = True
        return seen[is_shown[seen]]

    def _shade(
        self,
        target: gl.RenderTarget,
        truth: gl.RenderTarget,
        pieces: Selection,
        frustum: Frustum,
        flags: tuple[str, ...],
    ) -> None:
        """Draws colour where ids and depth say what is visible."""
        target.bind()
        # Only visible samples are shaded. Of two surfaces at equal depth, the shader keeps the piece that the ids name.
        _depth_state(GL.GL_EQUAL, writes=False)
        GL.glBindTextureUnit(_VISIBLE_UNIT, truth.colour)
        if not self._scene.sky:  # with a sky, every sample that is read is drawn
            GL.glClearBufferfv(GL.GL_COLOR, 0, np.zeros(4, np.float32))
        self._scene.draw_shaded(pieces, _clip_matrix(frustum), flags)
        self._draw_sky(frustum)

    def _supersample(self, target: gl.RenderTarget, pieces: Selection, frustum: Frustum, is_supersampled: Mask) -> None:
        """Replaces pixels of a picture by the mean of 2 x 2 samples; the target is current in the end.

        All other samples have the nearest depth, so that nothing is drawn there.

        Args:
            target: the picture with one sample per pixel.
            pieces: pieces to draw, near ones first.
            frustum: the camera's view volume.
            is_supersampled: (H, W) bool.
        """
        width, height = size = target.width, target.height
        if size not in self._masks:
            self._masks[size] = PixelMask(*size)
        mask = self._masks[size]
        mask.upload(is_supersampled)
        mask.bind(_MASK_UNIT)
        truth = self._target("truth", (2 * width, 2 * height), GL.GL_R32I)
        truth.bind()  # its ids are not cleared: they are read only where the depth is that of a piece, which has its id
        _depth_state(GL.GL_ALWAYS, writes=True)
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.ones(1, np.float32))
        GL.glColorMask(False, False, False, False)
        self._open_program.use()
        mask.draw_tiles()
        GL.glColorMask(True, True, True, True)
        self._draw_ids(pieces, frustum)
        samples = self._target("colour", (2 * width, 2 * height), GL.GL_RGBA16, truth.depth)
        self._shade(samples, truth, pieces, frustum, ("MANY_SAMPLES",))
        target.bind()
        _depth_state(GL.GL_ALWAYS, writes=False)
        GL.glBindTextureUnit(0, samples.colour)
        mask.bind(_MASK_UNIT)
        self._downsample_program.use()
        mask.draw_tiles()
        GL.glFlush()

    def _draw_sky(self, frustum: Frustum) -> None:
        """Draws the sky where no surface was drawn."""
        if not self._scene.sky:
            return
        _depth_state(GL.GL_EQUAL, writes=False)
        GL.glBindTextureUnit(0, self._scene.sky)
        right = np.cross(frustum.forward_world, frustum.up_world)
        axes = np.stack([right, frustum.up_world, frustum.forward_world], axis=1)
        half_m = (frustum.half_width_m, frustum.half_height_m)
        tangents = np.array([*half_m, frustum.centre_right_m, frustum.centre_up_m]) / NEAR_M
        self._sky_program.use(camera_axes=axes, view_tangents=tangents)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def _target(self, purpose: str, size: tuple[int, int], kept_as: int, depth: int | None = None) -> gl.RenderTarget:
        key = (purpose, *size)
        if key not in self._targets:
            self._targets[key] = gl.RenderTarget.create(*size, kept_as, depth)
        return self._targets[key]


def _pieces(truth: gl.RenderTarget) -> npt.NDArray[np.int32]:
    """(H, W) int32 ids of pieces in the current target, -1 where nothing was drawn."""
    pieces = np.empty((truth.height, truth.width), np.int32)
    GL.glReadPixels(0, 0, truth.width, truth.height, GL.GL_RED_INTEGER, GL.GL_INT, pieces)
    return pieces


def _pixels(colour: gl.RenderTarget) -> UInt16Image:
    """(H, W, 3) uint16 colour of the current target; 65535 is full scale."""
    pixels = np.empty((colour.height, colour.width, 3), np.uint16)
    GL.glReadPixels(0, 0, colour.width, colour.height, GL.GL_RGB, GL.GL_UNSIGNED_SHORT, pixels)
    return pixels


def _depth_state(compare: int, *, writes: bool) -> None:
    GL.glDepthFunc(compare)
    GL.glDepthMask(writes)


def _clip_matrix(frustum: Frustum) -> Array:
    """(4, 4) matrix from positions relative to the camera (world axes) to clip space with reversed depth."""
    right = np.cross(frustum.forward_world, frustum.up_world)
    span_m = FAR_M - NEAR_M
    matrix = np.zeros((4, 4))
    forward = frustum.forward_world
    matrix[0, :3] = (right * NEAR_M - forward * frustum.centre_right_m) / frustum.half_width_m
    matrix[1, :3] = (frustum.up_world * NEAR_M - forward * frustum.centre_up_m) / frustum.half_height_m
    matrix[2, :3] = -frustum.forward_world * NEAR_M / span_m
    matrix[2, 3] = NEAR_M * FAR_M / span_m
    matrix[3, :3] = frustum.forward_world
    return matrix
