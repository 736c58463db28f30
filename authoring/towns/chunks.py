"""Cuts a town's triangles into chunks: one mesh a label, material and cell, so that what is out of view is skipped.

Pitched roofs are cut by the side that they face instead: of a mesh whose slopes face one way the normal map is lit from
the side that it says (`gear.world.compilation.normal_maps`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Part
from authoring.mesh import Mesh

Ints = npt.NDArray[np.int64]

REACH = 2
LETTERS = "abcdef"
# How coarse a part's cells are by its triangles: few large chunks are cheaper than many small ones.
LEVELS = ((25000, 1), (9000, 2), (0, 4))
# A cell with fewer triangles joins the fullest one, and so do all cells of a part with fewer than `WHOLE`.
CRUMBS, WHOLE = 24, 250

PITCHED = frozenset({"slate_roof", "tile_roof", "tile_roof_brown", "tile_roof_grey"})
"""Materials of slopes."""

SIDES = ("east", "north", "west", "south")


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """One mesh of one material and label, named after both and after its cell."""

    name: str
    material: str
    label: str
    mesh: Mesh


def chunked(parts: Iterable[Part], *, cell_m: float) -> Iterator[Chunk]:
    """Cut parts along a grid by the middles of their triangles; what has few triangles stays whole.

    Args:
        parts: at most one of each material and label.
        cell_m: side of a cell; those beyond the outermost ring of cells are joined with it.
    """
    for part in parts:
        mesh, faces = part.mesh, np.asarray(part.mesh.faces)
        keys, names = _sides(mesh) if part.material in PITCHED else _cells(mesh, cell_m)
        for key in np.unique(keys):
            name = f"{part.label}_{part.material}_{names[key]}"
            yield Chunk(name, part.material, part.label, mesh.part(faces[keys == key]))


def _cells(mesh: Mesh, cell_m: float) -> tuple[Ints, dict[int, str]]:
    """(M,) the cell of each triangle, and what cells are called."""
    faces = np.asarray(mesh.faces)
    middles = np.asarray(mesh.vertices)[faces].mean(1)[:, :2]
    coarse = next(factor for least, factor in LEVELS if len(faces) >= least)
    cells = np.clip(np.floor(middles / (cell_m * coarse)), -REACH - 1, REACH).astype(np.int64)
    keys = (cells[:, 0] + REACH + 1) * 10 + cells[:, 1] + REACH + 1
    found, counts = np.unique(keys, return_counts=True)
    crumbs = found if len(faces) < WHOLE else found[counts < CRUMBS]
    keys[np.isin(keys, crumbs)] = found[counts.argmax()]
    return keys, {key: f"{LETTERS[key // 10]}{LETTERS[key % 10]}" for key in found.tolist()}


def _sides(mesh: Mesh) -> tuple[Ints, dict[int, str]]:
    """(M,) the side that each triangle faces, and what sides are called; level ones go with the first."""
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    x, y, _ = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
    sides = np.where(1.001 * np.abs(x) >= np.abs(y), np.where(x >= 0, 0, 2), np.where(y >= 0, 1, 3))
    return sides.astype(np.int64), dict(enumerate(SIDES))
