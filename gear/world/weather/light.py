"""What a weather's sun and sky are worth in the renderers' units, at an exposure fixed per weather.

The exposure puts a white wall (albedo 0.7) that faces the brightest direction at `WHITE_LEVEL` of the frame's full
scale.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image
from gear.values.scene import Weather
from gear.world.weather.sky import Sky

Floats = npt.NDArray[np.float64]

WHITE_ALBEDO = 0.7
WHITE_LEVEL = 0.85
SKY_LEVEL = 0.9

SKY_FACE_PX = 512
STREET_FACE_PX = 128
STREET_ALBEDO = np.array([0.30, 0.27, 0.23])
STREET_TOP = 0.72
"""Sine of the height to which houses stand about a street."""

STREET_SHARE = 0.65
"""How much of the sky below that height they hide."""

STREET_SUNLIT = 0.45
"""Share of what a street shows that the sun reaches."""

BOUNCE_GAIN = 1.25
"""Light that streets and houses throw back and forth, which no renderer of ours follows."""

NIGHT_SKY_SHARE = 0.2
"""How bright the night's sky looks beside the light that streets have then: that is mostly a town's own."""

LAMPLIT_HOUSES = np.array([0.10, 0.075, 0.05])
"""What the fronts of a street show in the light of its lamps, in shares of the frame's full scale."""

FACE_ORDER = "RLUDFB"
_INTEGRATION_PX = 16


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lighting:
    """Sun and sky in units of the frame: radiance 1.0 is full scale.

    Attributes:
        towards_sun: (3,) unit vector.
        sun: (3,) what a surface of albedo pi that faces the sun would radiate.
        ambient: (3,) radiance of the sky, averaged over what a roof sees.
        sky_faces: (6 * size, size, 3) uint8 sRGB, a strip of the faces in `FACE_ORDER`.
        street_faces: as `sky_faces`, smaller: the light that falls into a street, from the sky and from its houses.
    """

    towards_sun: Floats
    sun: Floats
    ambient: Floats
    sky_faces: UInt8Image
    street_faces: UInt8Image


HORIZON_AZIMUTHS = 64
"""Directions for which the light of distant air is known."""


def lighting_of(weather: Weather, *, sky_face_px: int = SKY_FACE_PX) -> Lighting:
    """Light of a weather."""
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
    """(rows, columns, 3) what still water in a street mirrors, in units of the frame.

    Rows stand at evenly spaced sines of height, from level to overhead; column 0 is east, counter-clockwise.
    """
    sky = Sky.of(weather)
    elevation, azimuth = np.meshgrid(
        np.arcsin(np.linspace(0, 1, rows)), np.arange(columns) / columns * 2 * math.pi, indexing="ij"
    )
    level = np.cos(elevation)
    directions = np.stack([np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(elevation)], axis=-1)
    return np.minimum(_exposure(sky)[0] * _looks(sky) * _in_street(sky, directions), 1.0)


def lamplit_houses(rows: int) -> Floats:
    """(rows, 1, 3) what still water mirrors at night of houses in lamplight; rows as `mirrored_radiance`'s."""
    return np.asarray(_house_share(np.linspace(0, 1, rows))[:, None, None] * LAMPLIT_HOUSES)


def _in_street(sky: Sky, directions: Floats) -> Floats:
    """(..., 3) kcd/m² between houses: they hide the lower sky and throw back their share of sun and sky."""
    radiance = sky.radiance(directions)
    _, from_above = _exposure(sky)
    sunlit = STREET_SUNLIT * sky.sun_klx * max(float(np.hypot(*sky.towards_sun[:2])), 0.3)
    houses = STREET_ALBEDO / math.pi * (sunlit + 0.5 * from_above)
    return np.asarray(radiance + _house_share(directions[..., 2])[..., None] * (houses - radiance))


def _house_share(height: Floats) -> Floats:
    """Share of a direction, by the sine of its height, that houses hide."""
    t = np.clip((height / STREET_TOP - 0.35) / 0.65, 0.0, 1.0)
    return np.where(height > -0.02, STREET_SHARE * (1 - t * t * (3 - 2 * t)), 0.0)


def ambient_radiance(weather: Weather) -> Floats:
    """(3, 3) what a white surface shows that faces up, sideways on average, and down, by channel, without the sun."""
    sky = Sky.of(weather)
    coarse, solid_angle = face_directions(_INTEGRATION_PX), _solid_angles(_INTEGRATION_PX)
    light = np.minimum(BOUNCE_GAIN * _exposure(sky)[0] * _in_street(sky, coarse), 1.0)
    sides = [np.array([math.cos(angle), math.sin(angle), 0.0]) for angle in np.arange(8) * math.pi / 4]
    up, down = (_irradiance(light, coarse, solid_angle, np.array([0.0, 0.0, z])) for z in (1.0, -1.0))
    aside = np.mean([_irradiance(light, coarse, solid_angle, side) for side in sides], axis=0)
    return np.stack([up, aside, down]) / math.pi


def airlight(weather: Weather) -> Floats:
    """(`HORIZON_AZIMUTHS`, 3) light of distant air by azimuth, counter-clockwise from east, in units of the frame.

    Once the sun is down it no longer reaches the air of the street, which has the colour of the light from the whole
    sky: the glow low in the west does not dye a fog.
    """
    sky = Sky.of(weather)
    exposure, roof_klx = _exposure(sky)
    ring = exposure * _looks(sky) * sky.horizon_radiance(HORIZON_AZIMUTHS)
    if sky.night:
        grey = ring.mean(axis=1, keepdims=True) * roof_klx / roof_klx.mean()
        ring += min(2 * sky.night, 1.0) * (grey - ring)
    return np.minimum(ring, 1.0)


def _looks(sky: Sky) -> float:
    """How bright the sky looks for the light that it stands for."""
    return float(NIGHT_SKY_SHARE**sky.night)


def _exposure(sky: Sky) -> tuple[float, Floats]:
    """The frame's share by kcd/m², and (3,) klx that a roof gets from the sky."""
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
    return min(WHITE_LEVEL / (WHITE_ALBEDO / math.pi * brightest), SKY_LEVEL / bright_sky), from_sky[1]


def face_directions(size: int) -> Floats:
    """(6, size, size, 3) unit vectors into the world through the texels of MuJoCo's skybox, faces in `FACE_ORDER`.

    The cube is OpenGL's, turned so that its y points up in the world: the picture `right` is east, `back` is north.
    """
    return np.stack(list(_faces(size)))


def _faces(size: int) -> Iterator[Floats]:
    """`face_directions`, one by one: all of them and what is worked out from them would be memory anew at each step."""
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
    """(1, size, size) steradians of a face's texels."""
    ticks = (np.arange(size) + 0.5) / size * 2 - 1
    column, row = np.meshgrid(ticks, ticks)
    return np.asarray((2 / size) ** 2 / (1 + column**2 + row**2) ** 1.5)[None]


def _irradiance(radiance: Floats, directions: Floats, solid_angle: Floats, normal: Floats) -> Floats:
    """(3,) of a surface with that normal."""
    weight = np.maximum(directions @ normal, 0.0) * solid_angle
    return np.asarray(np.tensordot(weight, radiance, axes=3))


def encode_srgb(light: Floats) -> UInt8Image:
    """Linear light, 1.0 is full scale, to sRGB bytes."""
    steps = (np.clip(light, 0.0, 1.0) * (len(_SRGB_BYTES) - 1) + 0.5).astype(np.uint16)
    return _SRGB_BYTES[steps]


def _srgb_bytes() -> UInt8Image:
    linear = np.linspace(0, 1, 1 << 16)
    encoded = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return np.asarray(np.floor(encoded * 255 + 0.5), dtype=np.uint8)


_SRGB_BYTES = _srgb_bytes()
"""(65536,) sRGB bytes of evenly spaced light."""
