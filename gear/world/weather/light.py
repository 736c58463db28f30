"""The light of a weather in the units of a linear frame. The exposure is fixed for each weather.

The exposure is chosen such that a white wall (albedo `WHITE_ALBEDO`) that faces the brightest direction gets
`WHITE_LEVEL` of the frame's full scale.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image
from gear.values.geometry import frozen
from gear.values.scene import Weather
from gear.world.weather.sky import Sky

Floats = npt.NDArray[np.float64]

WHITE_ALBEDO = 0.7
WHITE_LEVEL = 0.85
SKY_LEVEL = 0.9
"""Largest level of the bright parts of the sky (their 90 % quantile) in the frame; it limits the exposure."""

SKY_FACE_PX = 512
STREET_FACE_PX = 128
STREET_ALBEDO = np.array([0.30, 0.27, 0.23])
STREET_TOP = 0.72
"""Sine of the elevation angle of the tops of the houses along a street."""

STREET_SHARE = 0.65
"""Share of the sky below the tops of the houses (`STREET_TOP`) that houses hide."""

STREET_SUNLIT = 0.45
"""Share of the visible surfaces in a street that the sun reaches."""

BOUNCE_GAIN = 1.25
"""Factor that represents the light that streets and houses reflect to each other; the renderers do not compute this
light.
"""

NIGHT_SKY_SHARE = 0.2
"""Brightness of the night sky, as a share of the light in the streets, which mostly comes from the town itself."""

LAMPLIT_HOUSES = np.array([0.10, 0.075, 0.05])
"""Radiance of house fronts in the light of street lamps, as a share of the frame's full scale."""

FACE_ORDER = "RLUDFB"
_INTEGRATION_PX = 16


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lighting:
    """The light of sun and sky in units of the frame, where a radiance of 1.0 is full scale.

    Attributes:
        towards_sun: (3,) unit vector towards the sun, world axes.
        sun: (3,) irradiance of a surface that faces the sun, for each linear sRGB channel.
        ambient: (3,) irradiance of a level surface by the sky, divided by pi.
        sky_faces: (6 * size, size, 3) uint8 sRGB picture of the sky: the faces of a cube in `FACE_ORDER`.
        street_faces: a smaller picture in the same form, of the light that reaches a street from the sky and from the
            houses.
    """

    towards_sun: Floats
    sun: Floats
    ambient: Floats
    sky_faces: UInt8Image
    street_faces: UInt8Image


HORIZON_AZIMUTHS = 64
"""Number of azimuths for which `airlight` computes the light of distant air."""


def lighting_of(weather: Weather, *, sky_face_px: int = SKY_FACE_PX) -> Lighting:
    """Computes the light of a weather.

    Args:
        weather: the weather.
        sky_face_px: side in pixels of each cube face of `Lighting.sky_faces`.
    """
    sky = Sky.of(weather)
    exposure, from_above = _exposure(sky)
    shown = exposure * _looks(sky)
    faces = [encode_srgb(shown * sky.radiance(face)) for face in _faces(sky_face_px)]
    return Lighting(
        towards_sun=sky.towards_sun,
        sun=exposure * sky.sun_klx,
        ambient=exposure * from_above / math.pi,
        sky_faces=np.concatenate(faces),
        street_faces=encode_srgb(BOUNCE_GAIN * exposure * _in_street(sky, face_directions(STREET_FACE_PX))).reshape(
            6 * STREET_FACE_PX, STREET_FACE_PX, 3
        ),
    )


def mirrored_radiance(weather: Weather, rows: int, columns: int) -> Floats:
    """The radiance that still water in a street reflects.

    Args:
        weather: sun and sky.
        rows: number of elevations, whose sines are evenly spaced from the horizon to the zenith.
        columns: number of azimuths, evenly spaced counter-clockwise from east.

    Returns:
        (rows, columns, 3) radiance in units of the frame, at most 1.
    """
    sky = Sky.of(weather)
    elevation, azimuth = np.meshgrid(
        np.arcsin(np.linspace(0, 1, rows)), np.arange(columns) / columns * 2 * math.pi, indexing="ij"
    )
    level = np.cos(elevation)
    directions = np.stack([np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)], axis=-1)
    return np.minimum(_exposure(sky)[0] * _looks(sky) * _in_street(sky, directions), 1.0)


def lamplit_houses(rows: int) -> Floats:
    """The radiance of houses in the light of lamps at night, which still water reflects: (rows, 1, 3), in units of
    the frame.

    Rows are elevations, whose sines are evenly spaced from the horizon to the zenith.

    Args:
        rows: number of elevations.
    """
    return np.asarray(_house_share(np.linspace(0, 1, rows))[:, None, None] * LAMPLIT_HOUSES)


def _in_street(sky: Sky, directions: Floats) -> Floats:
    """(..., 3) radiance in kcd/m² seen from a street: houses hide the lower sky and reflect part of the light of
    sun and sky.
    """
    radiance = sky.radiance(directions)
    _, from_above = _exposure(sky)
    sunlit = STREET_SUNLIT * sky.sun_klx * max(float(np.hypot(*sky.towards_sun[:2])), 0.3)
    houses = STREET_ALBEDO / math.pi * (sunlit + 0.5 * from_above)
    return np.asarray(radiance + _house_share(directions[..., 2])[..., None] * (houses - radiance))


def _house_share(height: Floats) -> Floats:
    """Share of the sky that houses hide, as a function of the sine of the elevation."""
    t = np.clip((height / STREET_TOP - 0.35) / 0.65, 0.0, 1.0)
    return np.where(height > -0.02, STREET_SHARE * (1 - t * t * (3 - 2 * t)), 0.0)


def ambient_radiance(weather: Weather) -> Floats:
    """The radiance of a white surface that gets all light except that of the sun: (3, 3), in units of the frame.

    The rows are for surfaces that face up, sideways (mean over all azimuths) and down; the columns are red, green and
    blue.

    Args:
        weather: the weather.
    """
    sky = Sky.of(weather)
    coarse, solid_angle = face_directions(_INTEGRATION_PX), _solid_angles(_INTEGRATION_PX)
    light = np.minimum(BOUNCE_GAIN * _exposure(sky)[0] * _in_street(sky, coarse), 1.0)
    sides = [np.array([math.cos(angle), math.sin(angle), 0.0]) for angle in np.arange(8) * math.pi / 4]
    up, down = (_irradiance(light, coarse, solid_angle, np.array([0.0, 0.0, z])) for z in (1.0, -1.0))
    aside = np.mean([_irradiance(light, coarse, solid_angle, side) for side in sides], axis=0)
    return np.stack([up, aside, down]) / math.pi


def airlight(weather: Weather) -> Floats:
    """The radiance of distant air by azimuth, counter-clockwise from east: (`HORIZON_AZIMUTHS`, 3), in units of
    the frame.

    After sunset the sun no longer reaches the air in a street. The air then has the colour of the light from the whole
    sky, so the glow in the west does not colour a fog.

    Args:
        weather: the weather.
    """
    sky = Sky.of(weather)
    exposure, roof_klx = _exposure(sky)
    ring = exposure * _looks(sky) * sky.horizon_radiance(HORIZON_AZIMUTHS)
    if sky.night:
        grey = ring.mean(axis=1, keepdims=True) * roof_klx / roof_klx.mean()
        ring += min(2 * sky.night, 1.0) * (grey - ring)
    return np.minimum(ring, 1.0)


def _looks(sky: Sky) -> float:
    """Factor between the radiance of the sky as a camera sees it and the radiance by which it lights surfaces."""
    return float(NIGHT_SKY_SHARE**sky.night)


@lru_cache(maxsize=8)
def _exposure(sky: Sky) -> tuple[float, Floats]:
    """The exposure in units of the frame per kcd/m², and the (3,) illuminance in klx of a roof by the sky, read-only.

    All lights of a weather need it, so it is remembered for the `Sky` objects that `Sky.of` remembers.
    """
    coarse = face_directions(_INTEGRATION_PX)
    radiance, solid_angle = sky.radiance(coarse, with_disc=False), _solid_angles(_INTEGRATION_PX)
    flat_sun = np.array([*sky.towards_sun[:2], 0.0])
    walls = [sky.towards_sun, np.array([0.0, 0.0, 1.0]), flat_sun / np.linalg.norm(flat_sun)]
    from_sky = [_irradiance(radiance, coarse, solid_angle, normal) for normal in walls]
    brightest = max(
        float((klx + sky.sun_klx * max(float(normal @ sky.towards_sun), 0.0)).max())
        for klx, normal in zip(from_sky, walls, strict=True)
    )
    bright_sky = float(np.quantile(radiance[coarse[..., 2] > 0].max(axis=-1), 0.9))
    return min(WHITE_LEVEL / (WHITE_ALBEDO / math.pi * brightest), SKY_LEVEL / bright_sky), frozen(from_sky[1])


def face_directions(size: int) -> Floats:
    """The directions of the texels of MuJoCo's skybox: (6, size, size, 3) world unit vectors, with faces in
    `FACE_ORDER`.

    The cube is that of OpenGL, rotated so that its y axis points up in the world: the face `right` is east, `back` is
    north.

    Args:
        size: side of each face in texels.
    """
    return np.stack(list(_faces(size)))


def _faces(size: int) -> Iterator[Floats]:
    """The faces of `face_directions`, one at a time, which needs a sixth of the memory."""
    ticks = (np.arange(size) + 0.5) / size * 2 - 1
    column, row = np.meshgrid(ticks, ticks)
    one = np.ones_like(column)
    world = [
        (one, column, -row),
        (-one, -column, -row),
        (column, -row, one),
        (column, row, -one),
        (column, -one, -row),
        (-column, one, -row),
    ]
    for axes in world:
        directions = np.stack(axes, axis=-1)
        yield np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True))


def _solid_angles(size: int) -> Floats:
    """(1, size, size) solid angles in steradians of the texels of a face."""
    ticks = (np.arange(size) + 0.5) / size * 2 - 1
    column, row = np.meshgrid(ticks, ticks)
    return np.asarray((2 / size) ** 2 / (1 + column**2 + row**2) ** 1.5)[None]


def _irradiance(radiance: Floats, directions: Floats, solid_angle: Floats, normal: Floats) -> Floats:
    """(3,) irradiance of a surface with a given normal."""
    weight = np.maximum(directions @ normal, 0.0) * solid_angle
    return np.asarray(np.tensordot(weight, radiance, axes=3))


def encode_srgb(light: Floats) -> UInt8Image:
    """Converts linear light, in which 1.0 is full scale, to sRGB bytes 0..255, elementwise.

    Args:
        light: values of any shape; values outside 0..1 are clipped.
    """
    steps = (np.clip(light, 0.0, 1.0) * (len(_SRGB_BYTES) - 1) + 0.5).astype(np.uint16)
    return _SRGB_BYTES[steps]


def _srgb_bytes() -> UInt8Image:
    linear = np.linspace(0, 1, 1 << 16)
    encoded = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return np.asarray(np.floor(encoded * 255 + 0.5), dtype=np.uint8)


_SRGB_BYTES = _srgb_bytes()
"""(65536,) sRGB bytes for evenly spaced linear light from 0 to 1."""
