"""Pruning and merging of boxes, as in ObjectSeeker (Xiang et al., IEEE S&P 2023, Algorithm 1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.formats.coco import Detection

Floats = npt.NDArray[np.float64]

CLUSTER_DISTANCE = 0.1
"""Largest distance, 1 minus the larger overlap, of two boxes that are merged (the authors' DBSCAN)."""


def overlap_shares(boxes: Floats, others: Floats) -> Floats:
    """Returns the share of each box's area that each other box covers (intersection over area), (N, M) in 0..1.

    A box without area has a share of 0.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        others: (M, 4) left, top, right, bottom.
    """
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(axis=2)
    areas = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)[:, None]
    return np.asarray(np.divide(shared, areas, out=np.zeros_like(shared), where=areas > 0))


def pruned(masked: Sequence[Detection], base: Sequence[Detection], least_share: float) -> list[Detection]:
    """Returns the masked boxes that no base box explains: those of which each base box covers less than a share.

    Classes are not compared, as in the authors' default, since a patch may also change the class.

    Args:
        masked: boxes from masked pictures.
        base: boxes from the whole picture.
        least_share: a masked box is removed if a base box covers at least this share of its area.
    """
    if not masked or not base:
        return list(masked)
    largest = overlap_shares(_boxes(masked), _boxes(base)).max(axis=1)
    return [one for one, share in zip(masked, largest, strict=True) if share < least_share]


def merged(boxes: Sequence[Detection]) -> list[Detection]:
    """Returns one box for each cluster of boxes: the smallest box around them, with the largest score.

    Two boxes are in one cluster if a chain of boxes leads from one to the other in which each covers at least 90 % of
    the next, or the next of it. This is DBSCAN with one sample per core point. The class is that of the first box.

    Args:
        boxes: boxes from masked pictures, in any order.
    """
    from scipy.sparse.csgraph import connected_components

    if not boxes:
        return []
    corners = _boxes(boxes)
    shares = overlap_shares(corners, corners)
    count, labels = connected_components(1 - np.maximum(shares, shares.T) <= CLUSTER_DISTANCE, directed=False)
    found = []
    for number in range(count):
        members = [boxes[i] for i in np.flatnonzero(labels == number).tolist()]
        own = corners[labels == number]
        left, top = own[:, :2].min(axis=0).tolist()
        right, bottom = own[:, 2:].max(axis=0).tolist()
        found.append(
            Detection(
                category_id=members[0].category_id,
                box_px=(left, top, right, bottom),
                score=max(one.score for one in members),
            )
        )
    return found


def _boxes(detections: Sequence[Detection]) -> Floats:
    return np.array([one.box_px for one in detections], np.float64).reshape(-1, 4)
