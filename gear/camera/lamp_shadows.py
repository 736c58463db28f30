"""What throws shadows in the light of lamps: what stands in a town, and the road users of a scene.

What stands stops the light of lamps that stand, too, where it first meets it; maps of that are made once. Road users
stop the light of all lamps. The ground stops none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gear.camera.beams import Lamps
from gear.camera.shadow_map import Floats, Layout, Outlook, ShadowMap, first_met, lengths, stop_behind
from gear.camera.spread import longest_edges, points_on
from gear.values.frames import FloatImage, Shape
from gear.values.scene import ActorRecord, SceneRecord

LEAST_LIGHT = 0.002
"""Light fainter than this is not looked after: a fifteenth of what the night leaves on the ground."""

SHADOWED_WITHIN_M = 100.0
"""Lamps farther from the camera throw no shadows."""

WORTH = 0.85
"""Share of a lamp's reach in which road users throw shadows; farther out little is left of its light."""

STANDING = Layout(cells=384, zoom=1.0)
DRIVING = Layout(cells=512, zoom=2.2)
"""Headlamps throw shadows within 49 degrees of where they point; farther aside they only stray."""

_SPACING_M = {"large": 0.07, "small": 0.035}
_LARGE_M = 2.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Casters:
    """What stands in a town, without the ground.

    Attributes:
        corners_m: (N, 3, 3) float32 triangles in the world.
        middle_m: (N, 3) float32, their middles.
        radius_m: (N,) float32, of balls about these that hold them.
    """

    corners_m: Floats
    middle_m: Floats
    radius_m: Floats

    @staticmethod
    def of(corners_m: Floats) -> Casters:
        """Triangles, looked over once."""
        middle_m = corners_m.mean(axis=1)
        radius_m = np.sqrt(np.square(corners_m - middle_m[:, None]).sum(axis=2).max(axis=1, initial=0))
        return Casters(corners_m=corners_m, middle_m=middle_m, radius_m=radius_m)

    def near(self, place_m: Floats, reach_m: float) -> Floats:
        """(M, 3, 3) of which something is within reach of a place."""
        away_m = lengths(self.middle_m.T - place_m[:, None])
        return self.corners_m[away_m < self.radius_m + np.float32(reach_m)]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class User:
    """A road user as what stops light.

    Attributes:
        points_m: (N, 3) float32 on it, in the world.
        spacing_m: how far apart they are.
        middle_m, radius_m: of a ball that holds them.
    """

    points_m: Floats
    spacing_m: float
    middle_m: Floats
    radius_m: float

    def is_before(self, outlook: Outlook, reach_m: float) -> bool:
        """Whether some of it may be in a lamp's map, near enough to matter."""
        away = self.middle_m - outlook.place_m
        away_m = float(np.linalg.norm(away))
        if away_m >= WORTH * reach_m + self.radius_m:
            return False
        if away_m <= self.radius_m:
            return True
        aside_rad = math.acos(min(max(float(away @ outlook.frame[2]) / away_m, -1.0), 1.0))
        return aside_rad < outlook.layout.half_angle_rad + math.asin(self.radius_m / away_m)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampShadows:
    """All that throws shadows in a town at night.

    Attributes:
        casters: what stands.
        shapes: of every asset that may take part, by name.
    """

    casters: Casters
    shapes: Mapping[str, Shape]
    _fixed: dict[tuple[str, int], Floats] = field(default_factory=dict, init=False, repr=False)
    _known: dict[str, Floats] = field(default_factory=dict, init=False, repr=False)

    def users(self, record: SceneRecord) -> list[User]:
        """Those of a scene."""
        return [self._user(actor, self.shapes[actor.asset]) for actor in record.actors if actor.asset in self.shapes]

    def _user(self, actor: ActorRecord, shape: Shape) -> User:
        spacing_m = _SPACING_M["large" if shape.box_size_m[:2].max() > _LARGE_M else "small"]
        if actor.asset not in self._known:
            self._known[actor.asset] = _thinned(shape, spacing_m)
        pose = actor.world_from_actor.transform("world", "actor")
        points_m = self._known[actor.asset] @ pose.rotation.T.astype(np.float32)
        points_m += pose.translation_m.astype(np.float32)
        middle_m = (points_m.min(axis=0) + points_m.max(axis=0)) / 2
        radius_m = float(lengths((points_m - middle_m).T).max())
        return User(points_m=points_m, spacing_m=spacing_m, middle_m=middle_m, radius_m=radius_m)

    def standing(self, kind: str, index: int, outlook: Outlook, reach_m: float) -> Floats:
        """(cells, cells) how far the light of a lamp that stands comes among what stands."""
        if (kind, index) not in self._fixed:
            self._fixed[kind, index] = first_met(self.casters.near(outlook.place_m, reach_m), outlook)
        return self._fixed[kind, index]


@dataclass(slots=True, eq=False, kw_only=True)
class LampShadow:
    """What is in the way of one lamp in one scene. Its map is made when the first place in its light is seen.

    Attributes:
        town: what stands.
        users: of the scene.
        kind, index: which lamp it is.
        lamps: of its kind.
        stands: whether it stands in the town.
    """

    town: LampShadows
    users: list[User]
    kind: str
    index: int
    lamps: Lamps
    stands: bool
    _map: ShadowMap | None = field(default=None, init=False)

    def lay(
        self,
        light: FloatImage,
        towards: tuple[FloatImage, FloatImage, FloatImage],
        away_m: FloatImage,
        facing: FloatImage,
        up: FloatImage,
    ) -> None:
        """Takes from the lamp's light what does not come through, in place.

        Args:
            light: (h, W) of the lamp, without shadows.
            towards: (h, W) each, east, north and up parts of the unit vectors from the lamp to places.
            away_m: (h, W) how far they are from it.
            facing: (h, W) cosines between their surfaces' normals and the way back to the lamp.
            up: (h, W) upward parts of the normals.
        """
        shown = light.reshape(-1)
        where = np.flatnonzero(shown > LEAST_LIGHT)
        if not len(where):
            return
        if self._map is None:
            self._map = self._made()
        unit = np.stack([part.reshape(-1)[where] for part in towards])
        shown[where] *= self._map.through(unit, *(part.reshape(-1)[where] for part in (away_m, facing, up)))

    def _made(self) -> ShadowMap:
        place_m, axis, reach_m = self.lamps.position_m[self.index], self.lamps.axis[self.index], self.lamps.reach_m
        outlook = Outlook.of(place_m, axis, STANDING if self.stands else DRIVING)
        if self.stands:
            comes_m = self.town.standing(self.kind, self.index, outlook, reach_m).copy()
        else:
            comes_m = outlook.layout.empty()
        for user in self.users:
            if user.is_before(outlook, reach_m):
                stop_behind(comes_m, user.points_m, user.spacing_m, outlook)
        return ShadowMap(outlook=outlook, comes_m=comes_m)


def _thinned(shape: Shape, spacing_m: float) -> Floats:
    """(N, 3) points on all triangles, of those that lie together one."""
    corners = shape.vertices_m[shape.faces].astype(np.float32)
    steps = np.maximum(np.ceil(longest_edges(corners) / spacing_m), 1).astype(np.int64)
    points_m = np.concatenate(list(points_on(corners, steps)))
    cells = np.rint((points_m - points_m.min(axis=0)) / spacing_m).astype(np.int64)
    _, first = np.unique(cells @ (1 << np.array([42, 21, 0])), return_index=True)
    return np.ascontiguousarray(points_m[first])
