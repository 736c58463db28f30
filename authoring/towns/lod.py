"""Removes parts of a building that are not visible from the street: thin edges of frames and sills high up."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Part

FROM_M = 8.5
THIN_M = 0.11
TOP_THIN_M = 0.35
RIM_M = (-0.9, 1.3)
"""From below a flat roof to above its parapet: without an underside the sky would be seen between coping and wall."""

Array = npt.NDArray[np.float64]


def without_hidden_edges(parts: Iterable[Part], width_m: float, depth_m: float) -> list[Part]:
    """A building's parts without slivers above the second floor that face along their facade or straight up.

    Args:
        parts: in the building's own frame, its footprint centred at the origin.
        width_m: along x.
        depth_m: along y.
    """
    found = list(parts)
    roofs = [np.asarray(part.mesh.vertices)[:, 2] for part in found if part.material == "roof_gravel"]
    roofs_m = np.unique(np.concatenate(roofs)) if roofs else np.empty(0)
    return [_trimmed(part, width_m, depth_m, roofs_m) if part.material == "palette" else part for part in found]


def _trimmed(part: Part, width_m: float, depth_m: float, roofs_m: Array) -> Part:
    vertices, faces = np.asarray(part.mesh.vertices), np.asarray(part.mesh.faces)
    corners = vertices[faces]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    thickness = size / edges
    unit = normal / np.maximum(size, 1e-12)[:, None]
    middle = corners.mean(1)
    to_side = np.abs(np.abs(middle[:, 0]) - width_m / 2)
    to_front = np.abs(np.abs(middle[:, 1]) - depth_m / 2)
    faces_out = np.where(to_front < to_side, np.abs(unit[:, 1]), np.abs(unit[:, 0])) > 0.7
    roof = corners[..., 2].max() - 2.5
    above_m = middle[:, 2, None] - roofs_m
    is_rim = ((above_m > RIM_M[0]) & (above_m < RIM_M[1])).any(1)
    high = (middle[:, 2] > FROM_M) & (middle[:, 2] < roof) & ~is_rim
    hidden = high & ~faces_out & ((thickness < THIN_M) | ((unit[:, 2] > 0.7) & (thickness < TOP_THIN_M)))
    return Part(part.material, part.label, part.mesh.part(faces[~hidden]))
