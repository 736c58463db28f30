"""Matches labels and detections of one picture by the rules of KITTI's devkit, for many score thresholds at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from gear.formats.kitti_object import KittiLabel, to_edge_pixels
from gear.metrics.boxes import intersection_over_first, iou_2d, iou_ground_and_space
from gear.values.geometry import Array
from gear.values.ground_truth import BoxPx
from gear.values.picture_objects import PictureDetection

Bools = npt.NDArray[np.bool_]
Overlap = Literal["2d", "bev", "3d"]
OVERLAPS: tuple[Overlap, ...] = ("2d", "bev", "3d")

NEIGHBOURS = {"Car": "Van", "Pedestrian": "Person_sitting", "Cyclist": ""}
"""Similar type of each class, "" for none. Labels of the similar type are ignored: detecting such an object is
neither a hit nor a false alarm.
"""

MIN_OVERLAP = {"Car": 0.7, "Pedestrian": 0.5, "Cyclist": 0.5}

LOOSE_OVERLAP = {"Car": 0.5, "Pedestrian": 0.25, "Cyclist": 0.25}
"""Smallest IoU of footprints for a match, by class, in the looser set of thresholds of kitti-object-eval-python,
which papers also report.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difficulty:
    """The limits of one of KITTI's difficulties. Labels beyond a limit are ignored.

    Attributes:
        name: `easy`, `moderate` or `hard`.
        min_height_px: smallest height of the 2D box.
        max_occluded: largest occlusion level, 0 (fully visible) to 3.
        max_truncated: largest share of the object outside the picture, 0..1.
    """

    name: str
    min_height_px: float
    max_occluded: int
    max_truncated: float


DIFFICULTIES = (
    Difficulty(name="easy", min_height_px=40, max_occluded=0, max_truncated=0.15),
    Difficulty(name="moderate", min_height_px=25, max_occluded=1, max_truncated=0.30),
    Difficulty(name="hard", min_height_px=25, max_occluded=2, max_truncated=0.50),
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PictureBoxes:
    """Labels and detections of one picture with their overlaps.

    Attributes:
        labels: all labels except DontCare regions.
        detections: all detections, each with a score.
        overlaps: (labels, detections) intersections over union, by kind of overlap (`2d`, `bev`, `3d`).
        in_dont_care: (detections,) largest share of the detection's 2D box that lies in a single DontCare region.
        in_ignored: (detections,) largest share of the detection's 2D box that lies in a single ignored box. Unlike
            DontCare regions, ignored boxes count for footprints and 3D boxes, too.
    """

    labels: tuple[KittiLabel, ...]
    detections: tuple[KittiLabel, ...]
    overlaps: dict[Overlap, Array]
    in_dont_care: Array
    in_ignored: Array


def picture_boxes(
    labels: Sequence[KittiLabel], detections: Sequence[KittiLabel], ignored_px: Sequence[BoxPx] = ()
) -> PictureBoxes:
    """Computes the overlaps of all labels and detections of a picture.

    Args:
        labels: labels, including DontCare regions.
        detections: detections, each with a score.
        ignored_px: 2D boxes in index pixels; a detection that lies in such a box is no false alarm, for any kind of
            overlap.
    """
    things = tuple(label for label in labels if label.type != "DontCare")
    regions = _boxes_px([label for label in labels if label.type == "DontCare"])
    found = tuple(detections)
    ground, space = iou_ground_and_space(_boxes_m(things), _boxes_m(found))
    return PictureBoxes(
        labels=things,
        detections=found,
        overlaps={"2d": iou_2d(_boxes_px(things), _boxes_px(found)), "bev": ground, "3d": space},
        in_dont_care=_largest_share(_boxes_px(found), regions),
        in_ignored=_largest_share(_boxes_px(found), np.array(ignored_px, dtype=np.float64).reshape(-1, 4)),
    )


def picture_detections(detections: Sequence[KittiLabel]) -> tuple[PictureDetection, ...]:
    """Reduces KITTI's detections to class, 2D box (edge pixels) and score.

    Args:
        detections: KITTI's detections, with boxes in index pixels.
    """
    return tuple(
        PictureDetection(label=one.type, box_px=to_edge_pixels(one.box_px), score=one.score or 0.0)
        for one in detections
    )


def is_in_place(labels: Sequence[KittiLabel], detections: Sequence[KittiLabel]) -> Bools:
    """The (N, M) bool mask of the N labels and M detections whose footprints overlap by at least `LOOSE_OVERLAP`
    of the label's class.

    Args:
        labels: N labels.
        detections: M detections.
    """
    ground, _ = iou_ground_and_space(_boxes_m(labels), _boxes_m(detections))
    least = np.array([LOOSE_OVERLAP[label.type] for label in labels])
    return np.asarray(ground >= least[:, None])


def _largest_share(boxes_px: Array, regions_px: Array) -> Array:
    """(N,) largest share of each box that lies in one region."""
    return np.asarray(intersection_over_first(boxes_px, regions_px).max(axis=1, initial=0.0))


def _boxes_px(labels: Sequence[KittiLabel]) -> Array:
    return np.array([label.box_px for label in labels], dtype=np.float64).reshape(-1, 4)


def _boxes_m(labels: Sequence[KittiLabel]) -> Array:
    rows = [(t.height_m, t.width_m, t.length_m, *t.location_m, t.rotation_y_rad) for t in labels]
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Chosen:
    """Labels and detections of one picture, sorted for one class at one difficulty into counted, ignored and other
    ones.

    Attributes:
        label_state: (labels,) 0 for labels that count, 1 for ignored labels, -1 for labels of other classes.
        detection_state: (detections,) 0 for detections that count, 1 for ignored detections, -1 for those of other
            classes.
        scores: (detections,) scores.
        overlaps: (labels, detections) intersections over union.
        angle_gain: (labels, detections) (1 + cos of the difference of alpha) / 2.
        is_ignored: (detections,) whether the detection lies in a DontCare region or an ignored box, and is no false
            alarm.
        min_overlap: smallest overlap of a match.
    """

    label_state: npt.NDArray[np.int8]
    detection_state: npt.NDArray[np.int8]
    scores: Array
    overlaps: Array
    angle_gain: Array
    is_ignored: Bools
    min_overlap: float


def choose(
    picture: PictureBoxes,
    kind: str,
    difficulty: Difficulty,
    overlap: Overlap,
    *,
    min_overlap: float | None = None,
    max_distance_m: float = np.inf,
) -> Chosen:
    """Sorts the labels and detections of a picture into those that count, those that are ignored, and those of
    other classes.

    Args:
        picture: labels and detections.
        kind: class of object.
        difficulty: the limits of the difficulty.
        overlap: kind of overlap: of 2D boxes, of footprints, or of 3D boxes.
        min_overlap: smallest overlap of a match; the benchmark's by default.
        max_distance_m: labels and detections that are farther ahead are ignored.
    """
    label_state = np.full(len(picture.labels), -1, dtype=np.int8)
    for i, label in enumerate(picture.labels):
        hard = (
            label.occluded > difficulty.max_occluded
            or label.truncated > difficulty.max_truncated
            or label.box_px[3] - label.box_px[1] <= difficulty.min_height_px
            or label.location_m[2] > max_distance_m
        )
        if label.type == kind:
            label_state[i] = 1 if hard else 0
        elif label.type == NEIGHBOURS[kind]:
            label_state[i] = 1
    detection_state = np.full(len(picture.detections), -1, dtype=np.int8)
    for j, found in enumerate(picture.detections):
        # The devkit holds the height in an integer, and looks at it before it looks at the type.
        if int(abs(found.box_px[3] - found.box_px[1])) < difficulty.min_height_px:
            detection_state[j] = 1
        elif found.type == kind:
            detection_state[j] = 1 if found.location_m[2] > max_distance_m else 0
    label_alpha = np.array([label.alpha_rad for label in picture.labels])
    found_alpha = np.array([found.alpha_rad for found in picture.detections])
    return Chosen(
        label_state=label_state,
        detection_state=detection_state,
        scores=np.array([found.score if found.score is not None else 1.0 for found in picture.detections]),
        overlaps=picture.overlaps[overlap],
        angle_gain=np.asarray((1 + np.cos(label_alpha[:, None] - found_alpha[None])) / 2),
        # DontCare regions have no place in space, so they excuse in the picture alone.
        is_ignored=((picture.in_dont_care > MIN_OVERLAP[kind]) & (overlap == "2d"))
        | (picture.in_ignored > MIN_OVERLAP[kind]),
        min_overlap=MIN_OVERLAP[kind] if min_overlap is None else min_overlap,
    )


def matched_scores(chosen: Chosen) -> list[float]:
    """The scores of the detections that match a label when no score threshold is applied. Each label takes the
    detection with the highest score.

    Args:
        chosen: labels and detections of one picture, sorted by `choose`.
    """
    taken = np.zeros(len(chosen.scores), dtype=np.bool_)
    scores = []
    for i in np.flatnonzero(chosen.label_state >= 0):
        candidates = (chosen.detection_state >= 0) & ~taken & (chosen.overlaps[i] > chosen.min_overlap)
        if not candidates.any():
            continue
        j = int(np.argmax(np.where(candidates, chosen.scores, -np.inf)))
        taken[j] = True
        if chosen.label_state[i] == 0 and chosen.detection_state[j] == 0:
            scores.append(float(chosen.scores[j]))
    return scores


@dataclass(slots=True, eq=False, kw_only=True)
class Counts:
    """Counts at each of T score thresholds; each array is (T,).

    Attributes:
        tp: detections that match a label that counts (true positives).
        fp: false alarms.
        fn: labels that count and match no detection (misses).
        similarity: sum over the true positives of their orientation similarity, 0..1 each.
    """

    tp: Array
    fp: Array
    fn: Array
    similarity: Array


def count(chosen: Chosen, thresholds: Array) -> Counts:
    """Matches the labels and detections of one picture at every score threshold, and counts the results. Each
    label takes the detection that overlaps it most.

    Args:
        chosen: labels and detections of one picture, sorted by `choose`.
        thresholds: (T,) smallest scores of the detections that take part.
    """
    size = len(thresholds)
    kept = (chosen.scores[None] >= thresholds[:, None]) & (chosen.detection_state >= 0)[None]
    taken = np.zeros_like(kept)
    counts = Counts(tp=np.zeros(size), fp=np.zeros(size), fn=np.zeros(size), similarity=np.zeros(size))
    rows = np.arange(size)
    for i in np.flatnonzero(chosen.label_state >= 0):
        candidates = kept & ~taken & (chosen.overlaps[i] > chosen.min_overlap)[None]
        proper = candidates & (chosen.detection_state == 0)[None]
        # Too small a detection is taken only where no proper one is; the first one then.
        best = np.argmax(np.where(proper, chosen.overlaps[i][None], -1.0), axis=1) if kept.shape[1] else rows * 0
        has_proper, has_any = proper.any(axis=1), candidates.any(axis=1)
        if kept.shape[1]:
            best = np.where(has_proper, best, np.argmax(candidates, axis=1))
            taken[rows[has_any], best[has_any]] = True
        if chosen.label_state[i] == 0:
            counts.tp += has_proper
            counts.fn += ~has_any
            counts.similarity[has_proper] += chosen.angle_gain[i, best[has_proper]]
    wrong = kept & ~taken & (chosen.detection_state == 0)[None] & ~chosen.is_ignored[None]
    counts.fp += wrong.sum(axis=1)
    return counts
