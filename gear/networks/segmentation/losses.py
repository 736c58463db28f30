"""Losses of semantic segmentation, over Cityscapes train ids."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.cityscapes import IGNORED_TRAIN_ID, LABELS

TRAIN_ID_OF_LABEL_ID: npt.NDArray[np.uint8] = np.full(256, IGNORED_TRAIN_ID, dtype=np.uint8)
TRAIN_ID_OF_LABEL_ID[[label.id for label in LABELS]] = [label.train_id for label in LABELS]


class SegmentedSample(Protocol):
    """Protocol of the samples that the losses accept: they have label ids."""

    @property
    def label_ids(self) -> npt.NDArray[np.uint8]:
        """The (H, W) uint8 Cityscapes label ids of the picture."""
        ...


def train_ids(samples: Sequence[SegmentedSample], device: torch.device) -> Tensor:
    """Returns the (B, H, W) int64 Cityscapes train ids of samples; 255 for labels that are not evaluated.

    Args:
        samples: the B samples, of one size.
        device: torch device of the result.
    """
    labels = (np.ascontiguousarray(sample.label_ids) for sample in samples)
    ids = np.stack([cv2.LUT(one, TRAIN_ID_OF_LABEL_ID) for one in labels])
    return torch.from_numpy(ids).to(device).long()


STEP_PX = 2
"""Step of the pixels on which training computes the loss: every second pixel of every second row. The logit maps
at 1/8 hold little more detail, and the loss takes a quarter of the time.
"""


def offsets_px(index: int) -> tuple[int, int]:
    """Returns row and column of the first pixel on which training computes the loss, 0 or 1 each.

    Four consecutive pictures together cover every pixel position.

    Args:
        index: number of the picture in its batch.
    """
    return index // STEP_PX % STEP_PX, index % STEP_PX


def sampled_logits(maps: Tensor, size_px: Sequence[int], *, align_corners: bool) -> Tensor:
    """Interpolates logit maps bilinearly, only at the pixels on which training computes the loss.

    The values equal those of interpolation to the full size.

    Args:
        maps: (B, C, h, w) float.
        size_px: height H and width W of the pictures, at least `STEP_PX` each.
        align_corners: True if the centres of the outermost cells and pixels coincide, False if their outer borders do.

    Returns:
        (B, C, H // STEP_PX, W // STEP_PX).
    """
    grids = []
    for index in range(len(maps)):
        axes = []
        for side, first in zip(size_px, offsets_px(index), strict=True):
            pixels = first + STEP_PX * torch.arange(side // STEP_PX, dtype=maps.dtype, device=maps.device)
            axes.append(pixels * 2 / (side - 1) - 1 if align_corners else (pixels * 2 + 1) / side - 1)
        rows, columns = torch.meshgrid(*axes, indexing="ij")
        grids.append(torch.stack([columns, rows], dim=-1))
    return functional.grid_sample(maps, torch.stack(grids), padding_mode="border", align_corners=align_corners)


def sampled_ids(ids: Tensor) -> Tensor:
    """Returns the class ids at the pixels of `sampled_logits`: (B, H // STEP_PX, W // STEP_PX).

    Args:
        ids: (B, H, W) class ids.
    """
    height, width = (side // STEP_PX * STEP_PX for side in ids.shape[1:])
    chosen = []
    for index, one in enumerate(ids):
        row, column = offsets_px(index)
        chosen.append(one[row::STEP_PX, column::STEP_PX][: height // STEP_PX, : width // STEP_PX])
    return torch.stack(chosen)


def hard_cross_entropy(
    logits: Tensor, ids: Tensor, *, easy: float, min_share: float, weights: Sequence[float] = ()
) -> Tensor:
    """Mean cross-entropy over hard pixels: online hard example mining (Shrivastava et al., arXiv 1604.03540), applied
    to pixels.

    A pixel counts if the probability of its correct class is below `easy`. If fewer than the share `min_share` of all
    pixels count, the pixels with the largest losses count up to that share.

    Args:
        logits: (B, C, H, W).
        ids: (B, H, W) int64 class of each pixel; 255 is ignored.
        easy: probability, 0..1; with 1 every pixel counts.
        min_share: smallest share of the pixels that count, 0..1, without the ignored ones.
        weights: weight of each of the C classes in the mean; () for equal weights.

    Returns:
        Scalar; 0 if no pixel has a class.
    """
    each = functional.cross_entropy(logits, ids, ignore_index=IGNORED_TRAIN_ID, reduction="none").flatten()
    known = (ids != IGNORED_TRAIN_ID).flatten()
    with torch.no_grad():
        ranked = each.masked_fill(~known, -1.0)
        fewest = math.ceil(min_share * int(known.sum()))
        hard = ranked >= -math.log(easy)
        if int(hard.sum()) < fewest:
            hard = ranked >= ranked.topk(fewest).values[-1]
    if not weights:
        return (each * hard).sum() / hard.sum().clamp_min(1)
    weight = logits.new_tensor([*weights, 0.0])[ids.flatten().clamp_max(len(weights))] * hard
    return (each * weight).sum() / weight.sum().clamp_min(torch.finfo(logits.dtype).tiny)


SHARES = (
    0.278, 0.101, 0.199, 0.0050, 0.0045, 0.0071, 0.0003, 0.0023, 0.054, 0.046, 0.250, 0.0031, 0.0004, 0.0083, 0.0035,
    0.0021, 0.0, 0.0003, 0.0002,
)  # fmt: skip
"""Share of the pixels, 0..1, that belong to each train id, measured on 1005 pictures of gear's towns."""

BALANCED: tuple[float, ...] = tuple(math.log(1.02 + share) ** -0.5 for share in SHARES)
"""Weight of each class in the loss, from 2 (road) to 7: the square root of the class weight of Paszke et al.,
"ENet", arXiv 1606.02147, section 5.2. The root is taken because hard example mining already leaves out most
pixels of frequent classes.
"""


class SegmentationLosses:
    """Computes the cross-entropy over hard pixels (`hard_cross_entropy`) for the main head and for each auxiliary
    head.

    Auxiliary heads are additional outputs of a network that exist only in training.

    Attributes:
        easy: probability of the correct class, 0..1; pixels below it count as hard.
        least: smallest share of the pixels that count, 0..1.
        auxiliary_weight: weight of each auxiliary head in the sum that training minimises.
        weights: weight of each of the 19 classes; () for equal weights.
    """

    def __init__(
        self, *, easy: float, least: float, auxiliary_weight: float, weights: Sequence[float] = BALANCED
    ) -> None:
        self.easy, self.least, self.auxiliary_weight, self.weights = easy, least, auxiliary_weight, tuple(weights)

    def __call__(self, outputs: Mapping[str, Tensor], targets: Sequence[SegmentedSample]) -> dict[str, Tensor]:
        """Computes the losses by name: `cross_entropy` for the output `logits`, and one weighted loss for each
        auxiliary head.

        Args:
            outputs: (B, 19, H, W) logits by name, at the size of the labels or as `sampled_logits` returns them.
            targets: the samples of the batch.
        """
        ids = train_ids(targets, outputs["logits"].device)
        if outputs["logits"].shape[2:] != ids.shape[1:]:
            ids = sampled_ids(ids)
        losses = {}
        for name, logits in outputs.items():
            loss = hard_cross_entropy(logits, ids, easy=self.easy, min_share=self.least, weights=self.weights)
            if name == "logits":
                losses["cross_entropy"] = loss
            else:
                losses[name] = self.auxiliary_weight * loss
        return losses
