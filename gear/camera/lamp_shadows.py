"""Shadows in the light of lamps at night.

Static objects of a town cast shadows in the light of static lamps, by shadow maps that are computed once. Road users of
a scene cast shadows in the light of all lamps. The ground casts no shadows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gear.camera.lamps import Lamps
from gear.camera.shadow_map import Floats, LampFrame, Layout, ShadowMap, add_occluder, first_hits, lengths
from gear.camera.surface_points import longest_edges, points_on
from gear.values.frames import FloatImage, Shape
from gear.values.scene import ActorRecord, SceneRecord

LEAST_LIGHT = 0.002
"""A lamp casts no shadows on surfaces to which it gives less light than this: a fifteenth of the night's light on the
ground.
"""

SHADOWED_WITHIN_M = 100.0
"""Lamps farther from the camera than this cast no shadows, metres."""

WORTH = 0.85
"""Share of a lamp's range within which road users cast shadows. Farther away, the lamp's light is too faint for visible
shadows.
"""

STANDING = Layout(cells=384, zoom=1.0)
DRIVING = Layout(cells=384, zoom=2.2)
"""Layouts (size and field of view) of the shadow maps of static lamps (`STANDING`) and of headlamps (`DRIVING`).
Headlamps cast shadows only within 49 degrees of their axis; beyond this angle there is only scattered light.
"""

_PIECE_M = 24.0
_SPACING_M = {"large": 0.07, "small": 0.035}
_LARGE_M = 2.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Casters:
    """The triangles that can cast shadows: those of a town's static objects without the ground.

    They are sorted by squares of the ground plan (24 m), so that triangles near a lamp are found fast.

    Attributes:
        corners_m: (N, 3, 3) float32 corners in world coordinates, square by square.
        ends: (M,) for each square, the index after its last triangle.
        low_m, high_m: (M, 3) float32 lower and upper corners of the bounding boxes of the squares' triangles.
    """

    corners_m: Floats
    ends: npt.NDArray[np.int64]
    low_m: Floats
    high_m: Floats

    @staticmethod
    def of(corners_m: Floats) -> Casters:
        """Sorts triangles by the square of the ground plan in which their first corner lies.

        Args:
            corners_m: (N, 3, 3) float32 corners in world coordinates.
        """
        cells = np.floor(corners_m[:, 0, :2] / np.float32(_PIECE_M)).astype(np.int64)
        keys = cells[:, 0] * (1 << 32) + cells[:, 1]
        order = np.argsort(keys, kind="stable")
        corners_m, keys = corners_m[order], keys[order]
        starts = np.flatnonzero(np.diff(keys, prepend=keys[:1] - 1))
        ends = np.append(starts[1:], len(keys)) if len(keys) else starts
        low_m, high_m = (
            each.reduceat(each.reduce(corners_m, axis=1), starts) if len(keys) else np.zeros((0, 3), np.float32)
            for each in (np.minimum, np.maximum)
        )
        return Casters(corners_m=corners_m, ends=ends, low_m=low_m, high_m=high_m)

    def near(self, place_m: Floats, reach_m: float) -> Floats:
        """Returns the (K, 3, 3) triangles that may reach into a sphere; some of them may lie outside it.

        Args:
            place_m: (3,) centre of the sphere, world coordinates.
            reach_m: radius of the sphere, metres.
        """
        away = np.maximum(np.maximum(self.low_m - place_m, place_m - self.high_m), 0)
        chosen = np.flatnonzero(lengths(away.T) < reach_m).tolist()
        starts = np.append(0, self.ends)
        parts = [self.corners_m[starts[piece] : self.ends[piece]] for piece in chosen]
        near = np.concatenate([np.zeros((0, 3, 3), np.float32), *parts])
        middle = near.mean(axis=1)
        return near[lengths((middle - place_m).T) < longest_edges(near) + np.float32(reach_m)]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RoadUserCaster:
    """A road user as a shadow caster: a set of surface points that block light.

    Attributes:
        points_m: (N, 3) float32 points on its surface, world coordinates.
        spacing_m: distance between neighbouring points.
        middle_m, radius_m: centre (3,) and radius of its bounding sphere.
    """

    points_m: Floats
    spacing_m: float
    middle_m: Floats
    radius_m: float

    def may_cast_shadow(self, lamp_frame: LampFrame, reach_m: float) -> bool:
        """Whether the road user may cast a shadow in the light of a lamp.

        It may if its bounding sphere is within the share `WORTH` of the lamp's range, and in the field of view of the
        lamp's shadow map.

        Args:
            lamp_frame: position and axes of the lamp.
            reach_m: range of the lamp in metres.
        """
        away = self.middle_m - lamp_frame.place_m
        distance_m = float(np.linalg.norm(away))
        if distance_m >= WORTH * reach_m + self.radius_m:
            return False
        if distance_m <= self.radius_m:
            return True
        aside_rad = math.acos(min(max(float(away @ lamp_frame.frame[2]) / distance_m, -1.0), 1.0))
        return aside_rad < lamp_frame.layout.half_angle_rad + math.asin(self.radius_m / distance_m)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampShadows:
    """Everything in a town that casts shadows at night.

    Attributes:
        casters: static objects.
        shapes: triangles of every asset that may take part in a scene, by name.
    """

    casters: Casters
    shapes: Mapping[str, Shape]
    _fixed: dict[tuple[str, int], Floats] = field(default_factory=dict, init=False, repr=False)
    _known: dict[str, Floats] = field(default_factory=dict, init=False, repr=False)
    _scenes: list[SceneShadows] = field(default_factory=list, init=False, repr=False)

    def scene(self, record: SceneRecord) -> SceneShadows:
        """Returns the shadow casters of one scene: those of the town and the scene's road users.

        The result of the last call is kept and returned for the same record, because a scene has several views.

        Args:
            record: the scene, for its actors.
        """
        if not self._scenes or self._scenes[0].record is not record:
            users = [
                self._user(actor, self.shapes[actor.asset]) for actor in record.actors if actor.asset in self.shapes
            ]
            self._scenes[:] = [SceneShadows(town=self, record=record, users=users)]
        return self._scenes[0]

    def _user(self, actor: ActorRecord, shape: Shape) -> RoadUserCaster:
        spacing_m = _SPACING_M["large" if shape.box_size_m[:2].max() > _LARGE_M else "small"]
        if actor.asset not in self._known:
            self._known[actor.asset] = _thinned(shape, spacing_m)
        pose = actor.world_from_actor.transform("world", "actor")
        points_m = self._known[actor.asset] @ pose.rotation.T.astype(np.float32)
        points_m += pose.translation_m.astype(np.float32)
        middle_m = (points_m.min(axis=0) + points_m.max(axis=0)) / 2
        radius_m = float(lengths((points_m - middle_m).T).max())
        return RoadUserCaster(points_m=points_m, spacing_m=spacing_m, middle_m=middle_m, radius_m=radius_m)

    def static_shadow_map(self, kind: str, index: int, lamp_frame: LampFrame, reach_m: float) -> Floats:
        """Returns the shadow map of a static lamp, with the shadows of static objects only; computed once per
        lamp.

        Args:
            kind: kind of the lamp.
            index: index of the lamp among the lamps of that kind.
            lamp_frame: position and axes of the lamp, and size of its shadow map.
            reach_m: range of the lamp in metres.

        Returns:
            (cells, cells) float32 distance in metres from the lamp at which the light is blocked, infinite where it is
            not.
        """
        if (kind, index) not in self._fixed:
            self._fixed[kind, index] = first_hits(self.casters.near(lamp_frame.place_m, reach_m), lamp_frame)
        return self._fixed[kind, index]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SceneShadows:
    """Everything in one scene that casts shadows at night.

    Attributes:
        town: the static objects.
        record: the scene.
        users: its road users.
    """

    town: LampShadows
    record: SceneRecord
    users: list[RoadUserCaster]
    _maps: dict[tuple[str, int], ShadowMap] = field(default_factory=dict, init=False, repr=False)

    def map(self, kind: str, index: int, lamps: Lamps, *, stands: bool) -> ShadowMap:
        """Returns the shadow map of one lamp; it is computed at the first call. In the light of a headlamp, only
        road users cast shadows.

        Args:
            kind: kind of the lamp: `street`, `globe` or `head`.
            index: its index among the lamps of that kind.
            lamps: all lamps of that kind.
            stands: whether the lamp is a static lamp of the town.
        """
        if (kind, index) not in self._maps:
            place_m, axis = lamps.position_m[index], lamps.axis[index]
            lamp_frame = LampFrame.of(place_m, axis, STANDING if stands else DRIVING)
            if stands:
                stop_m = self.town.static_shadow_map(kind, index, lamp_frame, lamps.reach_m).copy()
            else:
                stop_m = lamp_frame.layout.empty()
            for road_user in self.users:
                if road_user.may_cast_shadow(lamp_frame, lamps.reach_m):
                    add_occluder(stop_m, road_user.points_m, road_user.spacing_m, lamp_frame)
            self._maps[kind, index] = ShadowMap(lamp_frame=lamp_frame, stop_m=stop_m)
        return self._maps[kind, index]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampShadow:
    """The shadows in the light of one lamp. The shadow map is computed at the first use.

    Attributes:
        scene: shadow casters of the scene.
        kind, index: kind of the lamp (`street`, `globe` or `head`), and its index among the lamps of that kind.
        lamps: all lamps of that kind.
        stands: whether the lamp is a static lamp of the town.
    """

    scene: SceneShadows
    kind: str
    index: int
    lamps: Lamps
    stands: bool

    def attenuate(
        self,
        light: FloatImage,
        towards: tuple[FloatImage, FloatImage, FloatImage],
        distance_m: FloatImage,
        facing: FloatImage,
        up: FloatImage,
    ) -> None:
        """Multiplies a lamp's light on surfaces by the share, 0..1, that shadows leave; `light` is changed in place.

        Args:
            light: (h, W) light of the lamp without shadows.
            towards: unit vectors from the lamp to the surfaces, as three (h, W) arrays: east, north and up.
            distance_m: (h, W) distances of the surfaces from the lamp, metres.
            facing: (h, W) cosines between the surfaces' normals and the direction to the lamp.
            up: (h, W) upward components of the surfaces' normals.
        """
        shown = light.reshape(-1)
        where = np.flatnonzero(shown > LEAST_LIGHT)
        if not len(where):
            return
        found = self.scene.map(self.kind, self.index, self.lamps, stands=self.stands)
        unit = np.stack([part.reshape(-1)[where] for part in towards])
        shown[where] *= found.through(unit, *(part.reshape(-1)[where] for part in (distance_m, facing, up)))


def _thinned(shape: Shape, spacing_m: float) -> Floats:
    """(N, 3) points on all triangles, at most one in each cubic cell with sides of `spacing_m`."""
    corners = shape.vertices_m[shape.faces].astype(np.float32)
    steps = np.maximum(np.ceil(longest_edges(corners) / spacing_m), 1).astype(np.int64)
    points_m = np.concatenate(list(points_on(corners, steps)))
    cells = np.rint((points_m - points_m.min(axis=0)) / spacing_m).astype(np.int64)
    _, first = np.unique(cells @ (1 << np.array([42, 21, 0])), return_index=True)
    return np.ascontiguousarray(points_m[first])
