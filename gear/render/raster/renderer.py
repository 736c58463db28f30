"""The renderer: ids and depth first, then shadows, then colour on what is seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Quality, RawView, RendererInfo, Stage
from gear.render.culling import in_frustum, near_to_far
from gear.render.face_textures import checked_faces
from gear.render.glcontext import driver_and_device, is_software
from gear.render.linear_samples import smooth_edges
from gear.render.occlusion import openness, shade
from gear.render.pinhole import FAR_M, NEAR_M, Frustum, depth_from_reversed
from gear.render.raster import gl
from gear.render.raster.lights import lamps_of
from gear.render.raster.scene import Scene, Selection
from gear.render.raster.sun_shadows import SunShadows
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, IdImage, UInt16Image
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

_SEEN_UNIT = 6
_FULL = 65535


class RasterRenderer:
    """One OpenGL context with one model in it. Not for use from several threads."""

    def __init__(self, model: mujoco.MjModel, context: Any, *, quality: Quality = "film") -> None:
        """Puts a model into a context.

        Args:
            model: what is rendered.
            context: MuJoCo's `GLContext`, current; the renderer frees it when it is closed.
            quality: see `gear.contracts.rendering.Quality`.

        Raises:
            BackendError: the driver has less than OpenGL 4.5.
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
        self._scene = Scene(model)
        # What a pixel shows by the piece that it counts; nothing is -1, which finds the last entry.
        self._geom_of_piece = np.append(self._scene.geom_of_piece, -1).astype(np.int32)
        self._truth_program = gl.Program("shapes.vert", "ids.frag")
        self._sky_program = gl.Program("fullscreen.vert", "sky.frag")
        self._halve_program = gl.Program("fullscreen.vert", "downsample.frag")
        self._shadows: SunShadows | None = None
        self._targets: dict[tuple[str, int, int], gl.Target] = {}
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
        """Who renders."""
        return self._info

    def render(
        self,
        stage: Stage,
        cameras: Sequence[CameraRecord],
        *,
        colour: bool = True,
        shapes: Sequence[RawView] | None = None,
    ) -> tuple[RawView, ...]:
        """One raw view a camera; see `gear.contracts.rendering.Renderer`.

        Raises:
            ValueError: the stage belongs to another model, or a face does not fit its texture.
            RuntimeError: the renderer is closed.
        """
        if self._closed:
            raise RuntimeError("the renderer is closed")
        if stage.model is not self._model:
            raise ValueError("the stage was compiled as another model than the renderer was opened for")
        checked_faces(stage.model, stage.faces)
        self._gl.make_current()
        self._scene.dress(stage)
        known = [None] * len(cameras) if shapes is None else shapes
        return tuple(
            self._view(stage, camera, shape, colour=colour) for camera, shape in zip(cameras, known, strict=True)
        )

    def close(self) -> None:
        """Frees the context; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._gl.make_current()
        self._gl.free()

    def _view(self, stage: Stage, camera: CameraRecord, shape: RawView | None, *, colour: bool) -> RawView:
        frustum = Frustum.of(camera)
        size = (camera.width_px, camera.height_px)
        centres_m, radii_m = spheres = self._scene.spheres(stage)
        self._scene.pose(stage, frustum.position_world_m)
        distance_m = np.linalg.norm(centres_m - frustum.position_world_m, axis=1) - radii_m
        seen = near_to_far(in_frustum(frustum, centres_m, radii_m), distance_m)
        truth = None
        if shape is None:
            truth = self._truth(size, seen, frustum)
            geom_id, depth_m = self._read(truth)
        else:
            geom_id, depth_m = shape.geom_id, shape.depth_m
        linear_rgb = None
        if colour:
            self._light(stage, frustum, spheres)
            drawn = self._colour(size, seen, frustum, truth)
            # While the driver draws.
            open_share = openness(depth_m, camera.focal_px) * np.float32(LINEAR_FULL_SCALE / _FULL)
            linear_rgb = shade(_pixels(drawn), open_share)
            if self._quality == "fast":
                linear_rgb = smooth_edges(linear_rgb, geom_id, depth_m)
        return RawView(linear_rgb=linear_rgb, depth_m=depth_m, geom_id=geom_id)

    def _truth(self, size: tuple[int, int], seen: Selection, frustum: Frustum) -> gl.Target:
        """Pieces and depth of this many pixels, in a target that is current then."""
        target = self._target("truth", size, GL.GL_R32I)
        target.begin()
        _depth_state(GL.GL_GREATER, writes=True)
        GL.glClearBufferiv(GL.GL_COLOR, 0, np.full(4, -1, np.int32))
        GL.glClearBufferfv(GL.GL_DEPTH, 0, np.zeros(1, np.float32))
        self._truth_program.use(clip_from_place=_clip_matrix(frustum))
        self._scene.draw(seen)
        return target

    def _read(self, truth: gl.Target) -> tuple[IdImage, FloatImage]:
        width, height = truth.width, truth.height
        reversed_depth = np.empty((height, width), np.float32)
        GL.glReadPixels(0, 0, width, height, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, reversed_depth)
        return self._geom_of_piece[_pieces(truth)], depth_from_reversed(reversed_depth)

    def _light(self, stage: Stage, frustum: Frustum, spheres: tuple[Array, Array]) -> None:
        """Draws the maps of the sun's shadows, and tells the shaders of all lights."""
        lamps = lamps_of(stage.model, stage.data)
        maps = None
        if lamps.casts:
            # A hundred megabytes, that nights and models without a sun never need.
            self._shadows = self._shadows or SunShadows(self._model, self._scene)
            maps = self._shadows.draw(stage, frustum, lamps.towards[0, :3], spheres)
        self._scene.light(lamps, maps, frustum.position_world_m)

    def _colour(self, size: tuple[int, int], seen: Selection, frustum: Frustum, truth: gl.Target | None) -> gl.Target:
        """Has the colour of these pixels drawn, in a target that is current then.

        Args:
            size: of the picture.
            seen: what to draw.
            frustum: who looks.
            truth: ids and depth of this picture, if they have just been drawn.
        """
        is_film = self._quality == "film"
        samples = (2 * size[0], 2 * size[1]) if is_film else size
        if is_film or truth is None:
            truth = self._truth(samples, seen, frustum)
        truth.begin()
        is_seen = np.zeros(len(self._geom_of_piece), np.bool_)
        is_seen[_pieces(truth)] = True
        target = self._target("colour", samples, GL.GL_RGBA16, truth.depth)
        target.begin()
        # Only what is seen is shaded; of two surfaces at the very same depth the pieces decide.
        _depth_state(GL.GL_EQUAL, writes=False)
        GL.glBindTextureUnit(_SEEN_UNIT, truth.colour)
        GL.glClearBufferfv(GL.GL_COLOR, 0, np.zeros(4, np.float32))
        self._scene.draw_surfaces(seen[is_seen[seen]], _clip_matrix(frustum), ("MANY_SAMPLES",) if is_film else ())
        self._draw_sky(frustum)
        if is_film:
            target = self._halved(target)
        GL.glFlush()
        return target

    def _draw_sky(self, frustum: Frustum) -> None:
        """Where nothing was drawn: there the depth is still that of infinity."""
        if not self._scene.sky:
            return
        _depth_state(GL.GL_EQUAL, writes=False)
        GL.glBindTextureUnit(0, self._scene.sky)
        right = np.cross(frustum.forward_world, frustum.up_world)
        axes = np.stack([right, frustum.up_world, frustum.forward_world], axis=1)
        half_m = (frustum.half_width_m, frustum.half_height_m)
        corner = np.array([*half_m, frustum.centre_right_m, frustum.centre_up_m]) / NEAR_M
        self._sky_program.use(camera_axes=axes, corner=corner)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def _halved(self, samples: gl.Target) -> gl.Target:
        """The means of blocks of four, in a target that is current then."""
        half = self._target("half", (samples.width // 2, samples.height // 2), GL.GL_RGBA16, 0)
        half.begin()
        _depth_state(GL.GL_ALWAYS, writes=False)
        GL.glBindTextureUnit(0, samples.colour)
        self._halve_program.use()
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        return half

    def _target(self, purpose: str, size: tuple[int, int], kept_as: int, depth: int | None = None) -> gl.Target:
        key = (purpose, *size)
        if key not in self._targets:
            self._targets[key] = gl.Target.of(*size, kept_as, depth)
        return self._targets[key]


def _pieces(truth: gl.Target) -> npt.NDArray[np.int32]:
    """(H, W) of a target that is current, -1 for nothing."""
    pieces = np.empty((truth.height, truth.width), np.int32)
    GL.glReadPixels(0, 0, truth.width, truth.height, GL.GL_RED_INTEGER, GL.GL_INT, pieces)
    return pieces


def _pixels(colour: gl.Target) -> UInt16Image:
    """(H, W, 3) of a target that is current, 65535 is full scale."""
    pixels = np.empty((colour.height, colour.width, 3), np.uint16)
    GL.glReadPixels(0, 0, colour.width, colour.height, GL.GL_RGB, GL.GL_UNSIGNED_SHORT, pixels)
    return pixels


def _depth_state(compare: int, *, writes: bool) -> None:
    GL.glDepthFunc(compare)
    GL.glDepthMask(writes)


def _clip_matrix(frustum: Frustum) -> Array:
    """(4, 4) from places relative to the camera, in the world's axes, to OpenGL's clip space with reversed depth."""
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
