"""Where props go: merged into the town's meshes, instanced, or bodies of their own where they are countable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely  # type: ignore[import-untyped]
from shapely.geometry import Point  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring.kit.parts import Part, Sink, place
from authoring.mesh import Mesh
from authoring.towns.collision import Solid
from authoring.towns.document import Body, Geom

COUNTABLE = ("traffic_light", "stop_sign", "bench", "fire_hydrant", "parking_meter")
HEAD_GAP_M = 0.6


@dataclass(slots=True)
class Props:
    """Everything put down so far.

    Attributes:
        sink: takes what is merged.
        meshes: meshes shared by instances, by name.
        geoms, bodies, solids: for the document.
        spots: (x, y, radius) of what stands, so that nothing stands in anything.
    """

    sink: Sink
    meshes: dict[str, Mesh] = field(default_factory=dict)
    geoms: list[Geom] = field(default_factory=list)
    bodies: list[Body] = field(default_factory=list)
    solids: list[Solid] = field(default_factory=list)
    spots: list[tuple[float, float, float]] = field(default_factory=list)
    _counts: dict[str, int] = field(default_factory=dict)

    def is_free(self, x: float, y: float, radius_m: float) -> bool:
        """Whether a disc touches nothing that stands."""
        if not self.spots:
            return True
        spots = np.asarray(self.spots)
        return bool((np.hypot(spots[:, 0] - x, spots[:, 1] - y) > spots[:, 2] + radius_m).all())

    def put(
        self,
        kind: str,
        parts: Sequence[Part],
        x: float,
        y: float,
        z: float,
        yaw_rad: float,
        *,
        radius_m: float,
        high_m: float = 1.0,
    ) -> None:
        """Put something down; its countable parts become bodies, the rest is merged.

        Args:
            kind: its name; things of one name look alike, save for what is merged.
            radius_m: of the disc it stands on, which is also its collision cylinder's.
            high_m: height of that cylinder.
        """
        self.spots.append((x, y, radius_m))
        self.solids.append(
            Solid(f"{kind}_{self._number('solid')}", "cylinder", (x, y, z + high_m / 2), (radius_m, high_m / 2))
        )
        self.sink.extend(place([p for p in parts if p.label not in COUNTABLE], x_m=x, y_m=y, z_m=z, yaw_rad=yaw_rad))
        counted = [part for part in parts if part.label in COUNTABLE]
        for index, piece in enumerate(_objects(counted)):
            geoms = [
                Geom(
                    mesh=self._shared(f"{kind}_{index}_{part.material}", part.mesh),
                    material=part.material,
                    label=part.label,
                )
                for part in piece
            ]
            label = piece[0].label
            yaw_deg = round(float(np.degrees(yaw_rad)), 2)
            self.bodies.append(
                Body(name=f"{label}_{self._number(label)}", geoms=geoms, position=(x, y, z), yaw_deg=yaw_deg)
            )

    def instance(
        self,
        kind: str,
        parts: Sequence[Part],
        x: float,
        y: float,
        z: float,
        yaw_rad: float,
        *,
        radius_m: float,
        high_m: float,
    ) -> None:
        """Put down one more of a kind whose foliage all of its like share; trunks are merged, being small."""
        self.spots.append((x, y, radius_m))
        self.solids.append(
            Solid(f"{kind}_{self._number('solid')}", "cylinder", (x, y, z + high_m / 2), (radius_m, high_m / 2))
        )
        bark = [part for part in parts if part.material == "bark"]
        self.sink.extend(place(bark, x_m=x, y_m=y, z_m=z, yaw_rad=yaw_rad))
        for part in (part for part in parts if part.material != "bark"):
            mesh = self._shared(f"{kind}_{part.material}", part.mesh)
            yaw_deg = round(float(np.degrees(yaw_rad)), 1)
            position = (round(x, 3), round(y, 3), round(z, 3))
            self.geoms.append(
                Geom(mesh=mesh, material=part.material, label=part.label, position=position, yaw_deg=yaw_deg)
            )

    def _shared(self, name: str, mesh: Mesh) -> str:
        self.meshes.setdefault(name, mesh)
        return name

    def _number(self, name: str) -> int:
        self._counts[name] = self._counts.get(name, -1) + 1
        return self._counts[name]


@dataclass(slots=True)
class Ground:
    """Tests of whether a point is on walkable, uncluttered ground."""

    sidewalk: BaseGeometry
    crossings: BaseGeometry
    views: BaseGeometry

    def __post_init__(self) -> None:
        for shape in (self.sidewalk, self.crossings, self.views):
            shapely.prepare(shape)

    def takes(self, x: float, y: float, *, tall: bool = False) -> bool:
        """Whether something may stand there; nothing tall and leafy in front of a board."""
        point = Point(x, y)
        if not self.sidewalk.contains(point) or self.crossings.contains(point):
            return False
        return not (tall and self.views.contains(point))


def _objects(parts: Sequence[Part]) -> list[list[Part]]:
    """Parts cut into single objects: heads that hang apart along x are counted apart."""
    if not parts:
        return []
    if parts[0].label != "traffic_light":
        return [list(parts)]
    x = np.sort(np.concatenate([np.asarray(part.mesh.vertices)[:, 0] for part in parts]))
    cuts = x[:-1][np.diff(x) > HEAD_GAP_M] + HEAD_GAP_M / 2
    objects: list[list[Part]] = []
    for low, high in zip([-np.inf, *cuts], [*cuts, np.inf], strict=True):
        piece = []
        for part in parts:
            vertices, faces = np.asarray(part.mesh.vertices), np.asarray(part.mesh.faces)
            middle = vertices[faces].mean(1)[:, 0]
            chosen = faces[(middle > low) & (middle < high)]
            if len(chosen):
                piece.append(Part(part.material, part.label, part.mesh.part(chosen)))
        objects.append(piece)
    return objects
