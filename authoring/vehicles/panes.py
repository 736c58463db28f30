"""Pictures of the inside of vehicles on their panes.

Panes are opaque, because ids and depth show the pane; therefore the inside is drawn on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from authoring.mesh import Floats, Ints, Mesh

__all__ = ["Colour", "Pane", "Picture", "pieces", "write_panes"]

Colour = tuple[int, int, int]

_OVER = 4
_EDGE_PX = 2
"""Margin of the picture beyond the rim of a pane, so that coarser mip levels never show a neighbouring pane."""


@dataclass(frozen=True)
class Pane:
    """A rectangle of a picture of panes, pixels, top down; `picture` is width and height of the whole."""

    left: int
    top: int
    width: int
    height: int
    picture: tuple[int, int]

    def dress(self, mesh: Mesh, right: Floats, up: Floats) -> Mesh:
        """Returns the mesh with texture coordinates: (N,) positions in the pane, 0 to 1, rightwards and upwards."""
        u = (self.left + _EDGE_PX + np.clip(right, 0, 1) * (self.width - 2 * _EDGE_PX)) / self.picture[0]
        v = (self.top + _EDGE_PX + np.clip(1 - up, 0, 1) * (self.height - 2 * _EDGE_PX)) / self.picture[1]
        return mesh.with_uvs(np.stack([u, 1 - v], axis=1))


class Picture:
    """The picture of a pane; coordinates are 0 to 1, rightwards and downwards. `wide` is the width of the real pane
    divided by its height.
    """

    def __init__(self, pane: Pane, ground: Colour, wide: float) -> None:
        self._size = (pane.width * _OVER, pane.height * _OVER)
        self.wide = wide
        self._image = Image.new("RGB", self._size, ground)
        self._draw = ImageDraw.Draw(self._image)

    def _at(self, x: float, y: float) -> tuple[float, float]:
        edge = _EDGE_PX * _OVER
        return edge + x * (self._size[0] - 2 * edge), edge + y * (self._size[1] - 2 * edge)

    def rect(self, x0: float, y0: float, x1: float, y1: float, fill: Colour, round_share: float = 0.0) -> None:
        """Draws a rectangle; the radius of its corners is a share of its width."""
        box = (*self._at(x0, y0), *self._at(x1, y1))
        self._draw.rounded_rectangle(box, radius=round_share * (box[2] - box[0]), fill=fill)

    def poly(self, points: list[tuple[float, float]], fill: Colour) -> None:
        """Draws a polygon."""
        self._draw.polygon([self._at(x, y) for x, y in points], fill=fill)

    def oval(self, x: float, y: float, high: float, fill: Colour, slim: float = 1.0, ring: float = 0.0) -> None:
        """Draws an oval; `high` is its height as a share of the pane's height, `slim` its width divided by its height,
        and `ring` leaves its inside empty.
        """
        rx, ry = high * slim / self.wide / 2, high / 2
        box = (*self._at(x - rx, y - ry), *self._at(x + rx, y + ry))
        if ring:
            self._draw.ellipse(box, outline=fill, width=round(ring * self._size[1]))
        else:
            self._draw.ellipse(box, fill=fill)

    def street(self, x0: float, y0: float, x1: float, y1: float, light: float = 1.0) -> None:
        """Draws a pane of the far side with the street behind it: sky above, houses below."""
        for k in range(12):
            red, green, blue = (
                round(light * (a + (b - a) * k / 11)) for a, b in zip((134, 142, 150), (84, 84, 80), strict=True)
            )
            self.rect(x0, y0 + (y1 - y0) * k / 12, x1, y0 + (y1 - y0) * (k + 1) / 12, (red, green, blue))

    def finish(self) -> Image.Image:
        """Returns the picture in its final size."""
        size = (self._size[0] // _OVER, self._size[1] // _OVER)
        return self._image.resize(size, Image.Resampling.LANCZOS)


def pieces(mesh: Mesh, group: Ints) -> Iterator[tuple[int, Mesh]]:
    """Splits a mesh by the (M,) groups of its faces; vertices between groups are doubled."""
    for k in np.unique(group):
        yield int(k), mesh.part(mesh.faces[group == k])


def write_panes(path: Path, ground: Colour, pictures: Sequence[tuple[Pane, Picture]]) -> None:
    """Writes the picture of all panes."""
    image = Image.new("RGB", pictures[0][0].picture, ground)
    for pane, picture in pictures:
        image.paste(picture.finish(), (pane.left, pane.top))
    image.quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)
