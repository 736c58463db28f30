"""What throws shadows in the light of lamps: what stands in a town, and the road users of a scene.

What stands stops the light of lamps that stand, too, where it first meets it; maps of that are made once. Road users
stop the light of all lamps. The ground stops none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gear.camera.lamps import Lamps
from gear.camera.shadow_map import Floats, LampFrame, Layout, ShadowMap, first_hits, lengths, stop_behind
from gear.camera.surface_points import longest_edges, points_on
from gear.values.frames import FloatImage, Shape
from gear.values.scene import ActorRecord, SceneRecord

LEAST_LIGHT = 0.002
"""Light fainter than this is not looked after: a fifteenth of what the night leaves on the ground."""

SHADOWED_WITHIN_M = 100.0
"""Lamps farther from the camera throw no shadows."""

WORTH = 0.85
"""Share of a lamp's reach in which road users throw shadows; farther out little is left of its light."""

STANDING = Layout(cells=384, zoom=1.0)
DRIVING = Layout(cells=384, zoom=2.2)
"""Headlamps throw shadows within 49 degrees of where they point; farther aside they only stray."""

_PIECE_M = 24.0
_SPACING_M = {"large": 0.07, "small": 0.035}
_LARGE_M = 2.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Casters:
    """What stands in a town, without the ground, in pieces that lie together.

    Attributes:
        corners_m: (N, 3, 3) float32 triangles in the world.
        ends: (M,) where each piece ends among them.
        low_m, high_m: (M, 3) float32 corners of boxes that hold the pieces.
    """

    corners_m: Floats
    ends: npt.NDArray[np.int64]
    low_m: Floats
    high_m: Floats

    @staticmethod
    def of(corners_m: Floats) -> Casters:
        """Triangles, put in order once."""
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
        """(K, 3, 3) of which something may be within reach of a place."""
        away = np.maximum(np.maximum(self.low_m - place_m, place_m - self.high_m), 0)
        chosen = np.flatnonzero(lengths(away.T) < reach_m).tolist()
        starts = np.append(0, self.ends)
        parts = [self.corners_m[starts[piece] : self.ends[piece]] for piece in chosen]
        near = np.concatenate([np.zeros((0, 3, 3), np.float32), *parts])
        middle = near.mean(axis=1)
        return near[lengths((middle - place_m).T) < longest_edges(near) + np.float32(reach_m)]


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

    def is_before(self, outlook: LampFrame, reach_m: float) -> bool:
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
    _scenes: list[SceneShadows] = field(default_factory=list, init=False, repr=False)

    def scene(self, record: SceneRecord) -> SceneShadows:
        """With the road users of a scene. All views of one that come one after the other share what is made for it."""
        if not self._scenes or self._scenes[0].record is not record:
            users = [
                self._user(actor, self.shapes[actor.asset]) for actor in record.actors if actor.asset in self.shapes
            ]
            self._scenes[:] = [SceneShadows(town=self, record=record, users=users)]
        return self._scenes[0]

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

    def standing(self, kind: str, index: int, outlook: LampFrame, reach_m: float) -> Floats:
        """(cells, cells) how far the light of a lamp that stands comes among what stands."""
        if (kind, index) not in self._fixed:
            self._fixed[kind, index] = first_hits(self.casters.near(outlook.place_m, reach_m), outlook)
        return self._fixed[kind, index]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SceneShadows:
    """All that throws shadows in one scene.

    Attributes:
        town: what stands.
        record: the scene.
        users: its road users.
    """

    town: LampShadows
    record: SceneRecord
    users: list[User]
    _maps: dict[tuple[str, int], ShadowMap] = field(default_factory=dict, init=False, repr=False)

    def map(self, kind: str, index: int, lamps: Lamps, *, stands: bool) -> ShadowMap:
        """Of one lamp of a kind; before those that do not stand only road users throw shadows."""
        if (kind, index) not in self._maps:
            place_m, axis = lamps.position_m[index], lamps.axis[index]
            outlook = LampFrame.of(place_m, axis, STANDING if stands else DRIVING)
            if stands:
                comes_m = self.town.standing(kind, index, outlook, lamps.reach_m).copy()
            else:
                comes_m = outlook.layout.empty()
            for user in self.users:
                if user.is_before(outlook, lamps.reach_m):
                    stop_behind(comes_m, user.points_m, user.spacing_m, outlook)
            self._maps[kind, index] = ShadowMap(outlook=outlook, comes_m=comes_m)
        return self._maps[kind, index]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampShadow:
    """What is in the way of one lamp. Its map is made when the first place in its light is seen.

    Attributes:
        scene: what throws shadows.
        kind, index: which lamp it is.
        lamps: of its kind.
        stands: whether it stands in the town.
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
        found = self.scene.map(self.kind, self.index, self.lamps, stands=self.stands)
        unit = np.stack([part.reshape(-1)[where] for part in towards])
        shown[where] *= found.through(unit, *(part.reshape(-1)[where] for part in (away_m, facing, up)))


def _thinned(shape: Shape, spacing_m: float) -> Floats:
    """(N, 3) points on all triangles, of those that lie together one."""
    corners = shape.vertices_m[shape.faces].astype(np.float32)
    steps = np.maximum(np.ceil(longest_edges(corners) / spacing_m), 1).astype(np.int64)
    points_m = np.concatenate(list(points_on(corners, steps)))
    cells = np.rint((points_m - points_m.min(axis=0)) / spacing_m).astype(np.int64)
    _, first = np.unique(cells @ (1 << np.array([42, 21, 0])), return_index=True)
    return np.ascontiguousarray(points_m[first])
