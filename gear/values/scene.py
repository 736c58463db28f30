"""Scenes as data: a `SceneRecord` describes one sample completely, and is stored with the sample.

A record is a pure function of (config, seed, index). No part of it depends on the patch.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gear.values.errors import FieldError
from gear.values.geometry import Intrinsics, RigidTransform

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Role = Literal["ego", "npc", "parked", "carrier", "pedestrian"]

POSE_DIGITS = 6
"""Number of decimals to which positions in metres are rounded. Quaternions have nine. Rounded records are equal
across machines.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """The pose of a frame `src` in a frame `dst`; the field that holds it is named `dst_from_src`.

    Attributes:
        position_m: origin of `src` in `dst`, metres.
        quat_wxyz: unit quaternion of the rotation.
    """

    position_m: Vec3
    quat_wxyz: Quat = (1.0, 0.0, 0.0, 0.0)

    @staticmethod
    def from_transform(transform: RigidTransform) -> Pose:
        """The pose that equals a transform, rounded to the precision of records.

        Args:
            transform: the transform; its frame names are not stored.
        """
        position = tuple(round(float(v), POSE_DIGITS) + 0.0 for v in transform.translation_m)
        quat = tuple(round(float(v), 9) + 0.0 for v in _quat_from_rotation(transform.rotation))
        return Pose(position_m=(position[0], position[1], position[2]), quat_wxyz=(quat[0], quat[1], quat[2], quat[3]))

    def transform(self, dst: str, src: str) -> RigidTransform:
        """The pose as a rigid transform `dst_from_src`, with the given frame names.

        Args:
            dst: name of the target frame.
            src: name of the source frame.
        """
        w, x, y, z = np.asarray(self.quat_wxyz) / np.linalg.norm(self.quat_wxyz)
        rotation = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return RigidTransform.from_parts(dst, src, rotation, self.position_m)


def _quat_from_rotation(rotation: np.ndarray) -> np.ndarray:
    """(3, 3) to wxyz with w >= 0, by the numerically largest component."""
    m = rotation
    squares = np.array(
        [1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], 1 - m[0, 0] + m[1, 1] - m[2, 2],
         1 - m[0, 0] - m[1, 1] + m[2, 2]]
    )  # fmt: skip
    k = int(np.argmax(squares))
    s = 2 * np.sqrt(squares[k])
    if k == 0:
        q = np.array([s / 4, (m[2, 1] - m[1, 2]) / s, (m[0, 2] - m[2, 0]) / s, (m[1, 0] - m[0, 1]) / s])
    elif k == 1:
        q = np.array([(m[2, 1] - m[1, 2]) / s, s / 4, (m[0, 1] + m[1, 0]) / s, (m[0, 2] + m[2, 0]) / s])
    elif k == 2:
        q = np.array([(m[0, 2] - m[2, 0]) / s, (m[0, 1] + m[1, 0]) / s, s / 4, (m[1, 2] + m[2, 1]) / s])
    else:
        q = np.array([(m[1, 0] - m[0, 1]) / s, (m[0, 2] + m[2, 0]) / s, (m[1, 2] + m[2, 1]) / s, s / 4])
    return -q if q[0] < 0 else q


NIGHT_DEG = 10.0
"""Depth of the sun below the horizon, in degrees, from which on the sky has no sunlight."""

RAIN_COVER, RAIN_COVER_GROWTH = 0.82, 0.18
"""Share of the sky under clouds in the lightest rain, and the amount by which the share is larger in the heaviest
rain.
"""

RAIN_EXPOSURE_COVER = 0.8
"""Smallest share of the sky under clouds, 0..1, for which the camera's exposure is set in any rain."""


MOST = 1_000_000
"""Upper limit of weather parameters that are not percentages. CARLA has no limit, but 32-bit numbers in pictures
have.
"""


def _bounded(default: float, low: int, high: int, unit: str = "") -> Any:
    """A number of `Weather` with its default, its range and its unit."""
    return dataclasses.field(default=default, metadata={"low": low, "high": high, "unit": unit})


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """CARLA's weather parameters with CARLA's meaning and units.

    This is the only list of them: `gear.config.collection.WeatherConfig`, which configs are read into, is derived from
    it. A new parameter is a new field with its range, and a line below.

    Attributes:
        name: name of the preset, followed by `*` if parameters were changed.
        cloudiness: share of the sky under clouds, percent, 0 to 100.
        precipitation: strength of the rain, percent, 0 to 100.
        precipitation_deposits: puddles on open ground, percent, 0 to 100.
        wind_intensity: strength of the wind that drives the rain, percent, 0 to 100.
        sun_azimuth_deg: direction of the sun, counter-clockwise from east in gear's world, -360 to 360 degrees.
        sun_altitude_deg: height of the sun above the horizon, -90 to 90 degrees; 90 is the zenith.
        fog_density: thickness of the fog, percent, 0 to 100.
        fog_distance_m: distance from the camera at which the fog begins, metres, 0 to 1000000.
        fog_falloff: rate at which fog thins with height, 0 to 1000000; 0 is no thinning.
        wetness: wetness of open ground, percent, 0 to 100.
        scattering_intensity: strength of all light scattering in the air, 0 to 1000000.
        mie_scattering_scale: strength of scattering by dust and vapour, 0 to 1000000.
        rayleigh_scattering_scale: strength of scattering by molecules, 0 to 1000000.
    """

    name: str
    cloudiness: float = _bounded(0.0, 0, 100, "percent")
    precipitation: float = _bounded(0.0, 0, 100, "percent")
    precipitation_deposits: float = _bounded(0.0, 0, 100, "percent")
    wind_intensity: float = _bounded(0.0, 0, 100, "percent")
    sun_azimuth_deg: float = _bounded(225.0, -360, 360, "degrees")
    sun_altitude_deg: float = _bounded(45.0, -90, 90, "degrees")
    fog_density: float = _bounded(0.0, 0, 100, "percent")
    fog_distance_m: float = _bounded(0.75, 0, MOST)
    fog_falloff: float = _bounded(0.1, 0, MOST)
    wetness: float = _bounded(0.0, 0, 100, "percent")
    scattering_intensity: float = _bounded(1.0, 0, MOST)
    mie_scattering_scale: float = _bounded(0.03, 0, MOST)
    rayleigh_scattering_scale: float = _bounded(0.0331, 0, MOST)

    def __post_init__(self) -> None:
        for name in WEATHER_PARAMETERS:
            check_weather(name, getattr(self, name))

    @property
    def night(self) -> float:
        """Darkness of the sky, 0..1: 0 while the sun is above the horizon, 1 from 10 degrees below the horizon."""
        depth = min(max(-self.sun_altitude_deg / NIGHT_DEG, 0.0), 1.0)
        return depth * depth * (3 - 2 * depth)

    @property
    def cloud_cover(self) -> float:
        """Share of the sky under clouds, 0..1. In rain the share is at least that of the lightest rain, even if
        `cloudiness` is 0.
        """
        if self.precipitation <= 0:
            return self.cloudiness / 100
        return max(self.cloudiness / 100, RAIN_COVER + RAIN_COVER_GROWTH * (self.precipitation / 100))

    @property
    def exposure_cover(self) -> float:
        """Share of the sky under clouds, 0..1, for which the camera's exposure is set; at least
        `RAIN_EXPOSURE_COVER` in any rain.
        """
        return max(self.cloudiness, 100 * RAIN_EXPOSURE_COVER if self.precipitation > 0 else 0.0) / 100


WEATHER_PARAMETERS: dict[str, dataclasses.Field[Any]] = {
    field.name: field for field in dataclasses.fields(Weather) if field.metadata
}
"""The numeric parameters of a weather by name, as dataclass fields with default and range."""


def check_weather(name: str, value: float) -> None:
    """Checks that a weather parameter lies in its range.

    Args:
        name: name of the parameter, as in `Weather`.
        value: its value.

    Raises:
        FieldError: the value is out of range; the error names the parameter, its range and the value.
    """
    low, high, unit = (WEATHER_PARAMETERS[name].metadata[key] for key in ("low", "high", "unit"))
    if not low <= value <= high:
        wanted = (
            f"is a percentage, {low} to {high}" if unit == "percent" else f"must be {low} to {high} {unit}".rstrip()
        )
        raise FieldError(name, f"{wanted}, got {value:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorRecord:
    """One vehicle or pedestrian of a scene.

    Attributes:
        id: id of the actor, at least 1, the same in all frames of a sequence.
        asset: name of the actor's MJCF.
        role: `ego` carries the cameras, `carrier` carries a surface; `npc` drives, `parked` stands, `pedestrian` walks.
        world_from_actor: pose; the actor's frame is x forward, y left, z up, with the origin on the ground in the
            middle of the footprint.
        velocity_world_mps: linear velocity in the world, m/s.
        paint_rgb: linear albedo, 0..1, of the actor's `.paint` geoms; None for the asset's colours.
    """

    id: int
    asset: str
    role: Role
    world_from_actor: Pose
    velocity_world_mps: Vec3 = (0.0, 0.0, 0.0)
    paint_rgb: Vec3 | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceRecord:
    """One surface of a scene: a rectangle on a board or a vehicle that shows a patch.

    Attributes:
        name: `surface_0`, `surface_1`, …; the surface shows `patch_0`, `patch_1`, ….
        asset: name of the MJCF of its board, or of its actor.
        actor_id: the actor whose body is its parent, or None for the world.
        parent_from_surface: pose; the surface's frame is x right, y down for a viewer in front, z into the board,
            origin in the middle of the face.
        width_m, height_m: size of the face.
    """

    name: str
    asset: str
    actor_id: int | None
    parent_from_surface: Pose
    width_m: float
    height_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LensRecord:
    """Radial distortion of one camera's lens. Together with the camera's size and pinhole it determines how pixels
    move.

    Attributes:
        k1, k2: a point at (x, y) in the pinhole's picture, in focal lengths, appears at (x, y) (1 + k1 r² + k2 r⁴).
        focal_px: horizontal focal length of the distorted picture; longer than the pinhole's where the corners would
            otherwise be empty.
    """

    k1: float
    k2: float
    focal_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraRecord:
    """One camera of one sample: a pinhole without skew, optionally with a lens.

    Attributes:
        name: key of the camera's view: `left`, `right`, ….
        width_px, height_px: size of the picture.
        focal_px: horizontal focal length fx of the pinhole.
        world_from_camera: pose; camera axes are x right, y down, z forward.
        lens: distortion of colour, depth and ids; None for none. Projections with `intrinsics` are the pinhole's.
        focal_y_px: vertical focal length fy; None for the same as `focal_px`.
        principal_px: principal point (cx, cy) in index pixels; None for the middle of the picture.
    """

    name: str
    width_px: int
    height_px: int
    focal_px: float
    world_from_camera: Pose
    lens: LensRecord | None = None
    focal_y_px: float | None = None
    principal_px: tuple[float, float] | None = None

    @property
    def intrinsics(self) -> Intrinsics:
        """The intrinsics of the camera's pinhole, in index pixels; the lens is not included."""
        return Intrinsics(self.width_px, self.height_px, self.focal_px, self.focal_y_px, self.principal_px)

    @property
    def world_from_camera_transform(self) -> RigidTransform:
        """The camera's pose as a rigid transform from the camera's frame to the world."""
        return self.world_from_camera.transform("world", "camera")


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneRecord:
    """The complete description of one sample, without its patch.

    Attributes:
        version: version of this data model.
        town, scene, split: names.
        seed, index: the draw; `index` counts all frames of a split.
        sequence, frame, time_s: the frame's number in its driving sequence, and its time in seconds; a sequence of
            single pictures has one frame.
        weather: parameters of light and air.
        actors: the ego car first; ids are unique.
        surfaces: rectangles that patches are shown on, in patch order.
        cameras: the rig's cameras with their poses in the world.
    """

    version: int = 1
    town: str
    scene: str
    split: str
    seed: int
    index: int
    sequence: int
    frame: int
    time_s: float
    weather: Weather
    actors: tuple[ActorRecord, ...]
    surfaces: tuple[SurfaceRecord, ...]
    cameras: tuple[CameraRecord, ...]

    @property
    def ego(self) -> ActorRecord:
        """The record of the ego car."""
        return next(actor for actor in self.actors if actor.role == "ego")

    def actor(self, actor_id: int) -> ActorRecord:
        """The record of the actor with the id `actor_id`.

        Args:
            actor_id: id of the actor.

        Raises:
            KeyError: no actor has this id.
        """
        for actor in self.actors:
            if actor.id == actor_id:
                return actor
        raise KeyError(actor_id)

    def camera(self, name: str) -> CameraRecord:
        """The record of the camera with the name `name`.

        Args:
            name: name of the camera, such as `left`.

        Raises:
            KeyError: no camera has this name.
        """
        for camera in self.cameras:
            if camera.name == name:
                return camera
        raise KeyError(name)

    def world_from_surface(self, surface: SurfaceRecord) -> RigidTransform:
        """The pose of a surface in the world, computed from its pose on its board or on its actor.

        Args:
            surface: one of `surfaces`.
        """
        if surface.actor_id is None:
            return surface.parent_from_surface.transform("world", surface.name)
        world_from_actor = self.actor(surface.actor_id).world_from_actor.transform("world", "actor")
        return world_from_actor @ surface.parent_from_surface.transform("actor", surface.name)
