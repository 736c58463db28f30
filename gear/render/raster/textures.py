"""Textures on the graphics device: those of a model, and the patches that the faces of surfaces show."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Mapping

import mujoco
import numpy as np

from gear.camera.response import decode_srgb
from gear.render.raster import gl
from gear.values.frames import UInt8Image
from gear.values.geometry import Array

_FACES_KEPT = 16
_SRGB = int(mujoco.mjtColorSpace.mjCOLORSPACE_SRGB)
_FLAT = int(mujoco.mjtTexture.mjTEXTURE_2D)
_SKY = int(mujoco.mjtTexture.mjTEXTURE_SKYBOX)


class TextureStore:
    """The textures on the graphics device: the textures of the model by texture id, and patches by content."""

    def __init__(self, model: mujoco.MjModel, used: list[int]) -> None:
        """Uploads the textures that geoms use.

        Args:
            model: the compiled world.
            used: texture ids; -1 and cube textures are ignored.
        """
        self._handles = {
            texture: gl.upload_texture(_texels(model, texture), is_srgb=int(model.tex_colorspace[texture]) == _SRGB)
            for texture in used
            if texture >= 0 and int(model.tex_type[texture]) == _FLAT
        }
        self._faces: OrderedDict[bytes, int] = OrderedDict()

    def of(self, texture: int) -> int:
        """The OpenGL name of the texture with this id in the model; 0 for id -1 (no texture) and for cube
        textures.

        Args:
            texture: id of the texture; the store must have been made with it.
        """
        return self._handles.get(texture, 0)

    def faces(self, srgb_of_geom: Mapping[int, UInt8Image]) -> dict[int, int]:
        """Uploads patches. Returns the OpenGL names of their textures by geom id; the textures are valid until the next
        call.

        Args:
            srgb_of_geom: patches, (H, W, 3) uint8 sRGB, by geom id of their face.
        """
        shown = {geom: self._face(srgb) for geom, srgb in srgb_of_geom.items()}
        idle = [key for key, texture in self._faces.items() if texture not in shown.values()]
        surplus = idle[: max(0, len(self._faces) - _FACES_KEPT)]
        if surplus:
            gl.free_textures([self._faces.pop(key) for key in surplus])
        return shown

    def _face(self, srgb: UInt8Image) -> int:
        content = np.ascontiguousarray(srgb)
        key = hashlib.blake2b(content.tobytes() + repr(srgb.shape).encode(), digest_size=16).digest()
        if key in self._faces:
            self._faces.move_to_end(key)
            return self._faces[key]
        self._faces[key] = gl.upload_texture(content, is_srgb=True)
        return self._faces[key]


def linear_cubes(model: mujoco.MjModel) -> dict[int, Array]:
    """The faces of the model's cube and sky textures with three channels, in linear light.

    Args:
        model: the compiled world.

    Returns:
        By texture id: (6, n, n, 3) float64 in 0..1, in MuJoCo's order of faces. A texture with one picture has it on
            all six faces.
    """
    cubes = {}
    for texture in range(model.ntex):
        width = int(model.tex_width[texture])
        if int(model.tex_type[texture]) != _FLAT and int(model.tex_nchannel[texture]) == 3:
            # A texture with one picture uses it for all six faces.
            faces = np.broadcast_to(_texels(model, texture).reshape(-1, width, width, 3), (6, width, width, 3))
            is_srgb = int(model.tex_colorspace[texture]) == _SRGB
            cubes[texture] = (_LINEAR if is_srgb else np.arange(256) / 255)[faces]
    return cubes


def sky_of(model: mujoco.MjModel) -> int | None:
    """Id of the model's sky texture; None for a model without a sky.

    Args:
        model: the compiled world.
    """
    skies = np.flatnonzero(model.tex_type == _SKY)
    return int(skies[0]) if len(skies) else None


def _texels(model: mujoco.MjModel, texture: int) -> UInt8Image:
    shape = tuple(int(of[texture]) for of in (model.tex_height, model.tex_width, model.tex_nchannel))
    begin = int(model.tex_adr[texture])
    return np.asarray(model.tex_data[begin : begin + int(np.prod(shape))]).reshape(shape)


_LINEAR = decode_srgb(np.arange(256) / 255)
