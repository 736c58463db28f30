"""The steel that carries a billboard: posts, frame, back panel, lamps and service platform.

Frame: the file's own, its origin on the ground under the middle of the face; x to the viewer, y to his right, z up.
"""

from __future__ import annotations

import itertools

import numpy as np

from authoring.mesh import Mesh, merge, rotation
from authoring.mesh import box as box_mesh
from authoring.tubes import tube

Point = tuple[float, float, float]

FACE_WIDTH_M = 7.4
FACE_HEIGHT_M = 3.7
FACE_CENTRE_Z_M = 2.6
FACE_PROUD_M = 0.012
"""The face stands this far in front of its frame, so that no viewing angle hides its edge."""

_BOTTOM = FACE_CENTRE_Z_M - FACE_HEIGHT_M / 2
_TOP = FACE_CENTRE_Z_M + FACE_HEIGHT_M / 2
_POST_Y = (-2.35, 2.35)
_POST_X = -0.42
_RIM = 0.09
_LAMP_Y = (-2.7, -0.9, 0.9, 2.7)


def posts() -> Mesh:
    """Two H-beams with base plates and bolts, on the ground."""
    parts: list[Mesh] = []
    for y in _POST_Y:
        parts += [
            _box((_POST_X - 0.13, y - 0.11, 0.12), (_POST_X - 0.112, y + 0.11, _TOP - 0.15)),
            _box((_POST_X + 0.112, y - 0.11, 0.12), (_POST_X + 0.13, y + 0.11, _TOP - 0.15)),
            _box((_POST_X - 0.112, y - 0.008, 0.12), (_POST_X + 0.112, y + 0.008, _TOP - 0.15)),
            _box((_POST_X - 0.21, y - 0.19, 0.12), (_POST_X + 0.21, y + 0.19, 0.15)),
        ]
        for stiffener in (0.15, 0.30):
            parts.append(_box((_POST_X - 0.112, y - 0.11, stiffener), (_POST_X + 0.112, y + 0.11, stiffener + 0.012)))
        for dx in (-0.17, 0.17):
            for dy in (-0.15, 0.15):
                parts.append(tube([(_POST_X + dx, y + dy, 0.15), (_POST_X + dx, y + dy, 0.21)], 0.018, sides=6))
    return merge(parts)


def footings() -> Mesh:
    """The concrete pads under the posts."""
    return merge([_box((_POST_X - 0.4, y - 0.4, 0.0), (_POST_X + 0.4, y + 0.4, 0.12)) for y in _POST_Y])


def frame() -> Mesh:
    """Rim around the face, stringers and uprights behind it, lamp arms, platform, rail and ladder."""
    half, rim = FACE_WIDTH_M / 2, _RIM
    front, back = -FACE_PROUD_M, -0.16
    parts = [
        _box((back, -half - rim, _TOP), (front, half + rim, _TOP + rim)),
        _box((back, -half - rim, _BOTTOM - rim), (front, half + rim, _BOTTOM)),
        _box((back, -half - rim, _BOTTOM), (front, -half, _TOP)),
        _box((back, half, _BOTTOM), (front, half + rim, _TOP)),
    ]
    for k in range(9):
        y = -half + 0.05 + k * (FACE_WIDTH_M - 0.1) / 8
        parts.append(_box((-0.16, y - 0.03, _BOTTOM), (-0.1, y + 0.03, _TOP)))
    for z in (_BOTTOM + 0.25, FACE_CENTRE_Z_M - 0.55, FACE_CENTRE_Z_M + 0.55, _TOP - 0.3):
        parts.append(_box((-0.29, -half, z - 0.06), (-0.28, half, z + 0.06)))
        parts.append(_box((-0.28, -half, z + 0.05), (-0.16, half, z + 0.06)))
        parts.append(_box((-0.28, -half, z - 0.06), (-0.16, half, z - 0.05)))
    parts += _lamp_arms() + _platform() + _ladder()
    return merge(parts)


def _lamp_arms() -> list[Mesh]:
    parts: list[Mesh] = []
    for y in _LAMP_Y:
        path = [(-0.12, y, _TOP - 0.2), (-0.12, y, _TOP + 0.22), (0.0, y, _TOP + 0.36), (1.0, y, _TOP + 0.42)]
        parts += [tube([a, b], 0.024, sides=8) for a, b in itertools.pairwise(path)]
        parts.append(tube([(-0.1, y, _TOP + 0.05), (0.55, y, _TOP + 0.385)], 0.014, sides=6))
    parts.append(tube([(-0.12, _LAMP_Y[0], _TOP + 0.16), (-0.12, _LAMP_Y[-1], _TOP + 0.16)], 0.016, sides=6))
    return parts


def _platform() -> list[Mesh]:
    """The grating behind the board from which the sheet is hung, with its rail."""
    deck = FACE_CENTRE_Z_M - 0.75
    parts = [_box((-1.15, -3.2, deck - 0.05), (-1.12, 3.2, deck)), _box((-0.62, -3.2, deck - 0.05), (-0.59, 3.2, deck))]
    for k in range(33):
        y = -3.2 + 0.2 * k
        parts.append(_box((-1.12, y - 0.012, deck - 0.03), (-0.62, y + 0.012, deck)))
    for y in _POST_Y:
        parts.append(tube([(_POST_X - 0.13, y, deck - 0.62), (-1.12, y, deck - 0.05)], 0.022, sides=6))
        parts.append(_box((-1.15, y - 0.03, deck - 0.11), (_POST_X - 0.13, y + 0.03, deck - 0.05)))
    for y in (-3.18, -1.6, 0.0, 1.6, 3.18):
        parts.append(tube([(-1.135, y, deck - 0.05), (-1.135, y, deck + 1.05)], 0.02, sides=8))
    for height in (0.55, 1.05):
        parts.append(tube([(-1.135, -3.2, deck + height), (-1.135, 3.2, deck + height)], 0.018, sides=8))
    return parts


def _ladder() -> list[Mesh]:
    top = FACE_CENTRE_Z_M + 0.3
    parts = [tube([(-1.2, y, 1.0), (-1.2, y, top)], 0.018, sides=8) for y in (2.6, 3.0)]
    parts += [tube([(-1.2, 2.6, z), (-1.2, 3.0, z)], 0.012, sides=6) for z in (1.1, 1.38, 1.66, 1.94, 2.22, 2.5, 2.78)]
    return parts


def back_panel() -> Mesh:
    """The sheet-metal panel that carries the vinyl."""
    half = FACE_WIDTH_M / 2
    return _box((-0.1, -half, _BOTTOM), (-FACE_PROUD_M, half, _TOP))


def lamps() -> Mesh:
    """The four floodlights over the face: housings, tilted back to the board."""
    parts: list[Mesh] = []
    for y in _LAMP_Y:
        z = _TOP + 0.42
        parts.append(_box((0.93, y - 0.24, z - 0.05), (1.19, y + 0.24, z + 0.02), pitch_deg=31.5))
        parts.append(
            _box((0.99, y - 0.2, z + 0.02), (1.13, y + 0.2, z + 0.07), pitch_deg=31.5, about=(1.06, y, z - 0.015))
        )
    return merge(parts)


def face() -> Mesh:
    """The face's quad: u runs right and v down as the viewer sees it, the whole image once."""
    half, h = FACE_WIDTH_M / 2, FACE_HEIGHT_M / 2
    z = FACE_CENTRE_Z_M
    corners = [(0.0, -half, z - h), (0.0, half, z - h), (0.0, half, z + h), (0.0, -half, z + h)]
    return Mesh.of(corners, [(0, 1, 2), (0, 2, 3)], uvs=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def _box(low: Point, high: Point, *, pitch_deg: float = 0.0, about: Point | None = None) -> Mesh:
    """An axis-aligned box, turned about the y axis through `about` (its middle if not given)."""
    middle = (np.array(low) + np.array(high)) / 2
    pivot = middle if about is None else np.array(about)
    mesh = box_mesh(np.array(high) - np.array(low), middle - pivot)
    return mesh.transformed(rotation("y", pitch_deg)).translated(*pivot)
