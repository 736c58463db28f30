"""Textures of a model and of the faces that surfaces wear, on the device."""

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


class Pictures:
    """Textures by the model's ids, and faces by what they show."""

    def __init__(self, model: mujoco.MjModel, worn: list[int]) -> None:
        """Uploads what is worn.

        Args:
            model: whose textures.
            worn: ids; -1 and those that are no flat pictures are left out.
        """
        self._worn = {
            texture: gl.picture(_texels(model, texture), is_srgb=int(model.tex_colorspace[texture]) == _SRGB)
            for texture in worn
            if texture >= 0 and int(model.tex_type[texture]) == _FLAT
        }
        self._faces: OrderedDict[bytes, int] = OrderedDict()

    def of(self, texture: int) -> int:
        """The device's name of a texture; 0 for -1, and for one that is no flat picture."""
        return self._worn.get(texture, 0)

    def faces(self, srgb_of_geom: Mapping[int, UInt8Image]) -> dict[int, int]:
        """The device's names of faces' pictures, by geom; good until they are asked for again."""
        worn = {geom: self._face(srgb) for geom, srgb in srgb_of_geom.items()}
        idle = [key for key, texture in self._faces.items() if texture not in worn.values()]
        surplus = idle[: max(0, len(self._faces) - _FACES_KEPT)]
        if surplus:
            gl.free_textures([self._faces.pop(key) for key in surplus])
        return worn

    def _face(self, srgb: UInt8Image) -> int:
        content = np.ascontiguousarray(srgb)
        key = hashlib.blake2b(content.tobytes() + repr(srgb.shape).encode(), digest_size=16).digest()
        if key in self._faces:
            self._faces.move_to_end(key)
            return self._faces[key]
        self._faces[key] = gl.picture(content, is_srgb=True)
        return self._faces[key]


def linear_cubes(model: mujoco.MjModel) -> dict[int, Array]:
    """(6, n, n, 3) linear faces of the model's cube textures of three channels, by id."""
    cubes = {}
    for texture in range(model.ntex):
        width = int(model.tex_width[texture])
        if int(model.tex_type[texture]) != _FLAT and int(model.tex_nchannel[texture]) == 3:
            # One picture may stand for all six faces.
            faces = np.broadcast_to(_texels(model, texture).reshape(-1, width, width, 3), (6, width, width, 3))
            is_srgb = int(model.tex_colorspace[texture]) == _SRGB
            cubes[texture] = (_LINEAR if is_srgb else np.arange(256) / 255)[faces]
    return cubes


def sky_of(model: mujoco.MjModel) -> int | None:
    """The texture that stands for the sky."""
    skies = np.flatnonzero(model.tex_type == _SKY)
    return int(skies[0]) if len(skies) else None


def _texels(model: mujoco.MjModel, texture: int) -> UInt8Image:
    shape = tuple(int(of[texture]) for of in (model.tex_height, model.tex_width, model.tex_nchannel))
    begin = int(model.tex_adr[texture])
    return np.asarray(model.tex_data[begin : begin + int(np.prod(shape))]).reshape(shape)


_LINEAR = decode_srgb(np.arange(256) / 255)
