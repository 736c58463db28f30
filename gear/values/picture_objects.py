"""Objects and detections of one picture, and their outcomes: which objects are detected, and which detections are
wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from gear.values.ground_truth import BoxPx
from gear.values.scene import Vec3

ObjectState = Literal["found", "misclassified", "moved", "missed"]

DetectionRole = Literal["found", "misclassified", "moved", "duplicate", "ignored", "background"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureObject:
    """An object of the ground truth that a detector should find.

    Attributes:
        object_id: id of the object, the same in every sample of a sequence and in twins (the same dataset with another
            patch).
        label: name of the object's class.
        box_px: 2D box in edge pixels.
        position_m: middle of the object in the camera's frame (x right, y down, z forward).
    """

    object_id: int
    label: str
    box_px: BoxPx
    position_m: Vec3


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureDetection:
    """One detection of a network.

    Attributes:
        label: name of the detected class.
        box_px: 2D box in edge pixels.
        score: confidence; higher is more certain.
    """

    label: str
    box_px: BoxPx
    score: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PictureObjects:
    """The objects that a detector should find in a picture, and the detector's detections.

    Attributes:
        camera: name of the view that boxes and positions belong to.
        objects: N objects.
        detections: M detections of any score.
        ignored_px: boxes, in edge pixels, in which a detection that matches no object is no false alarm.
        is_in_place: (N, M) bool: whether a detection that matches an object in the picture also matches it in 3D space;
            None for tasks without a third dimension.
    """

    camera: str
    objects: tuple[PictureObject, ...]
    detections: tuple[PictureDetection, ...]
    ignored_px: tuple[BoxPx, ...] = ()
    is_in_place: npt.NDArray[np.bool_] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchDistance:
    """The distance of an object or a detection from the patches in the picture.

    Attributes:
        is_on_patch: whether the centre of its box, or more than half of the box, lies on visible pixels of a patch.
        pixels: distance from its box to the nearest visible pixel of a patch; None if no patch is visible.
        metres: distance from its middle to the middle of the nearest visible patch; None if no patch is visible, and
            for detections.
    """

    is_on_patch: bool
    pixels: float | None
    metres: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectOutcome:
    """The outcome for one object: whether a network detected it, and how.

    Attributes:
        object_id, label, box_px: as in `PictureObject`.
        state: `found`, `misclassified`, `moved` or `missed`, as `gear.metrics.object_matching` defines them.
        detected_as: class of the detection that explains the state; None for a missed object.
        score: score of the detection that explains the state; None for a missed object.
        patch: distance of the object from the patch.
    """

    object_id: int
    label: str
    box_px: BoxPx
    state: ObjectState
    detected_as: str | None
    score: float | None
    patch: PatchDistance


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionOutcome:
    """The outcome for one confident detection: which role it has among the objects of the picture.

    Attributes:
        label, box_px, score: as in `PictureDetection`.
        role: `found`, `misclassified`, `moved`, `duplicate`, `ignored` or `background`, as
            `gear.metrics.object_matching` defines them.
        is_false_alarm: whether it matches no object of its class, and less than half of it lies in an ignored box.
        patch: distance of the detection from the patch.
    """

    label: str
    box_px: BoxPx
    score: float
    role: DetectionRole
    is_false_alarm: bool
    patch: PatchDistance


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureOutcomes:
    """The outcomes of all objects and all confident detections of one picture; JSON-ready.

    Attributes:
        objects: outcomes of the objects, in the order of the ground truth.
        detections: outcomes of the detections, by decreasing score.
    """

    objects: tuple[ObjectOutcome, ...]
    detections: tuple[DetectionOutcome, ...]
