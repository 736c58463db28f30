"""What a two-wheeler is made of, and its meshes by geom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from authoring.mesh import Mesh, merge
from authoring.people.figure import Figure, Person
from authoring.people.piece import Piece, combine, mesh_pieces
from authoring.people.texture import Colour, atlas_uv
from authoring.two_wheelers.parts import Hard
from authoring.two_wheelers.plate import shifted
from authoring.two_wheelers.rider import Seat, model_rider

COLOURS: dict[str, Colour] = {
    "paint": (1.0, 1.0, 1.0),
    "rubber": (0.02, 0.02, 0.021),
    "black": (0.028, 0.028, 0.03),
    "seat": (0.03, 0.027, 0.026),
    "grey": (0.13, 0.13, 0.135),
    "silver": (0.46, 0.46, 0.47),
    "bronze": (0.22, 0.17, 0.11),
    "red": (0.48, 0.015, 0.012),
    "amber": (0.60, 0.22, 0.01),
    "glass": (0.62, 0.65, 0.68),
    "plate": (0.66, 0.66, 0.62),
    "chain": (0.09, 0.085, 0.08),
    "brown": (0.14, 0.06, 0.025),
    "box": (0.36, 0.05, 0.03),
}
"""Linear albedo of every part; `paint` takes the geom's colour."""

GROUPS = ("paint", "metal", "trim")


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoWheeler:
    """A machine with its rider.

    Attributes:
        name: of the files.
        kind: `motorcycle` or `bicycle`.
        hard, soft: its parts with edges, and its moulded ones.
        rider, seat: the person on it, and the position of hands, feet and hips.
        palette: (r, g, b, weight) rows of what a sample may colour.
        painted: which geom has that colour: the machine's `paint`, or the rider's.
        colour: linear albedo of the other of the two.
    """

    name: str
    kind: str
    hard: Hard
    rider: Person
    seat: Seat
    palette: tuple[tuple[float, float, float, float], ...]
    painted: str
    colour: Colour
    soft: Sequence[Piece] = field(default_factory=tuple)


def machine_meshes(machine: TwoWheeler) -> dict[str, Mesh]:
    """The machine's meshes by geom. With a plate, the texture is the swatches above its picture."""
    skins = mesh_pieces(machine.soft) if machine.soft else []
    meshes = {}
    for group in GROUPS:
        parts = list(machine.hard.meshes.get(group, []))
        moulded = [skin for skin in skins if skin.piece.group == group and len(skin.faces)]
        if moulded:
            parts.append(combine(moulded, lambda skin: atlas_uv(skin, COLOURS)))
        if parts:
            meshes[group] = merge(parts)
    if machine.hard.plate is not None:
        meshes = {group: shifted(mesh) for group, mesh in meshes.items()}
        meshes["trim"] = merge([meshes["trim"], machine.hard.plate.face])
    return meshes


def rider_figure(machine: TwoWheeler) -> Figure:
    """The rider, whose meshes are the jacket, other cloth with shoes and helmet, the skin and the hair."""
    made = model_rider(machine.rider, machine.seat)
    cloth = [made.meshes[group] for group in ("cloth", "shoes", "extra") if group in made.meshes]
    meshes = {"jacket": made.meshes["paint"], "cloth": merge(cloth), "skin": made.meshes["skin"]}
    if "hair" in made.meshes:
        meshes["hair"] = made.meshes["hair"]
    return Figure(meshes=meshes, key_points=made.key_points)


def model_machine(machine: TwoWheeler) -> Figure:
    """Every mesh and the rider's key points. The footprint's middle is the origin, and the tyres touch the ground."""
    rider = rider_figure(machine)
    meshes = machine_meshes(machine) | {f"rider_{name}": mesh for name, mesh in rider.meshes.items()}
    low = np.min([mesh.bounds[0] for mesh in meshes.values()], axis=0)
    high = np.max([mesh.bounds[1] for mesh in meshes.values()], axis=0)
    figure = Figure(meshes=meshes, key_points=rider.key_points)
    return figure.translated(x=-(low[0] + high[0]) / 2, z=-low[2])
