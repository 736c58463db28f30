"""Measures how much a sample differs between twins: in its pictures, in the metrics of predictions, and in the objects
that are detected.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2

from gear.contracts.tasks import Sample
from gear.values.serial import Json
from gear.view.sources import Source


def picture_change(one: Sample, other: Sample) -> float | None:
    """Returns the mean absolute difference of the pictures of two samples, 0 (equal) to 1 (black and white), over all
    cameras together.

    Args:
        one: sample of one dataset.
        other: the same sample of a twin.

    Returns:
        The difference; None if no camera has pictures of the same size in both samples.
    """
    pairs = [
        (pixels, other.images[camera])
        for camera, pixels in one.images.items()
        if camera in other.images and other.images[camera].shape == pixels.shape
    ]
    total = sum(pixels.size for pixels, _ in pairs)
    if not total:
        return None
    return sum(float(cv2.absdiff(first, second).sum()) for first, second in pairs) / total / 255


def metrics_of(sources: Sequence[Source], index: int) -> Json:
    """Returns the metrics of the predictions for one sample: `{evaluation: {dataset: {metric: value}}}`.

    Args:
        sources: the datasets of the page with their evaluations.
        index: index of the sample.
    """
    found: dict[str, dict[str, Json]] = {}
    for source in sources:
        for part in source.evaluated:
            if index < len(part.metrics):
                found.setdefault(part.label, {})[source.label] = dict(part.metrics[index])
    return found


def object_changes(sources: Sequence[Source], index: int) -> list[Json]:
    """Returns the objects of one sample that are detected otherwise in one dataset of the page than in another.

    Each entry has the keys `evaluation`, `dataset`, `against` (labels), `change` (`hidden`, `misclassified`, `moved` or
    `invented`), `label`, `detected_as`, `score`, `box` (left, top, right, bottom in edge pixels) and `on_patch`.

    Args:
        sources: the datasets of the page with their evaluations.
        index: index of the sample.
    """
    labels = {(part.root, part.name): source.label for source in sources for part in source.evaluated}
    return [
        {
            "evaluation": part.label,
            "dataset": source.label,
            "against": labels[part.root, against],
            "change": one.change,
            "label": one.label,
            "detected_as": one.detected_as,
            "score": one.score,
            "box": [round(side, 1) for side in one.box_px],
            "on_patch": one.patch.is_on_patch,
        }
        for source in sources
        for part in source.evaluated
        for against, changes in part.changes.items()
        if (part.root, against) in labels
        for one in changes.get(index, [])
    ]
