"""Boxes by the convention of the first Faster R-CNN: right and bottom are the last pixels inside, a side is right -
left + 1.

All boxes are (…, 4): left, top, right, bottom.
"""

from __future__ import annotations

import torch
from torch import Tensor

MOST_GROWTH = 4.135
"""Largest logarithm of the size ratio of box and anchor: of 1000 / 16, as in later networks."""


def sides(boxes: Tensor) -> Tensor:
    """(…, 2) width and height in pixels."""
    return boxes[..., 2:] - boxes[..., :2] + 1


def encode(boxes: Tensor, anchors: Tensor) -> Tensor:
    """(…, 4) codes: shift of the centre in units of the anchor's sides (x, y), and logarithm of the size ratio (width,
    height).
    """
    own, wanted = sides(anchors), sides(boxes)
    middle, target = anchors[..., :2] + own / 2, boxes[..., :2] + wanted / 2
    return torch.cat([(target - middle) / own, (wanted / own).log()], dim=-1)


def decode(codes: Tensor, anchors: Tensor) -> Tensor:
    """The boxes of codes. As in the original code this is not the exact inverse of `encode`: right and bottom are one
    pixel larger.
    """
    own = sides(anchors)
    middle = anchors[..., :2] + own / 2 + codes[..., :2] * own
    half = codes[..., 2:].clamp(max=MOST_GROWTH).exp() * own / 2
    return torch.cat([middle - half, middle + half], dim=-1)


def clip(boxes: Tensor, size_px: tuple[int, int]) -> Tensor:
    """Boxes clipped to a picture of (height, width)."""
    most = boxes.new_tensor([size_px[1] - 1, size_px[0] - 1] * 2)
    return torch.minimum(boxes.clamp(min=0), most)


def overlaps(a: Tensor, b: Tensor) -> Tensor:
    """(N, M) intersection over union of (N, 4) and (M, 4)."""
    low = torch.maximum(a[:, None, :2], b[None, :, :2])
    high = torch.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = (high - low + 1).clamp(min=0).prod(dim=-1)
    return shared / (sides(a).prod(dim=-1)[:, None] + sides(b).prod(dim=-1)[None] - shared)


def left_and_right(six: Tensor) -> tuple[Tensor, Tensor]:
    """Two (…, 4) codes from (…, 6): x, y, width, height of the left box, x and width of the right box.

    The pair is rectified, so both boxes have the same rows.
    """
    return six[..., :4], six[..., [4, 1, 5, 3]]
