"""The outcome of each object of a picture (found, misclassified, moved or missed), and the role of each detection.

Only confident detections count, those with a score of at least 0.5. The errors are those of TIDE (Bolya et al., "TIDE:
A General Toolbox for Identifying Object Detection Errors", ECCV 2020), with its thresholds of IoU, 0.5 and 0.1. Each
detection explains at most one object. In three rounds, each detection, by decreasing score, chooses the object with the
largest overlap among those that no detection has chosen yet:

1. an object of its class, at an IoU of at least 0.5: the object is `found`, or, where the detection has another
   position in space, `moved`. This is the matching of `found_share` (`gear.metrics.single_picture`);
2. an object of another class, at an IoU of at least 0.5: `misclassified` (TIDE's classification error);
3. an object of its class, at an IoU of at least 0.1: `moved` (TIDE's localisation error).

An object that no detection chooses is `missed`. A detection that chooses no object is a `duplicate` if it overlaps any
object by at least 0.5, else `ignored` if at least half of it lies in an ignored box, else `background`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from gear.metrics.boxes import intersection_over_first, iou_2d
from gear.metrics.patch_distance import PatchArea
from gear.metrics.single_picture import MIN_OVERLAP, SURE
from gear.values.geometry import Array
from gear.values.ground_truth import BoxPx
from gear.values.picture_objects import (
    DetectionOutcome,
    DetectionRole,
    ObjectOutcome,
    ObjectState,
    PictureDetection,
    PictureObjects,
    PictureOutcomes,
)

LEAST_OVERLAP = 0.1
"""Smallest IoU at which a detection of the object's class explains the object. Below an IoU of 0.5 the object
counts as `moved`.
"""


def outcomes(picture: PictureObjects, patch: PatchArea) -> PictureOutcomes:
    """Determines the outcome of each object of a picture, and the role of each confident detection.

    Args:
        picture: objects and detections of one view.
        patch: visible patches of the same view.

    Returns:
        One outcome per object, and one per detection with a score of at least 0.5.
    """
    order = np.argsort([-one.score for one in picture.detections], kind="stable")
    sure = [int(index) for index in order if picture.detections[index].score >= SURE]
    found = [picture.detections[index] for index in sure]
    boxes_px = _boxes([one.box_px for one in found])
    overlaps = iou_2d(boxes_px, _boxes([thing.box_px for thing in picture.objects]))
    is_same = np.array([[one.label == thing.label for thing in picture.objects] for one in found], np.bool_)
    is_same = is_same.reshape(overlaps.shape)
    fitting = _choose(np.where(is_same, overlaps, 0.0), MIN_OVERLAP, {})
    wrong = _choose(np.where(is_same, 0.0, overlaps), MIN_OVERLAP, fitting)
    near = _choose(np.where(is_same, overlaps, 0.0), LEAST_OVERLAP, fitting | wrong)
    roles: dict[int, DetectionRole] = {}
    roles.update(dict.fromkeys(wrong, "misclassified"))
    roles.update(dict.fromkeys(near, "moved"))
    for detection, thing in fitting.items():
        is_here = picture.is_in_place is None or picture.is_in_place[thing, sure[detection]]
        roles[detection] = "found" if is_here else "moved"
    is_ignored = intersection_over_first(boxes_px, _boxes(picture.ignored_px)).max(axis=1, initial=0.0) >= MIN_OVERLAP
    for detection in range(len(found)):
        if detection not in roles:
            is_double = overlaps[detection].max(initial=0.0) >= MIN_OVERLAP
            roles[detection] = "duplicate" if is_double else "ignored" if is_ignored[detection] else "background"
    explained = {thing: detection for detection, thing in (fitting | wrong | near).items()}
    return PictureOutcomes(
        objects=tuple(
            _object(picture, number, found, roles, explained.get(number), patch)
            for number in range(len(picture.objects))
        ),
        detections=tuple(
            DetectionOutcome(
                label=one.label,
                box_px=one.box_px,
                score=one.score,
                role=roles[number],
                is_false_alarm=number not in fitting and not is_ignored[number],
                patch=patch.distance(one.box_px),
            )
            for number, one in enumerate(found)
        ),
    )


def _object(
    given: PictureObjects,
    number: int,
    found: list[PictureDetection],
    roles: dict[int, DetectionRole],
    detection: int | None,
    patch: PatchArea,
) -> ObjectOutcome:
    """What became of one object, and the detection that explains it."""
    thing, state = given.objects[number], "missed" if detection is None else roles[detection]
    return ObjectOutcome(
        object_id=thing.object_id,
        label=thing.label,
        box_px=thing.box_px,
        state=cast(ObjectState, state),
        detected_as=None if detection is None else found[detection].label,
        score=None if detection is None else found[detection].score,
        patch=patch.distance(thing.box_px, thing.position_m),
    )


def _choose(overlaps: Array, least: float, taken: dict[int, int]) -> dict[int, int]:
    """One round of choices: numbers of objects by the numbers of the detections that choose them.

    Args:
        overlaps: (M, N) of the detections, surest first, with the objects that they may choose, else 0.
        least: overlap that a choice needs.
        taken: the choices of earlier rounds.
    """
    free = np.ones(overlaps.shape[1], dtype=np.bool_)
    free[list(taken.values())] = False
    chosen: dict[int, int] = {}
    for detection in range(len(overlaps)):
        there = np.where(free, overlaps[detection], 0.0)
        if detection not in taken and there.max(initial=0.0) >= least:
            thing = int(np.argmax(there))
            chosen[detection], free[thing] = thing, False
    return chosen


def _boxes(boxes_px: Sequence[BoxPx]) -> Array:
    return np.array(boxes_px, dtype=np.float64).reshape(-1, 4)
