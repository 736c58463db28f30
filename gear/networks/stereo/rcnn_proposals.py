"""Selects pairs of boxes from the outputs of Stereo R-CNN's region proposal network."""

from __future__ import annotations

import torch
from torch import Tensor

from gear.networks.stereo.legacy_boxes import clip, decode, left_and_right
from gear.networks.torchvision_ops import nms

SAME_OVERLAP = 0.7


def propose(
    chances: Tensor, codes: Tensor, anchors: Tensor, size_px: tuple[int, int], *, pre_nms_top_n: int, max_pairs: int
) -> tuple[Tensor, Tensor]:
    """Selects the best box pairs of one picture by non-maximum suppression; a pair is kept if both its left and
    its right box are kept.

    Gradients end here, as in the authors' network.

    Args:
        chances: (A,) probability that an anchor holds an object.
        codes: (A, 6) codes of the anchors' box pairs.
        anchors: (A, 4) anchors in pixels of the network's input.
        size_px: height and width of the network's input.
        pre_nms_top_n: number of anchors with the highest probability from which pairs are selected.
        max_pairs: largest number of pairs.

    Returns:
        (R, 4) left and (R, 4) right boxes, R <= `max_pairs`, best first.
    """
    with torch.no_grad():
        order = chances.argsort(descending=True, stable=True)[:pre_nms_top_n]
        left, right = (clip(decode(part, anchors[order]), size_px) for part in left_and_right(codes[order]))
        scores = chances[order]
        in_both = torch.ones(len(order), dtype=torch.bool, device=order.device)
        for boxes in (left, right):
            kept = torch.zeros_like(in_both)
            kept[legacy_nms(boxes, scores, SAME_OVERLAP)] = True
            in_both &= kept
        chosen = in_both.nonzero()[:max_pairs, 0]
        return left[chosen], right[chosen]


def legacy_nms(boxes: Tensor, scores: Tensor, most_overlap: float) -> Tensor:
    """Non-maximum suppression of boxes whose sides are right - left + 1.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        scores: (N,) scores.
        most_overlap: a box whose IoU with a kept box of higher score exceeds this is dropped.

    Returns:
        (K,) indices of the kept boxes, highest score first.
    """
    return nms(boxes + boxes.new_tensor([0, 0, 1, 1]), scores, most_overlap)
