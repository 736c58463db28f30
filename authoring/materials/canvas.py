"""A small canvas in linear colour for drawing atlases: pixels with albedo, roughness, metalness and height."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from authoring.materials.image import Image, linear_to_srgb, normal_from_slopes, orm

Array = npt.NDArray[np.float64]
Colour = Sequence[float] | Array
Draw = Callable[[Image, int], object]


class Canvas:
    """A picture in unit coordinates: x right, y down, both 0..1, drawn supersampled and averaged at the end.

    Attributes:
        albedo: (H, W, 3) linear colour at the supersampled size.
        surface: (H, W, 2) roughness and metalness.
        relief_m: (H, W) height, which stays where things are drawn without one.
    """

    def __init__(self, width_px: int, height_px: int, *, oversample: int = 2) -> None:
        self.oversample = oversample
        self.size = (width_px * oversample, height_px * oversample)
        self.albedo: Array = np.zeros((self.size[1], self.size[0], 3))
        self.surface: Array = np.zeros((self.size[1], self.size[0], 2))
        self.surface[..., 0] = 0.8
        self.relief_m: Array = np.zeros((self.size[1], self.size[0]))

    def fill(self, colour: Colour, *, roughness: float = 0.8, metallic: float = 0.0) -> None:
        """Paint everything."""
        self.rect(0, 0, 1, 1, colour, roughness=roughness, metallic=metallic)

    def rect(
        self,
        x0: float,
        y0: float,
        x1: float,
        y1: float,
        colour: Colour,
        *,
        roughness: float = 0.8,
        metallic: float = 0.0,
        height_m: float | None = None,
    ) -> None:
        """Paint a rectangle, and set it that high."""
        box = self._box(x0, y0, x1, y1)
        self.albedo[box] = colour
        self.surface[box] = roughness, metallic
        if height_m is not None:
            self.relief_m[box] = height_m

    def gradient(self, x0: float, y0: float, x1: float, y1: float, top: Colour, bottom: Colour) -> None:
        """Colour a rectangle from top to bottom and leave its roughness and metalness."""
        box = self._box(x0, y0, x1, y1)
        ramp = np.linspace(0, 1, max(1, box[0].stop - box[0].start))[:, None, None]
        self.albedo[box] = np.asarray(top) * (1 - ramp) + np.asarray(bottom) * ramp

    def shade(self, x0: float, y0: float, x1: float, y1: float, factor: float) -> None:
        """Multiply the colour of a rectangle."""
        self.albedo[self._box(x0, y0, x1, y1)] *= factor

    def polygon(self, points: npt.ArrayLike, colour: Colour, *, roughness: float = 0.8, metallic: float = 0.0) -> None:
        """Paint a polygon (K, 2)."""
        pixels = np.rint(np.asarray(points, np.float64) * self.size).astype(np.int32)
        self._paint(lambda image, value: cv2.fillPoly(image, [pixels], value), colour, roughness, metallic)

    def ellipse(
        self,
        x: float,
        y: float,
        radius_x: float,
        radius_y: float,
        colour: Colour,
        *,
        roughness: float = 0.8,
        metallic: float = 0.0,
    ) -> None:
        """Paint an ellipse."""
        angle = np.arange(40) * 2 * np.pi / 40
        self.polygon(
            np.stack([x + radius_x * np.cos(angle), y + radius_y * np.sin(angle)], 1),
            colour,
            roughness=roughness,
            metallic=metallic,
        )

    def line(self, points: npt.ArrayLike, thickness: float, colour: Colour, *, closed: bool = False) -> None:
        """Paint a polyline (K, 2); thickness is a share of the height."""
        pixels = np.rint(np.asarray(points, np.float64) * self.size).astype(np.int32)
        width = max(1, round(thickness * self.size[1]))
        self._paint(lambda image, value: cv2.polylines(image, [pixels], closed, value, width), colour, None, 0.0)

    def text(
        self, words: str, x: float, y: float, height: float, colour: Colour, *, weight: float = 0.16, font: int = 2
    ) -> None:
        """Write words centred at (x, y); height is that of a capital letter as a share of the canvas's height."""
        scale = height * self.size[1] / 21.0
        thick = max(1, round(height * self.size[1] * weight))
        (wide, tall), _ = cv2.getTextSize(words, font, scale, thick)
        origin = (round(x * self.size[0] - wide / 2), round(y * self.size[1] + tall / 2))
        self._paint(
            lambda image, value: cv2.putText(image, words, origin, font, scale, value, thick), colour, None, 0.0
        )

    def image(self) -> Image:
        """The finished colour, sRGB bytes (height, width, 3)."""
        return linear_to_srgb(self._reduced(self.albedo))

    def orm(self, occlusion: Array | float = 1.0) -> Image:
        """The finished occlusion, roughness and metalness, (height, width, 3)."""
        surface = self.finished_surface()
        return orm(occlusion, surface[..., 0], surface[..., 1])

    def finished_surface(self) -> Array:
        """Roughness and metalness at the finished size, (height, width, 2)."""
        return self._reduced(self.surface)

    def finished_relief_m(self) -> Array:
        """Height at the finished size, (height, width)."""
        return self._reduced(self.relief_m[..., None])[..., 0]

    def normal(self, size_m: tuple[float, float], *, lean: Array | None = None) -> Image:
        """The finished normal map, (height, width, 3).

        Args:
            size_m: width and height of what the canvas shows.
            lean: (height, width, 2) slopes to the right and upwards that the surface has besides its relief.
        """
        relief_m = self.finished_relief_m()
        rows, columns = relief_m.shape
        down, right = np.gradient(relief_m, size_m[1] / rows, size_m[0] / columns)
        slopes = np.stack([right, -down], -1) + (0.0 if lean is None else lean)
        return normal_from_slopes(slopes[..., 0], slopes[..., 1])

    def _reduced(self, image: Array) -> Array:
        n = self.oversample
        height, width, channels = image.shape
        reduced: Array = image.reshape(height // n, n, width // n, n, channels).mean((1, 3))
        return reduced

    def _box(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        width, height = self.size
        rows = slice(max(0, round(y0 * height)), max(0, round(y1 * height)))
        return rows, slice(max(0, round(x0 * width)), max(0, round(x1 * width)))

    def _paint(self, draw: Draw, colour: Colour, roughness: float | None, metallic: float) -> None:
        mask = np.zeros((self.size[1], self.size[0]), np.uint8)
        draw(mask, 255)
        inside = mask > 0
        self.albedo[inside] = colour
        if roughness is not None:
            self.surface[inside] = roughness, metallic


def tiled(cells: Sequence[Image], columns: int) -> Image:
    """Cells of one size as a grid, row by row."""
    rows = [np.concatenate(cells[i : i + columns], axis=1) for i in range(0, len(cells), columns)]
    return np.concatenate(rows, axis=0)
