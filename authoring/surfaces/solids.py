"""Hard-edged steelwork: boxes, tubes and quads with flat or round shading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """Triangles with one normal and one UV a vertex.

    Attributes:
        vertices: (V, 3) float64, metres.
        normals: (V, 3) float64, unit length.
        uvs: (V, 2) float64, u to the right and v down in the image.
        faces: (F, 3) int64, counter-clockwise seen from outside.
    """

    vertices: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float64]
    uvs: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]


def quad(corners: Sequence[Point]) -> Solid:
    """A flat quad from its top-left corner on, clockwise as its viewer sees it; the image fills it once."""
    vertices = np.array(corners, dtype=np.float64)
    normal = np.cross(vertices[3] - vertices[0], vertices[1] - vertices[0])
    normals = np.tile(normal / np.linalg.norm(normal), (4, 1))
    uvs = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    return Solid(vertices, normals, uvs, np.array([(0, 2, 1), (0, 3, 2)]))


def box(low: Point, high: Point, *, pitch_rad: float = 0.0, about: Point | None = None) -> Solid:
    """An axis-aligned box, turned by `pitch_rad` about the y axis through `about` (its middle if not given)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    sides = [
        quad([(x1, y0, z1), (x1, y1, z1), (x1, y1, z0), (x1, y0, z0)]),
        quad([(x0, y1, z1), (x0, y0, z1), (x0, y0, z0), (x0, y1, z0)]),
        quad([(x0, y0, z1), (x1, y0, z1), (x1, y0, z0), (x0, y0, z0)]),
        quad([(x1, y1, z1), (x0, y1, z1), (x0, y1, z0), (x1, y1, z0)]),
        quad([(x0, y1, z1), (x1, y1, z1), (x1, y0, z1), (x0, y0, z1)]),
        quad([(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)]),
    ]
    solid = join(sides)
    cos, sin = np.cos(pitch_rad), np.sin(pitch_rad)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    centre = (np.array(low) + np.array(high)) / 2 if about is None else np.array(about)
    return Solid((solid.vertices - centre) @ turn.T + centre, solid.normals @ turn.T, solid.uvs, solid.faces)


def tube(start: Point, end: Point, radius_m: float, *, sides: int) -> Solid:
    """A round bar with flat ends."""
    a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    helper = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    turn = 2.0 * np.pi * np.arange(sides) / sides
    round_normals = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), up)
    ring = radius_m * round_normals
    here = np.arange(sides)
    there = (here + 1) % sides
    wall = np.concatenate([np.stack([here, there, there + sides], 1), np.stack([here, there + sides, here + sides], 1)])
    fan = np.stack([np.zeros(sides - 2, dtype=np.int64), here[1:-1], here[2:]], 1)
    vertices = np.concatenate([a + ring, b + ring, a + ring, b + ring])
    normals = np.concatenate([round_normals, round_normals, np.tile(-axis, (sides, 1)), np.tile(axis, (sides, 1))])
    faces = np.concatenate([wall, fan[:, ::-1] + 2 * sides, fan + 3 * sides])
    return Solid(vertices, normals, np.full((4 * sides, 2), 0.5), faces)


def join(solids: Sequence[Solid]) -> Solid:
    """All solids as one mesh."""
    offsets = np.cumsum([0] + [len(solid.vertices) for solid in solids[:-1]])
    return Solid(
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([solid.normals for solid in solids]),
        np.concatenate([solid.uvs for solid in solids]),
        np.concatenate([solid.faces + offset for solid, offset in zip(solids, offsets, strict=True)]),
    )


def obj_text(solid: Solid) -> str:
    """The mesh as Wavefront OBJ: vertices to 1 mm, UVs to 1e-4 (OBJ counts v upwards), normals to 1e-3."""

    def rows(tag: str, values: npt.NDArray[np.float64], digits: int) -> list[str]:
        clean = np.round(values, digits) + 0.0
        return [tag + " " + " ".join(f"{value:.{digits}f}" for value in row) for row in clean]

    flipped = np.column_stack([solid.uvs[:, 0], 1.0 - solid.uvs[:, 1]])
    lines = rows("v", solid.vertices, 3) + rows("vt", flipped, 4) + rows("vn", solid.normals, 3)
    lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in face + 1) for face in solid.faces]
    return "\n".join(lines) + "\n"
