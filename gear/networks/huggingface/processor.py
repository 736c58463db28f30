"""The steps of a Hugging Face image processor, written in torch; therefore gradients pass through them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from torch import Tensor
from torch.nn import functional

from gear.networks.network import IMAGENET_MEAN, IMAGENET_STD, Normalise

Size = tuple[int, int]
"""Height and width in pixels."""

Channels = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Processor:
    """The image processor of a network: resizing, normalisation and margins of pictures.

    Attributes:
        mean, std: normalisation of the three channels of a picture in 0..1.
        size: size after resizing, in the keys of preprocessor_config.json: `height` and `width`, or `shortest_edge` and
            optionally `longest_edge`; empty for no resizing.
        mode: interpolation mode of torch.
        multiple_px: number of pixels of which sides are multiples; it may be a fraction.
        keeps_ratio: whether `height` and `width` only limit the size: the picture keeps its aspect ratio and is scaled
            by whichever of the two factors changes it less.
        rounds_down: whether sides are rounded down to a multiple; False rounds to the nearest multiple.
        pads_to_px: number of pixels of which the sides are made multiples by zeros on all sides, after all other steps;
            0 for no padding.
        has_margin: whether the picture is first extended by reflection.
        aligns_corners: whether the interpolation aligns corners; such an interpolation has no anti-aliasing.
        is_bgr: whether the network takes channels in the order blue, green, red.
    """

    mean: Channels = IMAGENET_MEAN
    std: Channels = IMAGENET_STD
    size: dict[str, int] | None = None
    mode: str = "bilinear"
    multiple_px: float = 1
    keeps_ratio: bool = False
    rounds_down: bool = False
    pads_to_px: int = 0
    has_margin: bool = False
    aligns_corners: bool = False
    is_bgr: bool = False

    def target(self, picture_px: Size) -> Size:
        """Returns height and width to which a picture is resized.

        Args:
            picture_px: height and width of the picture, including its reflected margin.
        """
        height, width = picture_px
        size = self.size or {}
        if "shortest_edge" in size:
            height, width = _with_edges(picture_px, size["shortest_edge"], size.get("longest_edge"))
            return self._multiple(height), self._multiple(width)
        scales = (size["height"] / height, size["width"] / width) if size else (1.0, 1.0)
        if self.keeps_ratio:
            scales = (min(scales, key=lambda each: abs(1 - each)),) * 2
        return self._multiple(scales[0] * height), self._multiple(scales[1] * width)

    def apply(self, pictures: Tensor) -> Tensor:
        """Converts pictures to the network's input (B, 3, h, w).

        Args:
            pictures: (B, 3, H, W) RGB in 0..1.
        """
        rows, columns = self._margin(_size(pictures))
        if rows or columns:
            pictures = functional.pad(pictures, (columns, columns, rows, rows), mode="reflect")
        network_input: Tensor = Normalise(self.mean, self.std).to(pictures.device)(self._resized(pictures))
        if self.is_bgr:
            network_input = network_input.flip(1)
        top, bottom, left, right = self._filled(_size(network_input))
        return functional.pad(network_input, (left, right, top, bottom))

    def restore(self, maps: Tensor, picture_px: Size, mode: str) -> Tensor:
        """Resamples maps from the size of the network's input to the size of the picture, and cuts margins off.

        Args:
            maps: (B, C, h, w) maps over the network's input, of any height and width.
            picture_px: height and width (H, W) of the picture in pixels.
            mode: interpolation mode of torch, for example `bilinear`.

        Returns:
            (B, C, H, W) maps over the picture.
        """
        rows, columns = self._margin(picture_px)
        wide = (picture_px[0] + 2 * rows, picture_px[1] + 2 * columns)
        height, width = self.target(wide)
        top, bottom, left, right = self._filled((height, width))
        if top + bottom + left + right:
            maps = _interpolated(maps, (top + height + bottom, left + width + right), mode)
            maps = maps[:, :, top : top + height, left : left + width]
        maps = _interpolated(maps, wide, mode)
        return maps[:, :, rows : rows + picture_px[0], columns : columns + picture_px[1]]

    def _resized(self, pictures: Tensor) -> Tensor:
        target = self.target(_size(pictures))
        if target == _size(pictures):
            return pictures
        if self.mode == "nearest-exact":
            return functional.interpolate(pictures, target, mode=self.mode)
        if self.aligns_corners:
            return functional.interpolate(pictures, target, mode=self.mode, align_corners=True)
        # Pillow returns whole levels, which cannot overshoot as bicubic interpolation does.
        return functional.interpolate(pictures, target, mode=self.mode, antialias=True).clamp(0, 1)

    def _multiple(self, side_px: float) -> int:
        steps = side_px / self.multiple_px
        return max(1, int(max(1, int(steps) if self.rounds_down else round(steps)) * self.multiple_px))

    def _margin(self, picture_px: Size) -> Size:
        """Number of reflected rows at the top and the bottom each, and of reflected columns at the left and the
        right each.
        """
        rows, columns = (int(math.sqrt(side / 2) * 3) if self.has_margin else 0 for side in picture_px)
        return rows, columns

    def _filled(self, input_px: Size) -> tuple[int, int, int, int]:
        """Numbers of padded rows at the top and the bottom, and of padded columns at the left and the right."""
        rows, columns = (-side % self.pads_to_px if self.pads_to_px else 0 for side in input_px)
        return rows // 2, rows - rows // 2, columns // 2, columns - columns // 2


def _size(pictures: Tensor) -> Size:
    return int(pictures.shape[2]), int(pictures.shape[3])


def _interpolated(maps: Tensor, size_px: Size, mode: str) -> Tensor:
    if _size(maps) == size_px:
        return maps
    return functional.interpolate(maps, size=size_px, mode=mode, align_corners=False)


def _with_edges(picture_px: Size, edge_px: int, most_px: int | None) -> Size:
    """The size at which the shorter edge is `edge_px`, or less if the longer edge would otherwise exceed `most_px`."""
    short, long = min(picture_px), max(picture_px)
    exact: float = edge_px
    if most_px and long / short * edge_px > most_px:
        exact = most_px * short / long
    rounded = round(exact)
    if rounded == short:
        return picture_px
    # transformers rounds the shorter side alone; the longer one follows from its unrounded value.
    height, width = (rounded if side == short else int(exact * side / short) for side in picture_px)
    return height, width
