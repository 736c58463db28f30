"""The physically based renderer Filament on Vulkan, through MuJoCo's module `mjrf`.

Filament's post-processing is off. Post-processing dithers by frame number and detects edges by contrast. A frame would
therefore depend on earlier frames, and a patch could change pixels that do not show the patch. Without post-processing,
frames are linear and repeatable. gear uses supersampling and its camera pipeline instead.

A patch's texture is filtered as follows (measured). Texels are decoded from sRGB and then filtered trilinearly in
linear light, over mip levels of 2 x 2 averages; the texture repeats. The level is isotropic: log2 of the longer of a
pixel's two edges in texels. A slanted patch is therefore blurred more than necessary along its shorter direction on the
texture. The classic renderer does the same with bytes that are not decoded.
"""

from __future__ import annotations

import ctypes
import hashlib
import re
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.response import encode_srgb
from gear.contracts.rendering import Quality, RawView, RendererInfo, Stage
from gear.render.display_colours import has_linear_colours
from gear.render.draw_order import widen
from gear.render.face_textures import checked_faces
from gear.render.linear_samples import four_times, ids_from_rgb, smooth_edges, sum_2x2
from gear.render.native_output import native_output
from gear.render.occlusion import openness, shade
from gear.render.pinhole import FAR_M, NEAR_M, Frustum, depth_from_reversed
from gear.render.visible_groups import geoms_only
from gear.render.vulkan import VulkanUnavailableError, vulkan_devices
from gear.values.errors import BackendError
from gear.values.frames import FloatImage, IdImage, UInt8Image, UInt16Image
from gear.values.scene import CameraRecord, Pose

_REMEDY = "apt-get install mesa-vulkan-drivers libvulkan1, or use --renderer classic"
_FACE_TEXTURES_KEPT = 16
_M_ARENA_MAX = -8
_WHITE = np.ones(4, np.float32)
_FRAMES_TO_SETTLE = 24
"""Number of frames after which Filament frees its upload buffers, which take a quarter of the memory for a town."""

_FIRST_LOOK = CameraRecord(
    name="first", width_px=16, height_px=16, focal_px=8.0, world_from_camera=Pose(position_m=(0.0, 0.0, -1e5))
)
"""A camera so far away that nothing is drawn. Drawing a town, even at this small size, would take two cores 0.15 s."""


@dataclass(frozen=True, slots=True, eq=False)
class _Target:
    """A render target, and the buffer into which its pixels are read."""

    handle: Any
    read: Any
    pixels: npt.NDArray[Any]


class FilamentRenderer:
    """The renderer Filament: a Vulkan context with one model in it. It is not thread-safe."""

    def __init__(self, model: mujoco.MjModel, *, quality: Quality = "film") -> None:
        """Opens a Vulkan context and loads the model.

        Args:
            model: the compiled world; every stage must be of this model, which is never changed.
            quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.

        Raises:
            BackendError: there is no Vulkan driver, or this build of MuJoCo has no Filament.
        """
        self._closed = True
        self._model = model
        self._quality = quality
        self._linear_colours = has_linear_colours(model)
        self._mjrf, chatter, software_by_device = _start()
        with native_output() as lines:
            mjrf = self._mjrf
            self._context = mjrf.Context(mjrf.ContextConfig(graphics_api=mjrf.GraphicsApi.GRAPHICS_API_VULKAN))
            self._resources = mjrf.ModelResources(self._context, model)
            self._scene = self._context.create_scene(mjrf.SceneParams())
            self._scene.configure_from_model(model)
            widen(mjrf, self._context, self._scene, model.ngeom)
            self._lights = mjrf.ModelLights(self._scene, self._resources)
            self._renderables = mjrf.ModelRenderables(self._scene, self._resources)
            self._renderables.set_options(geoms_only())
        self._info = _info(chatter + lines, software_by_device)
        self._targets: dict[tuple[int, int, str], _Target] = {}
        self._face_textures: OrderedDict[bytes, Any] = OrderedDict()
        self._retired_textures: list[Any] = []
        self._closed = False
        with native_output():  # the driver's thread writes its messages while the first frames are drawn
            for _ in range(_FRAMES_TO_SETTLE):
                self._geom_id(_FIRST_LOOK)

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
        if stage.model is not self._model:
            raise ValueError("the stage was compiled as another model than the renderer was opened for")
        self._lights.update(stage.data)
        self._renderables.update(stage.data)
        self._set_paint_and_faces(stage)
        known = [None] * len(cameras) if shapes is None else shapes
        return tuple(self._view(camera, shape, colour=colour) for camera, shape in zip(cameras, known, strict=True))

    def close(self) -> None:
        """Frees the graphics context; a second call has no effect."""
        if self._closed:
            return
        self._closed = True
        # Objects of the context are freed before it, and users before what they use.
        del self._renderables, self._lights, self._scene
        self._targets.clear()
        self._face_textures.clear()
        self._retired_textures.clear()
        del self._resources, self._context

    def _set_paint_and_faces(self, stage: Stage) -> None:
        """Sets paint colours and patches. `ModelRenderables.update` has just reset those of the last stage."""
        for geom_id, rgb in stage.paint_rgb.items():
            renderable = self._renderable(geom_id)
            material = renderable.get_material()
            colour = rgb if self._linear_colours else encode_srgb(rgb)
            material.color = np.array([*colour, 1.0], np.float32)
            renderable.set_material(material)
        for geom_id, (_, srgb) in checked_faces(self._model, stage.faces).items():
            renderable = self._renderable(geom_id)
            material = renderable.get_material()
            material.color = _WHITE
            material.color_texture = self._face_texture(srgb)
            renderable.set_material(material)

    def _renderable(self, geom_id: int) -> Any:
        return self._renderables.get_renderable(mujoco.mjtObj.mjOBJ_GEOM, geom_id, -1)

    def _face_texture(self, srgb: UInt8Image) -> Any:
        content = np.ascontiguousarray(srgb).tobytes()
        key = hashlib.blake2b(content + repr(srgb.shape).encode(), digest_size=16).digest()
        if key in self._face_textures:
            self._face_textures.move_to_end(key)
            return self._face_textures[key]
        mjrf = self._mjrf
        texture = self._context.create_texture(
            mjrf.TextureConfig(
                width=srgb.shape[1],
                height=srgb.shape[0],
                format=mjrf.PixelFormat.PIXEL_FORMAT_RGB8,
                color_space=mjrf.ColorSpace.COLORSPACE_SRGB,
                sampler_type=mjrf.SamplerType.TEXTURE_2D,
            )
        )
        data = mjrf.TextureData()
        data.set_image(content)
        texture.upload(data)
        self._face_textures[key] = texture
        if len(self._face_textures) > _FACE_TEXTURES_KEPT:
            # The material that uses the texture is freed by the next frame.
            self._retired_textures.append(self._face_textures.popitem(last=False)[1])
        return texture

    def _view(self, camera: CameraRecord, shape: RawView | None, *, colour: bool) -> RawView:
        depth_m = self._depth_m(camera) if shape is None else shape.depth_m
        geom_id = self._geom_id(camera) if shape is None else shape.geom_id
        linear_rgb = None
        if colour:
            linear_rgb = shade(self._samples(camera), openness(depth_m, camera.focal_px))
            if self._quality == "fast":
                linear_rgb = smooth_edges(linear_rgb, geom_id, depth_m)
        return RawView(linear_rgb=linear_rgb, depth_m=depth_m, geom_id=geom_id)

    def _samples(self, camera: CameraRecord) -> UInt16Image:
        if self._quality == "film":
            return sum_2x2(self._pixels(camera, "DEFAULT", "RGB8", scale=2))
        return four_times(self._pixels(camera, "DEFAULT", "RGB8"))

    def _depth_m(self, camera: CameraRecord) -> FloatImage:
        return depth_from_reversed(self._pixels(camera, "DEPTH", "R32F").copy())

    def _geom_id(self, camera: CameraRecord) -> IdImage:
        return ids_from_rgb(self._pixels(camera, "SEGMENTATION_BY_ID", "RGB8"))

    def _pixels(self, camera: CameraRecord, mode: str, pixel_format: str, *, scale: int = 1) -> npt.NDArray[Any]:
        """Runs one pass. The next pass with the same size and format overwrites the returned buffer."""
        width, height = camera.width_px * scale, camera.height_px * scale
        target = self._target(width, height, pixel_format)
        request = self._mjrf.RenderRequest()
        request.scene = self._scene
        request.target = target.handle
        request.camera = self._camera(Frustum.of(camera))
        request.viewport = self._mjrf.Rect(left=0, bottom=0, width=width, height=height)
        request.draw_mode = getattr(self._mjrf.DrawMode, f"DRAW_MODE_{mode}")
        request.post_processing = False
        request.reflections = False
        request.haze = False
        request.headlight = False
        request.shadows = request.skybox = mode == "DEFAULT"
        self._context.wait_for_frame(self._context.render([request], [target.read]))
        self._retired_textures.clear()
        return target.pixels

    def _camera(self, frustum: Frustum) -> Any:
        return self._mjrf.Camera(
            pos=frustum.position_world_m.astype(np.float32),
            forward=frustum.forward_world.astype(np.float32),
            up=frustum.up_world.astype(np.float32),
            frustum_bottom=frustum.centre_up_m - frustum.half_height_m,
            frustum_top=frustum.centre_up_m + frustum.half_height_m,
            frustum_width=frustum.half_width_m,
            frustum_center=frustum.centre_right_m,
            frustum_near=NEAR_M,
            frustum_far=FAR_M,
        )

    def _target(self, width: int, height: int, pixel_format: str) -> _Target:
        key = (width, height, pixel_format)
        if key not in self._targets:
            formats = self._mjrf.PixelFormat
            config = self._mjrf.RenderTargetConfig(
                width=width,
                height=height,
                color_format=getattr(formats, f"PIXEL_FORMAT_{pixel_format}"),
                depth_format=formats.PIXEL_FORMAT_DEPTH32F,
            )
            handle = self._context.create_render_target(config)
            is_float = pixel_format == "R32F"
            pixels = np.zeros((height, width) if is_float else (height, width, 3), np.float32 if is_float else np.uint8)
            read = self._mjrf.ReadRequest(target=handle)
            read.set_buffer(pixels)
            self._targets[key] = _Target(handle, read, pixels)
        return self._targets[key]


def _start() -> tuple[Any, list[str], dict[str, bool]]:
    """Loads Filament.

    Returns:
        MuJoCo's Filament module, the messages so far, and for each device by name whether it is a software renderer.

    Raises:
        BackendError: Filament cannot start on this machine.
    """
    _share_one_heap()
    with native_output() as chatter:
        try:
            devices = vulkan_devices()
        except VulkanUnavailableError as error:
            raise BackendError("filament", str(error), _REMEDY) from error
        try:
            import mujoco.studio._studio  # the import registers Filament's materials
            from mujoco import mjrf
        except ImportError as error:
            problem = f"this MuJoCo {mujoco.__version__} has no Filament ({error})"
            remedy = "pip install 'mujoco>=4.0,<4.1', or use --renderer classic"
            raise BackendError("filament", problem, remedy) from error
    return mjrf, chatter, {device.name: device.is_software for device in devices}


def _share_one_heap() -> None:
    """Makes the driver's threads share one heap. With separate heaps, each would keep as much memory as it ever needed.

    Only glibc has separate heaps.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, 1)


def _info(chatter: list[str], software_by_device: dict[str, bool]) -> RendererInfo:
    """Driver and device, from Filament's messages; without messages, the first device."""
    text = "\n".join(chatter)
    driver = re.search(r"Vulkan device driver: (.+)", text)
    chosen = re.search(r"Selected physical device '(.+)' from", text)
    device = chosen.group(1) if chosen else next(iter(software_by_device))
    return RendererInfo(
        name="filament",
        backend="vulkan",
        driver=driver.group(1).strip() if driver else "unknown",
        device=device,
        is_software=software_by_device.get(device, "llvmpipe" in device),
    )
