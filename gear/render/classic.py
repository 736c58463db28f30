"""MuJoCo's own OpenGL renderer, through EGL or OSMesa.

It computes light with display values, without tone curve and gamma. To render the same MJCF correctly, it uses a copy
of the model with display colours: textures marked sRGB are not decoded, and linear albedos of materials and geoms are
encoded. Its frames are linear in the 8-bit values of a patch; Filament's frames are linear in the albedo that these
values encode.

A patch's texture is filtered trilinearly over mip levels, as in `gear.render.filament`, but on sRGB bytes that are not
decoded.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from gear.contracts.rendering import Quality, RawView, RendererInfo, Stage
from gear.render.culling import Mask, bounding_spheres, in_beam, in_frustum
from gear.render.display_colours import SHADOW_REACH_M, displayed_colour, displayed_model
from gear.render.face_textures import checked_faces
from gear.render.glcontext import choose_backend, driver_and_device, is_software, open_context
from gear.render.linear_samples import four_times, ids_from_rgb, smooth_edges
from gear.render.occlusion import openness, shade
from gear.render.pinhole import FAR_M, NEAR_M, Frustum, depth_from_reversed
from gear.render.visible_groups import geoms_only
from gear.values.errors import BackendError
from gear.values.frames import FloatImage, IdImage, UInt8Image
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

_SAMPLES = {"film": 4, "fast": 0}
_EXTRA_GEOMS = 100
_SHADOW_AHEAD_M = 40.0
_SHADOW_HEIGHT_M = 300.0
_HIDDEN_GROUP = 5
_FLAGS = mujoco.mjtRndFlag


class ClassicRenderer:
    """The classic renderer: an OpenGL context with one model in it. It is not thread-safe."""

    def __init__(self, model: mujoco.MjModel, *, quality: Quality = "film") -> None:
        """Opens an OpenGL context and loads the model.

        Args:
            model: the compiled world; every stage must be of this model, which is never changed.
            quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.

        Raises:
            BackendError: there is no OpenGL driver.
        """
        self._closed = True
        self._shared_model = model
        self._quality = quality
        self._model = displayed_model(model)
        self._model.vis.quality.offsamples = _SAMPLES[quality]
        self._replaced: dict[int, npt.NDArray[np.uint8]] = {}
        self._size = (0, 0)
        backend = choose_backend("classic")
        self._gl = open_context(backend, "classic")
        try:
            self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        except mujoco.FatalError as error:
            self._gl.free()
            raise BackendError("classic", f"{backend} has too little OpenGL ({error})", "update the driver") from error
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        driver, device = driver_and_device()
        self._info = RendererInfo(
            name="classic", backend=backend, driver=driver, device=device, is_software=is_software(device)
        )
        self._scene = mujoco.MjvScene(self._model, maxgeom=self._model.ngeom + _EXTRA_GEOMS)
        self._option = geoms_only()
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
        """
        if stage.model is not self._shared_model:
            raise ValueError("the stage was compiled as another model than the renderer was opened for")
        self._gl.make_current()
        self._set_faces(dict(checked_faces(self._shared_model, stage.faces).values()))
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
        self._context.free()
        self._gl.free()

    def _set_faces(self, faces: dict[int, UInt8Image]) -> None:
        """Uploads patches by texture id, and restores the textures of faces that only the last stage had changed."""
        for texture in sorted(self._replaced.keys() | faces.keys()):
            self._upload(texture, faces.get(texture))

    def _upload(self, texture: int, srgb: UInt8Image | None) -> None:
        """Uploads new texels of a texture in the model's copy; None restores the original ones."""
        model = self._model
        begin = int(model.tex_adr[texture])
        texels = model.tex_data[begin : begin + 3 * int(model.tex_height[texture]) * int(model.tex_width[texture])]
        own = self._replaced.pop(texture, None)
        if own is None:
            own = texels.copy()
        content = own if srgb is None else srgb.reshape(-1)
        if srgb is not None:
            self._replaced[texture] = own
        if not np.array_equal(texels, content):
            texels[:] = content
            mujoco.mjr_uploadTexture(model, self._context, texture)

    def _view(self, stage: Stage, camera: CameraRecord, shape: RawView | None, *, colour: bool) -> RawView:
        size = (camera.width_px, camera.height_px)
        if self._size != size:
            self._size = size
            mujoco.mjr_resizeOffscreen(*size, self._context)
        frustum = Frustum.of(camera)
        spheres = bounding_spheres(self._shared_model, stage.data)
        seen = in_frustum(frustum, *spheres)
        if shape is None:
            self._fill_scene(stage, frustum, seen)
            geom_id, depth_m = self._ids_and_depth(camera)
        else:
            geom_id, depth_m = shape.geom_id, shape.depth_m
        linear_rgb = None
        if colour:
            casts = self._shadow_casters(stage, frustum, *spheres)
            self._fill_scene(stage, frustum, seen | casts)
            self._set_paint(stage, casts)
            linear_rgb = shade(four_times(self._colour(camera)), openness(depth_m, camera.focal_px))
            if self._quality == "fast":
                linear_rgb = smooth_edges(linear_rgb, geom_id, depth_m)
        return RawView(linear_rgb=linear_rgb, depth_m=depth_m, geom_id=geom_id)

    def _fill_scene(self, stage: Stage, frustum: Frustum, needed: Mask) -> None:
        """Fills the MuJoCo scene with the geoms in `needed`, for a view volume."""
        self._model.geom_group[:] = np.where(needed, self._shared_model.geom_group, _HIDDEN_GROUP)
        mujoco.mjv_updateScene(
            self._model, stage.data, self._option, None, mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        for gl_camera in self._scene.camera:
            gl_camera.pos[:] = frustum.position_world_m
            gl_camera.forward[:] = frustum.forward_world
            gl_camera.up[:] = frustum.up_world
            gl_camera.frustum_center = frustum.centre_right_m
            gl_camera.frustum_width = frustum.half_width_m
            gl_camera.frustum_bottom = frustum.centre_up_m - frustum.half_height_m
            gl_camera.frustum_top = frustum.centre_up_m + frustum.half_height_m
            gl_camera.frustum_near = NEAR_M
            gl_camera.frustum_far = FAR_M
        for light in self._scene.lights[: self._scene.nlight]:
            if light.type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL:
                # The sun casts shadows on a square around the line through this point.
                light.pos[:] = _shadow_centre(frustum) - _SHADOW_HEIGHT_M * light.dir

    def _shadow_casters(self, stage: Stage, frustum: Frustum, centres_m: Array, radii_m: Array) -> Mask:
        """(ngeom,) bool: geoms in the squares that the suns light; all geoms if another kind of light casts shadows."""
        casts = np.zeros(len(radii_m), np.bool_)
        model = self._model
        for light in np.flatnonzero(model.light_castshadow & model.light_active):
            if model.light_type[light] != mujoco.mjtLightType.mjLIGHT_DIRECTIONAL:
                return np.ones_like(casts)
            direction = stage.data.light_xdir[light]
            casts |= in_beam(_shadow_centre(frustum), direction, SHADOW_REACH_M, centres_m, radii_m)
        return casts

    def _set_paint(self, stage: Stage, casts: Mask) -> None:
        """Sets the paint colours, and switches shadows off for geoms that need none. The scene is filled again
        for each view.
        """
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM:
                continue
            index = geom.objid
            if not casts[index]:
                geom.category = mujoco.mjtCatBit.mjCAT_DECOR
            if index in stage.paint_rgb:
                geom.rgba[:3] = displayed_colour(stage.paint_rgb[index])
            elif index in stage.faces:
                geom.rgba[:3] = 1.0

    def _colour(self, camera: CameraRecord) -> UInt8Image:
        pixels = np.empty((camera.height_px, camera.width_px, 3), np.uint8)
        self._render_and_read(camera, pixels, None, seen=(_FLAGS.mjRND_SHADOW, _FLAGS.mjRND_SKYBOX))
        return pixels[::-1]

    def _ids_and_depth(self, camera: CameraRecord) -> tuple[IdImage, FloatImage]:
        """Geom ids, and depth in metres, from one pass."""
        pixels = np.empty((camera.height_px, camera.width_px, 3), np.uint8)
        depth = np.empty((camera.height_px, camera.width_px), np.float32)
        self._render_and_read(camera, pixels, depth, seen=(_FLAGS.mjRND_SEGMENT, _FLAGS.mjRND_IDCOLOR))
        geoms = self._scene.geoms[: self._scene.ngeom]
        # Pixels hold the geom's position in the scene plus one; 0 (no geom) becomes -1, the last entry.
        geom_of_place = np.full(self._scene.ngeom + 1, -1, np.int32)
        for geom in geoms:
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                geom_of_place[geom.segid] = geom.objid
        place = ids_from_rgb(np.ascontiguousarray(pixels[::-1]))
        return geom_of_place[place], depth_from_reversed(np.ascontiguousarray(depth[::-1]))

    def _render_and_read(
        self,
        camera: CameraRecord,
        pixels: UInt8Image,
        depth: FloatImage | None,
        *,
        seen: tuple[mujoco.mjtRndFlag, ...],
    ) -> None:
        """Runs one pass with only the flags in `seen` set, and writes pixels and depth into the given arrays."""
        self._scene.flags[:] = 0
        for flag in (*seen, _FLAGS.mjRND_CULL_FACE):
            self._scene.flags[flag] = 1
        viewport = mujoco.MjrRect(0, 0, camera.width_px, camera.height_px)
        mujoco.mjr_render(viewport, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, depth, viewport, self._context)


def _shadow_centre(frustum: Frustum) -> Array:
    """(3,) world position around which the shadow map is centred."""
    return np.asarray(frustum.position_world_m + _SHADOW_AHEAD_M * frustum.forward_world)
