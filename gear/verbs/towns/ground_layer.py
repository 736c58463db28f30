"""The ground layer of a town map: ground surfaces, plants and buildings, seen from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import mujoco
import numpy as np

from gear.values.errors import TownError
from gear.values.geometry import Array
from gear.values.labels import LABEL_BY_NAME
from gear.verbs.towns.canvas import Canvas, Colour
from gear.world.assets.geom_classes import FIRST_HIDDEN_GROUP, GeomClasses, classify
from gear.world.assets.geom_triangles import geom_triangles
from gear.world.assets.mjspec import read_spec
from gear.world.compilation.model_compilation import GROUND_PREFIX
from gear.world.compilation.mujoco_errors import without_breaks

Bounds = tuple[float, float, float, float]
"""Bounds of a town in metres: (xmin, ymin, xmax, ymax)."""

COVERS: tuple[tuple[str, tuple[str, ...], Colour], ...] = (
    ("terrain", ("terrain",), (219, 229, 205)),
    ("paved ground", ("ground",), (233, 227, 214)),
    ("road", ("road", "bridge"), (200, 202, 206)),
    ("parking", ("parking",), (186, 192, 204)),
    ("sidewalk", ("sidewalk",), (240, 234, 226)),
    ("road marking", ("road_marking",), (250, 250, 250)),
)
"""(name in the legend, class labels, colour) of each kind of ground; later kinds are drawn over earlier kinds."""

VEGETATION: Colour = (122, 164, 104)
BUILDING: Colour = (176, 160, 148)
BUILDING_EDGE: Colour = (120, 104, 94)
FENCE: Colour = (132, 122, 114)
SHADOW: Colour = (70, 66, 74)

LEAST_BUILDING_M = 2.5
"""Smallest height, length and width in metres of an obstacle that is drawn as a building."""

LEAST_FENCE_M = 3.0
"""Smallest length in metres of an obstacle that is drawn as a fence and is no building."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TownGeometry:
    """The geometry of a town, compiled from its MJCF file without vehicles, people or boards.

    Attributes:
        path: the town's MJCF file.
        model: the compiled MuJoCo model.
        data: MuJoCo data of the model after forward kinematics.
        classes: class labels of the visible geoms.
    """

    path: Path
    model: mujoco.MjModel
    data: mujoco.MjData
    classes: GeomClasses

    @staticmethod
    def of(path: Path) -> TownGeometry:
        """Compiles the MJCF file of a town.

        Args:
            path: the MJCF file.

        Raises:
            TownError: MuJoCo cannot compile the file, or a visible geom has no label.
        """
        try:
            spec = read_spec(path)
            model = spec.compile()
        except ValueError as error:
            raise TownError(path, f"MuJoCo cannot compile it: {without_breaks(error)}") from error
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        return TownGeometry(path=path, model=model, data=data, classes=classify(spec, path))

    def corners_m(self, geom: int) -> Array:
        """Returns the (N, 3, 3) corners of a geom's N triangles in the world, in metres.

        An infinite plane is cut 10 km from its centre.

        Args:
            geom: id of the geom in the compiled model.

        Raises:
            TownError: the geom has no triangles, such as a height field.
        """
        if self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            half = np.where(self.model.geom_size[geom, :2] > 0, self.model.geom_size[geom, :2], 1e4)
            square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*half, 0.0]
            local = square[[[0, 1, 2], [0, 2, 3]]]
        else:
            try:
                vertices, faces = geom_triangles(self.model, geom)
            except ValueError as error:
                raise TownError(self.path, f"{error}; make it of meshes or primitives") from error
            local = vertices[faces]
        return np.asarray(local @ self.data.geom_xmat[geom].reshape(3, 3).T + self.data.geom_xpos[geom])


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """A collision geom of the town, seen from above.

    Attributes:
        outline_m: (N, 2) convex outline in the world, in metres.
        height_m: vertical extent of the geom.
        size_m: longer and shorter side of the smallest rectangle around the outline.
    """

    outline_m: Array
    height_m: float
    size_m: tuple[float, float]

    @property
    def is_building(self) -> bool:
        """Whether the obstacle is high and wide enough to be drawn as a building."""
        return min(self.height_m, *self.size_m) >= LEAST_BUILDING_M

    @property
    def is_fence(self) -> bool:
        """Whether the obstacle is long and no building, such as a fence, a wall or a hedge."""
        return not self.is_building and self.size_m[0] >= LEAST_FENCE_M


def obstacles(geometry: TownGeometry) -> list[Obstacle]:
    """Returns the collision geoms of a town that are not ground.

    Args:
        geometry: the compiled town.
    """
    found = []
    for geom in np.flatnonzero(geometry.model.geom_group >= FIRST_HIDDEN_GROUP):
        is_plane = geometry.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
        if is_plane or geometry.model.geom(int(geom)).name.startswith(GROUND_PREFIX):
            continue
        corners = geometry.corners_m(int(geom)).reshape(-1, 3)
        flat = corners[:, :2].astype(np.float32)
        sides = sorted(cv2.minAreaRect(flat)[1], reverse=True)
        outline = np.asarray(cv2.convexHull(flat), dtype=np.float64).reshape(-1, 2)
        found.append(Obstacle(outline, float(np.ptp(corners[:, 2])), (float(sides[0]), float(sides[1]))))
    return found


def draw_ground(canvas: Canvas, geometry: TownGeometry, bounds_m: Bounds) -> None:
    """Draws the ground, plants, fences and buildings of a town.

    Args:
        canvas: the map.
        geometry: the compiled town.
        bounds_m: xmin, ymin, xmax and ymax of the town.
    """
    corners_m = {geom: geometry.corners_m(geom) for _, labels, _ in COVERS for geom in _labelled(geometry, labels)}
    hidden = _underground(corners_m, _labelled(geometry, ("ground",)), bounds_m)
    for _, labels, colour in COVERS:
        mask = canvas.mask()
        for geom in _labelled(geometry, labels):
            if geom != hidden:
                canvas.fill_triangles(mask, _from_above(corners_m[geom]))
        canvas.blend(mask, colour)
    plants = canvas.mask()
    for geom in _labelled(geometry, ("vegetation",)):
        canvas.fill_triangles(plants, _from_above(geometry.corners_m(geom)))
    canvas.blend(plants, VEGETATION, 0.55)
    blocks = obstacles(geometry)
    for fence in (block for block in blocks if block.is_fence):
        canvas.line(canvas.to_px(fence.outline_m), FENCE, 0.8, closed=True)
    buildings = canvas.mask()
    for building in (block for block in blocks if block.is_building):
        first, *others = building.outline_m
        canvas.fill_triangles(buildings, np.array([(first, a, b) for a, b in pairwise(others)]))
    canvas.blend(canvas.shift_down_right(buildings, 0.8 * canvas.px_per_m), SHADOW, 0.25)
    canvas.blend(buildings, BUILDING)
    canvas.outline(buildings, BUILDING_EDGE, 0.8)


def _underground(corners_m: Mapping[int, Array], ground: Sequence[int], bounds_m: Bounds) -> int | None:
    """Returns the ground geom that is only there to close cracks, so that it is not drawn; None if there is none.

    Such a geom lies below all other ground and extends under the whole town.
    """
    if len(corners_m) < 2:
        return None
    tops_m = {geom: float(corners[..., 2].max()) for geom, corners in corners_m.items()}
    lowest, second = sorted(tops_m, key=lambda geom: tops_m[geom])[:2]
    points = corners_m[lowest].reshape(-1, 3)[:, :2]
    is_under = tops_m[lowest] < tops_m[second]
    is_wide = (points.min(axis=0) <= bounds_m[:2]).all() and (points.max(axis=0) >= bounds_m[2:]).all()
    return lowest if is_under and is_wide and lowest in ground else None


def _labelled(geometry: TownGeometry, names: tuple[str, ...]) -> list[int]:
    codes = [LABEL_BY_NAME[name].code for name in names]
    return [int(geom) for geom in np.flatnonzero(np.isin(geometry.classes.label_code, codes))]


def _from_above(corners_m: Array) -> Array:
    """Projects (N, 3, 3) triangles onto the ground; returns the (M, 3, 2) projections with a positive area."""
    flat = corners_m[:, :, :2]
    first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    return flat[np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) > 1e-3]
