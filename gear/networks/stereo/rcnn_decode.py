"""Converts Stereo R-CNN's raw outputs for box pairs to KITTI labels with scores."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from torch import Tensor

from gear.formats.kitti_object import Calibration, KittiLabel, clip_box, occlusion_level, truncation
from gear.groundtruth.boxes import Box3d, project_box
from gear.networks.stereo.alignment import Pair, align
from gear.networks.stereo.box_solver import Measured, solve_box
from gear.networks.stereo.legacy_boxes import clip, decode, left_and_right
from gear.networks.stereo.rcnn_losses import BOX_DEVIATION, CAR, SIZE_DEVIATION, SIZE_MEAN
from gear.networks.stereo.rcnn_proposals import legacy_nms

SAME_OVERLAP = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundCar:
    """One detected car after non-maximum suppression.

    Attributes:
        score: confidence, 0..1.
        measured: boxes, corner, size and heading, in index pixels of the original pictures.
    """

    score: float
    measured: Measured


def decode_cars(
    outputs: Mapping[str, Tensor], scale: float, size_px: tuple[int, int], score_threshold: float
) -> list[FoundCar]:
    """Converts the raw outputs for one picture to detected cars, highest score first.

    Args:
        outputs: outputs of the network for one picture, without the batch dimension.
        scale: factor from the original pictures to the network's input.
        size_px: height and width of the network's input.
        score_threshold: smallest score that is reported.
    """
    scores = outputs["class_logits"].softmax(dim=1)[:, 1]
    is_pair = (outputs["rois_left"][:, 2:] > outputs["rois_left"][:, :2]).all(dim=1)
    chosen = ((scores > score_threshold) & is_pair).nonzero()[:, 0]
    scores = scores[chosen]
    codes = outputs["box_codes"][chosen, 1]
    codes = codes * codes.new_tensor(BOX_DEVIATION)
    left_codes, right_codes = left_and_right(codes)
    anchors_left, anchors_right = outputs["rois_left"][chosen], outputs["rois_right"][chosen]
    left = clip(decode(left_codes, anchors_left), size_px)
    right = clip(decode(right_codes, anchors_right), size_px)
    body = outputs["size_and_direction"][chosen, 1]
    body = body * SIZE_DEVIATION + body.new_tensor(SIZE_MEAN)
    cells = outputs["keypoint_logits"].shape[-1]
    best = outputs["keypoint_logits"][chosen].flatten(1).argmax(dim=1)
    borders = outputs["border_logits"][chosen].argmax(dim=2)
    start, width = anchors_left[:, 0], anchors_left[:, 2] - anchors_left[:, 0] + 1
    corner_px = (best % cells) * width / cells + start
    borders_px = borders * width[:, None] / cells + start[:, None]
    found = []
    # In pixels of the original pictures, as in the authors' code. There the last pixel of a side has more weight.
    for i in legacy_nms(left / scale, scores, SAME_OVERLAP).tolist():
        box = [float(value) / scale for value in left[i]]
        width_m, height_m, length_m, sine, cosine = (float(value) for value in body[i])
        if min(width_m, height_m, length_m) <= 0:
            continue
        found.append(
            FoundCar(
                score=float(scores[i]),
                measured=Measured(
                    left_px=(box[0], box[1], box[2], box[3]),
                    right_sides_px=(float(right[i, 0]) / scale, float(right[i, 2]) / scale),
                    corner=int(best[i]) // cells,
                    corner_px=float(corner_px[i]) / scale,
                    borders_px=(float(borders_px[i, 0]) / scale, float(borders_px[i, 1]) / scale),
                    width_m=width_m,
                    height_m=height_m,
                    length_m=length_m,
                    alpha_rad=math.atan2(sine, cosine),
                ),
            )
        )
    return found


def place_car(
    car: FoundCar, calibration: Calibration, pair: Pair | None, aligned_bias_px: float = 0.0
) -> KittiLabel | None:
    """Computes the 3D box of a detected car: solves for the box, aligns its depth photometrically, and solves
    again with that depth.

    Args:
        car: a detected car.
        calibration: calibration of the original pictures.
        pair: the pictures; None skips the alignment.
        aligned_bias_px: value added to the aligned disparity.

    Returns:
        The car as a KITTI label; None if no box fits.
    """
    box = solve_box(car.measured, calibration)
    if box is None:
        return None
    depth_m = None if pair is None else align(pair, box, car.measured, calibration)
    if depth_m is not None:
        reach = calibration.intrinsics.focal_px * calibration.baseline_m
        depth_m = reach / (reach / depth_m + aligned_bias_px)
        box = solve_box(car.measured, calibration, depth_m) or box
    return _label(car, box, calibration)


def _label(car: FoundCar, box: Box3d, calibration: Calibration) -> KittiLabel | None:
    box_px = clip_box(car.measured.left_px, calibration.intrinsics)
    if box_px is None:
        return None
    whole = project_box(box.corners_m, calibration.intrinsics)
    clipped = clip_box(whole, calibration.intrinsics) if whole else None
    seen = (car.measured.borders_px[1] - car.measured.borders_px[0]) / (box_px[2] - box_px[0])
    return KittiLabel(
        type=CAR,
        truncated=truncation(whole, clipped) if whole and clipped else 1.0,
        occluded=occlusion_level(min(max(seen, 0.0), 1.0)),
        alpha_rad=box.alpha_rad,
        box_px=box_px,
        height_m=box.height_m,
        width_m=box.width_m,
        length_m=box.length_m,
        location_m=box.bottom_m,
        rotation_y_rad=box.rotation_y_rad,
        score=car.score,
    )
