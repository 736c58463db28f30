"""Boxes in the convention of the first Faster R-CNN, which Stereo R-CNN uses.

Right and bottom are the last pixels inside the box, so a side has the length right - left + 1. All boxes are (…, 4):
left, top, right, bottom.
"""

from __future__ import annotations

import torch
from torch import Tensor

MOST_GROWTH = 4.135
"""Largest logarithm of the ratio between the sides of a box and of its anchor: log(1000 / 16), as in later networks."""


def sides(boxes: Tensor) -> Tensor:
    """Returns the (…, 2) widths and heights of boxes in pixels; a width is right - left + 1.

    Args:
        boxes: (…, 4) left, top, right, bottom.
    """
    return boxes[..., 2:] - boxes[..., :2] + 1


def encode(boxes: Tensor, anchors: Tensor) -> Tensor:
    """Returns the (…, 4) codes of boxes relative to anchors, which the network learns to predict.

    A code holds the shift of the centre (x, y) in units of the anchor's sides, and the logarithms of the size ratios
    (width, height) between box and anchor.

    Args:
        boxes, anchors: (…, 4) left, top, right, bottom.
    """
    own, wanted = sides(anchors), sides(boxes)
    middle, target = anchors[..., :2] + own / 2, boxes[..., :2] + wanted / 2
    return torch.cat([(target - middle) / own, (wanted / own).log()], dim=-1)


def decode(codes: Tensor, anchors: Tensor) -> Tensor:
    """Returns the (…, 4) boxes that codes relative to anchors describe.

    As in the authors' code, right and bottom are larger by one pixel than the exact inverse of `encode` would give.

    Args:
        codes: (…, 4) shift of the centre and logarithms of the size ratios, as in `encode`.
        anchors: (…, 4) left, top, right, bottom.
    """
    own = sides(anchors)
    middle = anchors[..., :2] + own / 2 + codes[..., :2] * own
    half = codes[..., 2:].clamp(max=MOST_GROWTH).exp() * own / 2
    return torch.cat([middle - half, middle + half], dim=-1)


def clip(boxes: Tensor, size_px: tuple[int, int]) -> Tensor:
    """Clips boxes to a picture; right and bottom are at most the last column and row.

    Args:
        boxes: (…, 4) left, top, right, bottom.
        size_px: height and width of the picture.
    """
    most = boxes.new_tensor([size_px[1] - 1, size_px[0] - 1] * 2)
    return torch.minimum(boxes.clamp(min=0), most)


def overlaps(a: Tensor, b: Tensor) -> Tensor:
    """Returns the (N, M) intersection over union of each of N boxes with each of M boxes.

    Args:
        a: (N, 4) left, top, right, bottom.
        b: (M, 4) left, top, right, bottom.
    """
    low = torch.maximum(a[:, None, :2], b[None, :, :2])
    high = torch.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = (high - low + 1).clamp(min=0).prod(dim=-1)
    return shared / (sides(a).prod(dim=-1)[:, None] + sides(b).prod(dim=-1)[None] - shared)


def left_and_right(six: Tensor) -> tuple[Tensor, Tensor]:
    """Splits codes of box pairs into (…, 4) codes of the left boxes and (…, 4) codes of the right boxes.

    Both boxes cover the same rows, because the pictures are rectified.

    Args:
        six: (…, 6) x, y, width, height of the left box, and x and width of the right box.
    """
    return six[..., :4], six[..., [4, 1, 5, 3]]
