"""The true patch area of a sample, and its agreement with the mask that a defense returns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Sample
from gear.formats import rle

Mask = npt.NDArray[np.bool_]

MARGIN_PX = 5
"""Distance from the patch, in pixels, up to which the report `outside_patch` also excludes pixels: light from the patch
and the network's smoothing reach them.
"""

MASK_METRICS = ("mask_iou", "mask_precision", "mask_recall", "mask_area")
"""Names of the metrics of masks. `mask_area` is the share of the pictures that the mask covers; the others compare
the mask with the patch.
"""

SURE = 0.5
"""Probability from which a pixel of a defense's mask counts as patch."""


def patch_masks(sample: Sample) -> dict[str, Mask]:
    """The (H, W) bool masks of the pixels of a sample that show a patch surface, by camera name.

    Args:
        sample: the sample; each of its cameras has a mask, which is all False if no surface is visible.
    """
    masks: dict[str, Mask] = {name: np.zeros(image.shape[:2], dtype=np.bool_) for name, image in sample.images.items()}
    for surface in sample.surfaces:
        if surface.visible_px:
            height, width = sample.images[surface.camera].shape[:2]
            masks[surface.camera] |= rle.decode(surface.mask_rle, height, width)
    return masks


def widened(masks: Mapping[str, Mask], margin_px: int = MARGIN_PX) -> dict[str, Mask]:
    """Dilates (H, W) bool masks, in all directions, by a distance in pixels.

    Args:
        masks: masks by camera name; they are not changed.
        margin_px: the distance.
    """
    size = 2 * margin_px + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return {name: cv2.dilate(mask.astype(np.uint8), disc).astype(np.bool_) for name, mask in masks.items()}


def mask_metrics(sample: Sample, masks: Mapping[str, Any]) -> dict[str, float]:
    """The agreement of a defense's mask with the true patch area, over the pixels of all cameras together.

    Args:
        sample: the sample with its ground truth.
        masks: the defense's mask, (H, W) in 0..1, by camera name.

    Returns:
        The metrics `MASK_METRICS` by name, in 0..1; NaN for a metric that is undefined, such as IoU without a patch.
    """
    truth = patch_masks(sample)
    real = np.concatenate([truth[name].reshape(-1) for name in masks])
    said = np.concatenate([np.asarray(mask).reshape(-1) >= SURE for mask in masks.values()])
    both, either = int((real & said).sum()), int((real | said).sum())
    there = bool(real.any())
    metrics = (
        both / either if there else float("nan"),
        both / int(said.sum()) if said.any() and there else float("nan"),
        both / int(real.sum()) if there else float("nan"),
        float(said.mean()),
    )
    return dict(zip(MASK_METRICS, metrics, strict=True))
