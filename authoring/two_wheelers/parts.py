"""Parts that two-wheelers share: bent tubes, wheels, and hard parts gathered by geom and colour.

Frame of a machine: x forward, y left, z up, the origin on the ground between the wheels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from authoring.mesh import Mesh, bevelled_box, merge, revolve, rotation, smooth_normals
from authoring.people.field import Array, Frame
from authoring.people.texture import swatch_uv
from authoring.tubes import outward, skinned, tube
from authoring.two_wheelers.plate import Plate, plate_face

ALONG_X = Frame(np.zeros(3), np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))
"""A frame for lofts whose stations run along x: rows are (x, z, -y, half-height, half-width)."""


__all__ = [
    "ALONG_X",
    "Hard",
    "arch",
    "block",
    "cast_spokes",
    "curve",
    "disc",
    "rim_ring",
    "tube",
    "tyre",
    "wire_spokes",
]


@dataclass(slots=True)
class Hard:
    """Hard parts by geom (`paint`, `metal`, `trim`), each with a colour of the machine's atlas.

    Attributes:
        colours: the atlas' colours in order.
        meshes: by geom, with texture coordinates in the atlas.
        plate: the number plate, whose face belongs to `trim`.
    """

    colours: Sequence[str]
    meshes: dict[str, list[Mesh]] = field(default_factory=dict)
    plate: Plate | None = None

    def add(self, group: str, tint: str, mesh: Mesh, *, crease_deg: float = 40.0) -> None:
        """Gather a mesh; its texture coordinates become its colour's."""
        smooth = smooth_normals(Mesh.of(mesh.vertices, mesh.faces), crease_deg)
        uv = swatch_uv(list(self.colours).index(tint))
        self.meshes.setdefault(group, []).append(smooth.with_uvs(np.tile(uv, (len(smooth.vertices), 1))))

    def both(self, group: str, tint: str, mesh: Mesh, *, crease_deg: float = 40.0) -> None:
        """Gather a mesh and its mirror image on the other side."""
        self.add(group, tint, mesh, crease_deg=crease_deg)
        self.add(group, tint, mesh.scaled(1.0, -1.0, 1.0), crease_deg=crease_deg)

    def add_plate(self, text: str, low: Sequence[float], high: Sequence[float], *, pitch_deg: float) -> None:
        """Gather a number plate: a thin block between two corners, and its face, which looks backwards."""
        self.add("trim", "plate", block(low, high, 0.004, pitch_deg=pitch_deg))
        self.plate = plate_face(text, low, high, pitch_deg=pitch_deg)


def block(low: Sequence[float], high: Sequence[float], bevel: float = 0.006, *, pitch_deg: float = 0.0) -> Mesh:
    """A bevelled box between two corners, pitched nose down about its middle."""
    a, b = np.array(low), np.array(high)
    mesh = bevelled_box(b - a, bevel, segments=1).transformed(rotation("y", pitch_deg))
    return mesh.translated(*((a + b) / 2))


def disc(centre: Sequence[float], profile: ArrayLike, segments: int = 28) -> Mesh:
    """A (P, 2) profile of (radius, y) turned about the y axis at `centre`."""
    return outward(revolve(profile, segments, axis="y")).translated(*centre)


def tyre(centre: Sequence[float], radius: float, width: float, rim: float, segments: int = 32) -> Mesh:
    """A tyre of an outer radius and width on a rim's radius."""
    half = width / 2
    middle, deep = (radius + rim) / 2, (radius - rim) / 2
    angle = np.linspace(-np.pi, np.pi, 10)
    profile = np.stack([middle + deep * np.cos(angle), half * np.sin(angle)], axis=1)
    return disc(centre, profile, segments)


def rim_ring(centre: Sequence[float], rim: float, width: float, depth: float, segments: int = 32) -> Mesh:
    """A wheel's rim: a ring `depth` deep inside the tyre."""
    half = width / 2
    profile = [
        (rim + 0.004, -half),
        (rim + 0.004, half),
        (rim - depth, half * 0.8),
        (rim - depth, -half * 0.8),
        (rim + 0.004, -half),
    ]
    return disc(centre, profile, segments)


def wire_spokes(centre: Sequence[float], rim: float, hub: float, half_width: float, count: int) -> Mesh:
    """Wire spokes, crossed, from both flanges of the hub."""
    wires = []
    middle = np.array(centre)
    for number in range(count):
        at = 2.0 * np.pi * number / count
        lead = 0.55 * (1 if (number // 2) % 2 else -1)
        y = half_width * (1 if number % 2 else -1)
        foot = middle + np.array([hub * np.cos(at + lead), y, hub * np.sin(at + lead)])
        top = middle + np.array([rim * np.cos(at), 0.0, rim * np.sin(at)])
        wires.append(tube([foot, top], 0.0022, sides=3))
    return merge(wires)


def cast_spokes(centre: Sequence[float], rim: float, hub: float, count: int) -> Mesh:
    """Cast spokes in pairs, thick at the hub."""
    spokes = []
    for number in range(count):
        for lean in (-0.16, 0.16):
            at = 2.0 * np.pi * number / count
            foot = np.array([hub * np.cos(at + 3 * lean), 0.0, hub * np.sin(at + 3 * lean)])
            top = np.array([rim * np.cos(at + lean), 0.0, rim * np.sin(at + lean)])
            spokes.append(tube(np.stack([foot, top]) + np.array(centre), [0.016, 0.011], sides=6))
    return merge(spokes)


def arch(centre: Sequence[float], radius: float, half_width: float, start_deg: float, end_deg: float) -> Mesh:
    """A mudguard: a bent strip over a wheel between two angles (0 is forward, 90 up), 4 mm thick."""
    sections = []
    for angle in np.radians(np.linspace(start_deg, end_deg, 14)):
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        ring = []
        for y, r in ((-1.0, -0.014), (-0.55, 0.0), (0.55, 0.0), (1.0, -0.014), (0.55, -0.005), (-0.55, -0.005)):
            ring.append(np.array(centre) + (radius + r) * out + np.array([0.0, y * half_width, 0.0]))
        sections.append(np.stack(ring))
    return skinned(np.stack(sections))


def curve(points: ArrayLike, count: int = 12) -> Array:
    """(count, 3) points of a smooth curve through the given ones."""
    p = np.asarray(points, dtype=np.float64)
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    return np.asarray(PchipInterpolator(at, p, axis=0)(np.linspace(0.0, at[-1], count)))
