"""Textures of people: a small atlas of cloth colours, and a skin with a painted face."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from authoring.people.field import Array, Frame
from authoring.people.piece import Skin

Colour = tuple[float, float, float]
"""A colour: red, green and blue, linear albedo 0..1."""
Tone = Callable[[Array, Array], None]
"""A function that mixes a colour into a picture, by an amount for each pixel."""

_ATLAS_PX, _SWATCH_PX, _ROW = 64, 16, 4
_SKIN_PX = 256
_FACE_SHARE = 0.75
_FACE_HALF_RAD = np.radians(110.0)
_FACE_TOP_M, _FACE_BOTTOM_M = 0.115, -0.125
_DARKEST = 0.25


def _ramp(width: int) -> Array:
    """Returns the brightness along a swatch; it is constant at both ends, so that neighbouring swatches never
    mix in.
    """
    margin = width // 8
    return np.clip((np.arange(width) + 0.5 - margin) / (width - 2 * margin), 0.0, 1.0) * (1.0 - _DARKEST) + _DARKEST


def _srgb(linear: Array) -> npt.NDArray[np.uint8]:
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return np.clip(np.rint(curve * 255.0), 0, 255).astype(np.uint8)


def _write(path: Path, linear_rgb: Array) -> None:
    if not cv2.imwrite(str(path), _srgb(linear_rgb)[:, :, ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9]):
        raise OSError(f"cannot write {path}")


def write_atlas(path: Path, colours: Mapping[str, Colour]) -> None:
    """Writes the swatches in the order of the mapping; each is a ramp from shadow to full light."""
    image = np.full((_ATLAS_PX, _ATLAS_PX, 3), 0.2)
    for number, colour in enumerate(colours.values()):
        row, column = divmod(number, _ROW)
        swatch = _ramp(_SWATCH_PX)[None, :, None] * np.array(colour)[None, None, :]
        top, left = row * _SWATCH_PX, column * _SWATCH_PX
        image[top : top + _SWATCH_PX, left : left + _SWATCH_PX] = swatch
    _write(path, image)


def atlas_uv(skin: Skin, colours: Mapping[str, Colour]) -> Array:
    """Returns the (F, 3, 2) texture coordinates of the corners of a piece in the atlas, v upwards."""
    order = list(colours)
    if len(order) > _ROW * _ROW:
        raise ValueError(f"an atlas holds {_ROW * _ROW} colours, got {len(order)}")
    centres = skin.vertices[skin.faces].mean(axis=1)
    tint = skin.piece.tint
    names = [tint] * len(centres) if isinstance(tint, str) else tint(centres)
    number = np.array([order.index(name) for name in names])
    share = (skin.light[skin.faces] - _DARKEST) / (1.0 - _DARKEST)
    inner = 1 / 8 + np.clip(share, 0.0, 1.0) * 3 / 4
    u = (number[:, None] % _ROW + inner) / _ROW
    v = 1.0 - (number[:, None] // _ROW + 0.5) / _ROW
    return np.stack([u, np.broadcast_to(v, u.shape)], axis=2)


def swatch_uv(number: int) -> Array:
    """Returns the (2,) texture coordinates of a colour of the atlas in full light, v upwards."""
    return np.array([(number % _ROW + 7 / 8) / _ROW, 1.0 - (number // _ROW + 0.5) / _ROW])


def skin_uv(skin: Skin, head: Frame, size: float) -> Array:
    """Returns the (F, 3, 2) texture coordinates of skin, v upwards: the map of the face in front, the plain ramp
    elsewhere.
    """
    local = head.to_local(skin.vertices) / size
    azimuth = np.arctan2(local[:, 1], local[:, 0] + 0.005)
    u = (0.5 - azimuth / (2.0 * _FACE_HALF_RAD)) * _FACE_SHARE
    v = 1.0 - (_FACE_TOP_M - local[:, 2]) / (_FACE_TOP_M - _FACE_BOTTOM_M)
    painted = np.stack([u, v], axis=1)[skin.faces]
    share = (skin.light[skin.faces] - _DARKEST) / (1.0 - _DARKEST)
    ramp = _FACE_SHARE + (1.0 - _FACE_SHARE) * (1 / 8 + np.clip(share, 0.0, 1.0) * 3 / 4)
    plain = np.stack([ramp, np.full_like(ramp, 0.5)], axis=2)
    on_face = skin.piece.tint == "face"
    flags = (np.abs(azimuth) < _FACE_HALF_RAD * 0.97) & (local[:, 2] > _FACE_BOTTOM_M + 0.003)
    flags &= (local[:, 2] < _FACE_TOP_M - 0.002) & (np.abs(local[:, 0]) < 0.2)
    use = flags[skin.faces].all(axis=1) & on_face
    return np.where(use[:, None, None], painted, plain)


@dataclass(frozen=True, slots=True, kw_only=True)
class Face:
    """The features that are painted on a face.

    Attributes:
        skin, hair, iris: linear albedo.
        lips: redness of the lips, 0..1.
        beard: darkness of the shadow of a beard, 0..1.
        age: 0 for a child, 1 for deep lines.
    """

    skin: Colour
    hair: Colour
    iris: Colour = (0.05, 0.03, 0.02)
    lips: float = 0.35
    beard: float = 0.0
    age: float = 0.3


def _blob(y: Array, z: Array, centre: tuple[float, float], radii: tuple[float, float], hard: float = 1.0) -> Array:
    """Returns a soft spot: 1 in its middle, with a steeper edge for larger `hard`."""
    distance = ((y - centre[0]) / radii[0]) ** 2 + ((z - centre[1]) / radii[1]) ** 2
    return np.asarray(np.exp(-(distance**hard)))


def write_skin(path: Path, face: Face) -> None:
    """Writes the texture of skin: the face, unrolled around the axis of the head, and a plain ramp beside it."""
    width = round(_SKIN_PX * _FACE_SHARE)
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * _FACE_HALF_RAD
    z = _FACE_TOP_M - (np.arange(_SKIN_PX) + 0.5) / _SKIN_PX * (_FACE_TOP_M - _FACE_BOTTOM_M)
    a, z = np.meshgrid(azimuth, z)
    y = 0.094 * np.tan(np.clip(a, -1.1, 1.1))
    side = np.abs(y)
    skin = np.array(face.skin)
    image = np.tile(skin, (*a.shape, 1)).astype(np.float64)

    def tone(amount: Array, colour: Array) -> None:
        image[:] = image * (1.0 - amount[:, :, None]) + amount[:, :, None] * colour

    red = skin * np.array([1.0, 0.55, 0.5])
    dark = skin * 0.30
    tone(0.35 * _blob(side, z, (0.045, -0.028), (0.022, 0.018)), red)
    tone(0.30 * _blob(y, z, (0.0, -0.036), (0.014, 0.012)), red)
    jaw = np.clip((-0.045 - z) / 0.03, 0.0, 1.0)
    tone(
        0.6 * face.beard * jaw * (1.0 - _blob(side, z, (0.045, -0.025), (0.02, 0.03))),
        np.array(face.hair) * 0.7 + skin * 0.15,
    )
    tone(0.38 * _blob(side, z, (0.031, 0.009), (0.019, 0.006)), dark)
    tone(0.25 * _blob(side, z, (0.030, -0.013), (0.016, 0.006)), dark)
    tone(0.35 * _blob(side, z, (0.014, -0.002), (0.005, 0.014)), dark)
    tone(0.28 * _blob(side, z, (0.017, -0.040), (0.006, 0.008)), dark)
    tone(0.6 * _blob(side, z, (0.0075, -0.0475), (0.004, 0.0025), 2.0), skin * 0.15)
    tone(0.45 * face.age * _blob(side - 0.35 * (-0.04 - z), z, (0.024, -0.052), (0.0035, 0.018)), dark)
    tone(0.4 * _blob(y, z, (0.0, -0.0855), (0.020, 0.005)), dark)
    tone(0.6 * np.clip((-0.100 - z) / 0.02, 0.0, 1.0), dark * 1.5)
    for line in range(3):
        tone(0.25 * max(0.0, face.age - 0.4) * _blob(y, z, (0.0, 0.040 + 0.011 * line), (0.04, 0.0018)), dark)
    _eyes(face, side, z, tone)
    _mouth(face, y, z, tone)
    ramp = _ramp(_SKIN_PX - width)[None, :, None] * skin
    _write(path, np.concatenate([image, np.tile(ramp, (_SKIN_PX, 1, 1))], axis=1))


def _eyes(face: Face, side: Array, z: Array, tone: Tone) -> None:
    white = _blob(side, z, (0.0325, -0.0005), (0.0142, 0.0050), 4.0)
    tone(white, np.array([0.42, 0.39, 0.37]))
    tone(white * _blob(side, z, (0.0325, 0.0), (0.0062, 0.0062), 4.0), np.array(face.iris))
    tone(white * _blob(side, z, (0.0325, 0.0), (0.0029, 0.0029), 4.0), np.full(3, 0.004))
    lash = _blob(side, z, (0.0325, 0.0062 - 0.0), (0.0165, 0.0021), 2.0)
    tone(0.85 * lash, np.full(3, 0.012))
    brow = _blob(side, z - 0.0025 * np.cos((side - 0.032) * 60.0), (0.0335, 0.0185), (0.0175, 0.0036), 2.0)
    tone(0.8 * brow, np.array(face.hair) * 0.6)


def _mouth(face: Face, y: Array, z: Array, tone: Tone) -> None:
    pink = np.array(face.skin) * np.array([0.85, 0.42, 0.42]) * (1.0 - face.lips) + face.lips * np.array(
        [0.30, 0.04, 0.05]
    )
    tone(0.75 * _blob(y, z, (0.0, -0.0705), (0.0235, 0.0085), 2.5), pink)
    tone(0.8 * _blob(y, z, (0.0, -0.0705), (0.0245, 0.0014), 2.0), np.array(face.skin) * 0.10)
