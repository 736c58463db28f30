"""Cuts a town's triangles into chunks: one mesh a label, material and cell, so that what is out of view is skipped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from authoring.kit.parts import Part
from authoring.mesh import Mesh

REACH = 2
LETTERS = "abcdef"
# How coarse a part's cells are by its triangles: few large chunks are cheaper than many small ones.
LEVELS = ((25000, 1), (9000, 2), (0, 4))
# A cell with fewer triangles joins the fullest one, and so do all cells of a part with fewer than `WHOLE`.
CRUMBS, WHOLE = 24, 250


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
        middles = np.asarray(mesh.vertices)[faces].mean(1)[:, :2]
        coarse = next(factor for least, factor in LEVELS if len(faces) >= least)
        cells = np.clip(np.floor(middles / (cell_m * coarse)), -REACH - 1, REACH).astype(np.int64)
        keys = (cells[:, 0] + REACH + 1) * 10 + cells[:, 1] + REACH + 1
        names, counts = np.unique(keys, return_counts=True)
        crumbs = names if len(faces) < WHOLE else names[counts < CRUMBS]
        keys[np.isin(keys, crumbs)] = names[counts.argmax()]
        for key in np.unique(keys):
            name = f"{part.label}_{part.material}_{LETTERS[key // 10]}{LETTERS[key % 10]}"
            yield Chunk(name, part.material, part.label, mesh.part(faces[keys == key]))
