"""The effect of a patch on the objects of a picture. The picture is compared, object by object, with its twin: the
same picture with another patch or without one.

Twins contain the same objects, which are identified by id and class. Only objects that are found in the twin are
compared. An object that is missed in the picture is `hidden`; an object that is detected wrongly there is
`misclassified` or `moved` (`gear.metrics.object_matching`). A detection on background is `invented` if the twin has no
confident detection of the same class that overlaps it by an IoU of at least 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from gear.metrics.boxes import iou_2d
from gear.metrics.single_picture import MIN_OVERLAP
from gear.values.ground_truth import BoxPx
from gear.values.picture_objects import ObjectOutcome, ObjectState, PatchDistance, PictureOutcomes

Change = Literal["hidden", "misclassified", "moved", "invented"]

CHANGES: tuple[Change, ...] = get_args(Change)

OF_OBJECTS: dict[ObjectState, Change] = {"missed": "hidden", "misclassified": "misclassified", "moved": "moved"}
"""Name of the change for an object that is found in the twin (the same picture with another patch), by the
object's state in the picture.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectChange:
    """An object or a detection that differs between a picture and its twin (the same picture with another patch);
    JSON-ready.

    Attributes:
        change: kind of the change: `hidden`, `misclassified`, `moved` or `invented`.
        object_id: id of the object; None for an invented detection.
        label: class of the object or of the invented detection.
        box_px: box of the object or of the invented detection, in edge pixels.
        detected_as: class of the detection that explains the change; None for a hidden object.
        score: score of that detection, or of the invented one.
        patch: distance of the object or of the invented detection from the patch.
    """

    change: Change
    object_id: int | None
    label: str
    box_px: BoxPx
    detected_as: str | None
    score: float | None
    patch: PatchDistance


def found_in_twin(patched: PictureOutcomes, twin: PictureOutcomes) -> tuple[ObjectOutcome, ...]:
    """The outcomes, in the picture `patched`, of the objects that are found in `twin`, the same picture with
    another patch.

    Args:
        patched: outcomes in the picture.
        twin: outcomes in its twin.

    Returns:
        In the order of the ground truth.
    """
    found = {(thing.object_id, thing.label) for thing in twin.objects if thing.state == "found"}
    return tuple(thing for thing in patched.objects if (thing.object_id, thing.label) in found)


def changes(patched: PictureOutcomes, twin: PictureOutcomes) -> tuple[ObjectChange, ...]:
    """Lists the changes from `twin` (the same picture with another patch) to `patched`: objects in the order of
    the ground truth, then invented detections by decreasing score.

    Args:
        patched: outcomes in the picture.
        twin: outcomes in its twin.
    """
    lost = [
        ObjectChange(
            change=OF_OBJECTS[thing.state],
            object_id=thing.object_id,
            label=thing.label,
            box_px=thing.box_px,
            detected_as=thing.detected_as,
            score=thing.score,
            patch=thing.patch,
        )
        for thing in found_in_twin(patched, twin)
        if thing.state != "found"
    ]
    invented = [
        ObjectChange(
            change="invented",
            object_id=None,
            label=one.label,
            box_px=one.box_px,
            detected_as=one.label,
            score=one.score,
            patch=one.patch,
        )
        for one in patched.detections
        if one.role == "background" and not _is_there(one.label, one.box_px, twin)
    ]
    return (*lost, *invented)


def _is_there(label: str, box_px: BoxPx, twin: PictureOutcomes) -> bool:
    """Whether a picture has a detection of a class at a place."""
    others = [one.box_px for one in twin.detections if one.label == label]
    overlaps = iou_2d(np.array([box_px]), np.array(others, dtype=np.float64).reshape(-1, 4))
    return bool(overlaps.max(initial=0.0) >= MIN_OVERLAP)
