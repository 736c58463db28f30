"""A motorcycle's number plate: its face, its picture below the swatches of the machine's texture, and the way there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from authoring.mesh import Mesh, rotation, smooth_normals
from authoring.vehicles.plates import draw_plate

__all__ = ["Plate", "add_picture", "plate_face", "shifted"]

_SIDE_PX, _MARGIN_PX, _OVER = 128, 3, 4
_BEFORE_M = 0.002


@dataclass(frozen=True, slots=True)
class Plate:
    """A number plate.

    Attributes:
        text: what it says, in two lines that part at its space.
        face: a rectangle, with texture coordinates in the machine's texture.
        shape: its width by its height.
    """

    text: str
    face: Mesh
    shape: float


def plate_face(text: str, low: Sequence[float], high: Sequence[float], *, pitch_deg: float) -> Plate:
    """The plate on the rear of a block between two corners that is pitched about its middle, metres."""
    middle, half = (np.array(low) + high) / 2, (np.array(high) - low) / 2
    # As seen from behind, to the right is -y.
    corners = np.array([[-1, 1, -1], [-1, -1, -1], [-1, -1, 1], [-1, 1, 1]]) * half - [_BEFORE_M, 0, 0]
    edge = _MARGIN_PX / _SIDE_PX
    uvs = np.array([[edge, edge], [1 - edge, edge], [1 - edge, 1 - edge], [edge, 1 - edge]]) * [1, 0.5]
    face = smooth_normals(Mesh.of(corners, [[0, 1, 2], [0, 2, 3]], uvs))
    return Plate(text, face.transformed(rotation("y", pitch_deg)).translated(*middle), float(half[1] / half[2]))


def shifted(mesh: Mesh) -> Mesh:
    """A mesh with texture coordinates in the swatches alone, now that they are the upper half of the texture."""
    return mesh.with_uvs(mesh.uvs * [1.0, 0.5] + [0.0, 0.5])


def add_picture(path: Path, plate: Plate) -> None:
    """Makes the square picture of swatches at `path` the upper half of one that has the plate below."""
    image = Image.new("RGB", (_SIDE_PX, 2 * _SIDE_PX), (20, 20, 20))
    with Image.open(path) as swatches:
        image.paste(swatches.convert("RGB").resize((_SIDE_PX, _SIDE_PX), Image.Resampling.NEAREST), (0, 0))
    side = _SIDE_PX - 2 * _MARGIN_PX
    drawn = draw_plate(plate.text, round(plate.shape * side * _OVER), side * _OVER)
    image.paste(drawn.resize((side, side), Image.Resampling.LANCZOS), (_MARGIN_PX, _SIDE_PX + _MARGIN_PX))
    image.save(path, optimize=True)
