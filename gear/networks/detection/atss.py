"""ATSS: which cells of a dense detector are trained on which object.

Source: Zhang et al., Bridging the Gap Between Anchor-based and Anchor-free Detection via Adaptive Training Sample
Selection, 2020, algorithm 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

NEAREST = 9
"""Number of cells of each scale, nearest to an object's centre, that are candidates for it."""

BACKGROUND = -1


def assigned(boxes: Tensor, anchors: Tensor, counts: Sequence[int]) -> Tensor:
    """The object that each cell is trained on.

    Candidates are the nearest cells of each scale. Those are taken whose anchor's IoU with the object is at least the
    mean plus the standard deviation of all its candidates' IoU, and whose centre is inside the object. A cell of two
    objects is trained on the one with the larger IoU.

    Args:
        boxes: (M, 4) objects: left, top, right, bottom.
        anchors: (N, 4) square anchors around the cells' centres, in the same format, scale after scale.
        counts: number of cells of each scale; they sum to N.

    Returns:
        (N,) int64 index of the object, or -1 for background.
    """
    nothing = torch.full((len(anchors),), BACKGROUND, dtype=torch.int64, device=anchors.device)
    if not len(boxes):
        return nothing
    from torchvision.ops import box_iou

    iou = box_iou(boxes, anchors)
    centres = (anchors[:, :2] + anchors[:, 2:]) / 2
    distances = torch.cdist((boxes[:, :2] + boxes[:, 2:]) / 2, centres)
    candidates: list[Tensor] = []
    first = 0
    for count in counts:
        nearest = distances[:, first : first + count].topk(min(NEAREST, count), dim=1, largest=False).indices
        candidates.append(nearest + first)
        first += count
    chosen = torch.cat(candidates, dim=1)
    overlaps = iou.gather(1, chosen)
    least = overlaps.mean(dim=1, keepdim=True) + overlaps.std(dim=1, keepdim=True)
    inside = ((centres > boxes[:, None, :2]) & (centres < boxes[:, None, 2:])).all(dim=2).gather(1, chosen)
    accepted = torch.zeros_like(iou, dtype=torch.bool).scatter(1, chosen, (overlaps >= least) & inside)
    best, index = iou.masked_fill(~accepted, -1.0).max(dim=0)
    return torch.where(best >= 0, index, nothing)
