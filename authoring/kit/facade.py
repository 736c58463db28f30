"""A wall plane with its own coordinates, and walls with holes in it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Sink
from authoring.materials.atlas import Rect
from authoring.materials.registry import MATERIALS

Array = npt.NDArray[np.float64]
SIDES = ("front", "right", "back", "left")


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangular hole in a wall, in metres along the facade (u) and upwards (v)."""

    u0: float
    v0: float
    u1: float
    v1: float


@dataclass(frozen=True, slots=True, eq=False)
class Facade:
    """One side of a building: u runs right as seen from outside, v up, d out of the wall. All in metres."""

    sink: Sink
    origin: Array
    right: Array
    width_m: float

    @property
    def outward(self) -> Array:
        """The unit normal, horizontal, away from the building."""
        return np.array([self.right[1], -self.right[0], 0.0])

    def at(self, u_m: float, v_m: float, d_m: float = 0.0) -> Array:
        """The point at (u, v, d) in the building's frame, shape (3,)."""
        (x_m, y_m, z_m), (right_x, right_y, right_z) = self.origin.tolist(), self.right.tolist()
        return np.array(
            [x_m + right_x * u_m + right_y * d_m, y_m + right_y * u_m - right_x * d_m, z_m + right_z * u_m + v_m]
        )

    def panel(self, material: str, u0: float, v0: float, u1: float, v1: float, *, d_m: float = 0.0) -> None:
        """Adds a flat rectangle of a tiling material whose texture continues in its neighbours without a seam."""
        tile_m = MATERIALS[material].tile_m
        offset = float(self.origin @ self.right)
        uvs = [((u + offset) / tile_m, v / tile_m) for u, v in ((u0, v0), (u1, v0), (u1, v1), (u0, v1))]
        self.sink.polygon(material, self._rectangle(u0, v0, u1, v1, d_m), uvs)

    def picture(
        self,
        material: str,
        rect: Rect,
        u0: float,
        v0: float,
        u1: float,
        v1: float,
        *,
        d_m: float = 0.0,
        tilt: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Adds a flat rectangle that shows one rectangle of an atlas.

        Args:
            material: an atlas material.
            rect: the rectangle of the atlas.
            u0: left edge, metres; v0 the lower, u1 the right, v1 the upper one.
            v0: see u0.
            u1: see u0.
            v1: see u0.
            d_m: distance from the plane of the wall outwards, metres.
            tilt: lean of its normal along (u, v), radians, because no two panes reflect the same place.
        """
        uvs = [(rect[0], rect[1]), (rect[2], rect[1]), (rect[2], rect[3]), (rect[0], rect[3])]
        normal = self.outward + tilt[0] * self.right + np.array([0.0, 0.0, tilt[1]])
        normals = np.tile(normal / np.linalg.norm(normal), (4, 1))
        corners = self._rectangle(u0, v0, u1, v1, d_m)
        self.sink.triangles(material, corners, [(0, 1, 2), (0, 2, 3)], uvs=uvs, normals=normals)

    def swatch(self, name: str, u0: float, v0: float, u1: float, v1: float, *, d_m: float = 0.0) -> None:
        """Adds a flat rectangle of a plain colour."""
        self.sink.swatch_quad(name, self._rectangle(u0, v0, u1, v1, d_m))

    def box(
        self,
        material: str,
        u: tuple[float, float],
        v: tuple[float, float],
        d: tuple[float, float],
        *,
        skip: str = "b",
    ) -> None:
        """Adds a block on the wall; `skip` leaves out faces: l(eft) r(ight) u(nder) t(op) f(ront) b(ack).

        `material` is a tiling material or a palette swatch.
        """
        (u0, u1), (v0, v1), (d0, d1) = u, v, d
        at = self.at
        faces = {
            "f": (at(u0, v0, d1), at(u1, v0, d1), at(u1, v1, d1), at(u0, v1, d1)),
            "b": (at(u1, v0, d0), at(u0, v0, d0), at(u0, v1, d0), at(u1, v1, d0)),
            "l": (at(u0, v0, d0), at(u0, v0, d1), at(u0, v1, d1), at(u0, v1, d0)),
            "r": (at(u1, v0, d1), at(u1, v0, d0), at(u1, v1, d0), at(u1, v1, d1)),
            "u": (at(u0, v0, d0), at(u1, v0, d0), at(u1, v0, d1), at(u0, v0, d1)),
            "t": (at(u0, v1, d1), at(u1, v1, d1), at(u1, v1, d0), at(u0, v1, d0)),
        }
        for face, corners in faces.items():
            if face not in skip:
                self.surface(material, corners)

    def surface(self, material: str, corners: Sequence[Array]) -> None:
        """Adds a quadrilateral anywhere near the facade, of a tiling material or a palette swatch."""
        if material in MATERIALS:
            self.sink.quad(material, np.asarray(corners), tile_m=MATERIALS[material].tile_m)
        else:
            self.sink.swatch_quad(material, np.asarray(corners))

    def wall(self, material: str, u0: float, v0: float, u1: float, v1: float, openings: Sequence[Opening] = ()) -> None:
        """Adds the wall between two corners without its openings, which must not overlap each other."""
        inside = [o for o in openings if o.v1 > v0 + 1e-6 and o.v0 < v1 - 1e-6]
        levels = sorted({v0, v1, *(min(max(v, v0), v1) for o in inside for v in (o.v0, o.v1))})
        for low, high in itertools.pairwise(levels):
            cut = sorted((o.u0, o.u1) for o in inside if o.v0 < high - 1e-6 and o.v1 > low + 1e-6)
            start = u0
            for left, right in [*cut, (u1, u1)]:
                if left - start > 1e-3 and high - low > 1e-3:
                    self.panel(material, start, low, left, high)
                start = max(start, right)

    def reveal(self, material: str, opening: Opening, depth_m: float, *, skip: str = "") -> None:
        """Adds the four cheeks of a recess behind an opening; `skip` leaves out some: l(eft), r(ight), u(pper),
        s(ill).
        """
        o, d = opening, -depth_m
        at = self.at
        cheeks = {
            "l": (at(o.u0, o.v0, 0), at(o.u0, o.v0, d), at(o.u0, o.v1, d), at(o.u0, o.v1, 0)),
            "r": (at(o.u1, o.v0, d), at(o.u1, o.v0, 0), at(o.u1, o.v1, 0), at(o.u1, o.v1, d)),
            "u": (at(o.u0, o.v1, d), at(o.u1, o.v1, d), at(o.u1, o.v1, 0), at(o.u0, o.v1, 0)),
            "s": (at(o.u0, o.v0, 0), at(o.u1, o.v0, 0), at(o.u1, o.v0, d), at(o.u0, o.v0, d)),
        }
        for face, corners in cheeks.items():
            if face not in skip:
                self.surface(material, corners)

    def _rectangle(self, u0: float, v0: float, u1: float, v1: float, d_m: float) -> Array:
        return np.stack([self.at(u0, v0, d_m), self.at(u1, v0, d_m), self.at(u1, v1, d_m), self.at(u0, v1, d_m)])


def facades(sink: Sink, width_m: float, depth_m: float, *, z_m: float = 0.0) -> dict[str, Facade]:
    """The four sides of a box footprint centred at the origin; `front` faces -y, `right` +x."""
    half_w, half_d = width_m / 2, depth_m / 2
    corners = {
        "front": (-half_w, -half_d),
        "right": (half_w, -half_d),
        "back": (half_w, half_d),
        "left": (-half_w, half_d),
    }
    turns = {"front": (1.0, 0.0), "right": (0.0, 1.0), "back": (-1.0, 0.0), "left": (0.0, -1.0)}
    return {
        side: Facade(
            sink,
            np.array([*corners[side], z_m]),
            np.array([*turns[side], 0.0]),
            width_m if side in ("front", "back") else depth_m,
        )
        for side in SIDES
    }


def belt(
    sink: Sink,
    material: str,
    width_m: float,
    depth_m: float,
    profile: Sequence[tuple[float, float]],
    *,
    sides: Sequence[str] = SIDES,
) -> None:
    """Adds a moulding around a rectangular footprint, mitred where two sides meet and closed where it ends.

    Args:
        sink: collects the faces.
        material: a tiling material or a palette swatch.
        width_m: size of the footprint along x, metres.
        depth_m: size of the footprint along y, metres.
        profile: (d, v) points from below upwards: metres out of the wall, and metres above the ground.
        sides: the sides that get the moulding.
    """
    walls = facades(sink, width_m, depth_m)
    for index, side in enumerate(SIDES):
        if side not in sides:
            continue
        wall = walls[side]
        grow_left = SIDES[index - 1] in sides
        grow_right = SIDES[(index + 1) % 4] in sides
        for (d0, v0), (d1, v1) in itertools.pairwise(profile):
            ends = [(-d if grow_left else 0.0, wall.width_m + (d if grow_right else 0.0), d) for d in (d0, d1)]
            (l0, r0, _), (l1, r1, _) = ends
            wall.surface(material, (wall.at(l0, v0, d0), wall.at(r0, v0, d0), wall.at(r1, v1, d1), wall.at(l1, v1, d1)))
        for grows, u_m, order in ((grow_left, 0.0, 1), (grow_right, wall.width_m, -1)):
            if not grows:
                outline = [wall.at(u_m, v, d) for d, v in profile][::order]
                _cap(wall, material, outline)


def _cap(wall: Facade, material: str, outline: list[Array]) -> None:
    foot = outline[0]
    for second, third in itertools.pairwise(outline[1:]):
        if np.linalg.norm(np.cross(second - foot, third - foot)) > 1e-6:
            corners = np.stack([foot, second, third])
            if material in MATERIALS:
                wall.sink.quad(material, corners, tile_m=MATERIALS[material].tile_m)
            else:
                wall.sink.swatch_quad(material, corners)
