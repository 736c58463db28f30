"""Drawn pictures with objects, detections and a patch, which tests of objects share."""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from gear.metrics.patch_distance import PatchArea
from gear.values.picture_objects import PictureDetection, PictureObject, PictureObjects, PictureOutcomes

Box = tuple[float, float, float, float]
SIZE = 60
KINDS = ["car", "person"]
NO_PATCH = PatchArea(np.zeros((SIZE, SIZE), np.bool_))


def area() -> PatchArea:
    mask = np.zeros((SIZE, SIZE), np.bool_)
    mask[20:40, 25:50] = True
    return PatchArea(mask, [(0.0, 0.0, 10.0)])


def thing(number: int, label: str, box_px: Box) -> PictureObject:
    return PictureObject(object_id=number, label=label, box_px=box_px, position_m=(0.0, 3.0, 6.0))


def said(label: str, box_px: Box, score: float = 0.9) -> PictureDetection:
    return PictureDetection(label=label, box_px=box_px, score=score)


def picture(objects: Any, detections: Any, ignored: Any = (), in_place: Any = None) -> PictureObjects:
    return PictureObjects(
        camera="left", objects=tuple(objects), detections=tuple(detections), ignored_px=tuple(ignored),
        is_in_place=None if in_place is None else np.array(in_place, np.bool_).reshape(len(objects), len(detections)),
    )  # fmt: skip


def states(seen: PictureOutcomes) -> list[str]:
    return [one.state for one in seen.objects]


def iou(a: Box, b: Box) -> float:
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    shared = max(0.0, width) * max(0.0, height)
    return shared / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - shared)


def share_inside(box: Box, region: Box) -> float:
    width, height = min(box[2], region[2]) - max(box[0], region[0]), min(box[3], region[3]) - max(box[1], region[1])
    return max(0.0, width) * max(0.0, height) / ((box[2] - box[0]) * (box[3] - box[1]))


def drawn(seed: int, twin: int = 0) -> PictureObjects:
    """Objects, detections near them or anywhere, and ignored boxes; twins differ in their detections alone."""
    draw = random.Random(seed)

    def box() -> Box:
        left, top = draw.uniform(0, 50), draw.uniform(0, 50)
        return left, top, left + draw.uniform(4, 25), top + draw.uniform(4, 25)

    objects = [thing(number, draw.choice(KINDS), box()) for number in range(draw.randint(0, 6))]
    ignored = [box() for _ in range(draw.randint(0, 2))]
    draw.seed(1000 * seed + twin)
    near = [
        [tuple(side + draw.gauss(0, 2) for side in what.box_px) for _ in range(draw.randint(0, 2))] for what in objects
    ]
    places: list[Any] = [one for some in near for one in some if one[2] > one[0] + 1 and one[3] > one[1] + 1]
    places += [box() for _ in range(draw.randint(0, 4))]
    detections = [said(draw.choice(KINDS), place, draw.random()) for place in places]
    return picture(objects, detections, ignored)
