"""Converts outputs of the centre-based stereo network to KITTI labels with scores."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.kitti_object import Calibration, KittiLabel, clip_box, occlusion_level, truncation
from gear.groundtruth.boxes import Box3d, project_box
from gear.metrics.boxes import iou_2d
from gear.values.geometry import Array, Intrinsics, wrap_angle_rad

TRUSTED_M = 1.0
"""Tolerance of depth in metres. A detection's score is the geometric mean of three probabilities: that it is an
object, that its depth is right within this tolerance, and (for `LONG` kinds) that its axis is right.
"""

LONG = ("Car", "Van", "Truck", "Cyclist")
"""Kinds of objects whose 3D boxes overlap much less after a rotation, because they are longer than wide."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peaks:
    """Rules by which peaks of the centre map become detections.

    Attributes:
        most: largest number of detections in a picture.
        score_threshold: smallest score, 0..1, of a detection that is reported.
        same_overlap: IoU of the 2D boxes above which two detections are the same object, if their depths agree as well.
        same_depth: difference of the logarithms of two detections' depths below which their depths agree.
    """

    most: int = 50
    score_threshold: float = 0.02
    same_overlap: float = 0.6
    same_depth: float = 0.15


def decode(
    outputs: Mapping[str, Tensor],
    kinds: Sequence[str],
    calibration: Calibration,
    cell_px: tuple[float, float],
    peaks: Peaks,
) -> list[tuple[KittiLabel, ...]]:
    """Converts the outputs for a batch to the detections of each picture, highest score first.

    Args:
        outputs: result of `gear.networks.stereo.centre.CentreGraph.forward`, lengths in pixels of the picture.
        kinds: KITTI's object types in the order of the channels of `heat`.
        calibration: calibration of the stereo pair.
        cell_px: width and height of a cell in pixels of the picture.
        peaks: rules by which centres become detections.
    """
    intrinsics = calibration.intrinsics
    heat = outputs["heat"].sigmoid()
    any_kind, kind = heat.max(dim=1)
    is_peak = functional.max_pool2d(any_kind[:, None], 3, 1, 1)[:, 0] == any_kind
    chance = any_kind * is_peak
    count = min(peaks.most, chance[0].numel())
    found = []
    for batch in range(len(heat)):
        best, cells = chance[batch].reshape(-1).topk(count)
        cells = cells[best >= peaks.score_threshold]
        rows, columns = cells // chance.shape[2], cells % chance.shape[2]
        maps = {name: _plain(tensor[batch, :, rows, columns].T) for name, tensor in outputs.items()}
        chosen = [kinds[index] for index in kind[batch, rows, columns].tolist()]
        scores = _plain(chance[batch, rows, columns])
        middles_px = np.stack([_plain(columns) + 0.5, _plain(rows) + 0.5], axis=-1) * cell_px - 0.5
        depths_m = intrinsics.focal_px * calibration.baseline_m / maps["disparity_px"][:, 0]
        maps["middle_m"] = intrinsics.unproject(middles_px + maps["centre_px"], depths_m)
        maps["alpha_rad"], maps["line_chance"] = heading_rad(maps["heading_logits"])
        labels = [
            _label({name: values[i] for name, values in maps.items()}, chosen[i], scores[i], middles_px[i], intrinsics)
            for i in range(len(chosen))
        ]
        found.append(_apart([label for label in labels if label is not None], peaks))
    return found


def _plain(tensor: Tensor) -> Array:
    return np.asarray(tensor.to(torch.float64).cpu().numpy())


def _label(
    said: Mapping[str, Array], kind: str, chance: float, cell_middle_px: Array, intrinsics: Intrinsics
) -> KittiLabel | None:
    """One detection; None if its box lies outside the picture."""
    middle_m, alpha_rad = said["middle_m"].tolist(), float(said["alpha_rad"])
    depth_m = middle_m[2]
    height_m, width_m, length_m = said["size_m"].tolist()
    rotation_y_rad = wrap_angle_rad(alpha_rad + math.atan2(middle_m[0], middle_m[2]))
    location_m = (middle_m[0], middle_m[1] + height_m / 2, depth_m)
    (u, v), (left, top, right, bottom) = cell_middle_px.tolist(), said["sides_px"].tolist()
    box_px = clip_box((u - left, v - top, u + right, v + bottom), intrinsics)
    if box_px is None:
        return None
    box = Box3d(
        height_m=height_m, width_m=width_m, length_m=length_m, bottom_m=location_m, rotation_y_rad=rotation_y_rad
    )
    projected = project_box(box.corners_m, intrinsics)
    clipped = clip_box(projected, intrinsics) if projected else None
    error_m = depth_m * math.exp(float(said["disparity_spread"][0]))
    chances = (chance, 1 - math.exp(-TRUSTED_M / error_m), *((float(said["line_chance"]),) if kind in LONG else ()))
    return KittiLabel(
        type=kind,
        truncated=truncation(projected, clipped) if projected and clipped else 1.0,
        occluded=occlusion_level(1 / (1 + math.exp(float(said["hidden"][0])))),
        alpha_rad=alpha_rad,
        box_px=box_px,
        height_m=height_m,
        width_m=width_m,
        length_m=length_m,
        location_m=location_m,
        rotation_y_rad=rotation_y_rad,
        score=math.prod(chances) ** (1 / len(chances)),
    )


def heading_rad(logits: Array) -> tuple[Array, Array]:
    """Computes angles from distributions over directions that are evenly spaced from 0.

    The axis is chosen first: the axis whose two ends have the largest sum of probabilities. A confusion of front and
    rear therefore does not turn the axis. The angle is refined by the mean of the best direction and its neighbours.
    The more likely end of the axis is the front.

    Args:
        logits: (..., directions).

    Returns:
        (...) angles in [-pi, pi), and (...) confidences 0..1 that the axis is right.
    """
    chances = np.exp(logits - logits.max(axis=-1, keepdims=True))
    chances /= chances.sum(axis=-1, keepdims=True)
    half = chances.shape[-1] // 2
    lines = chances[..., :half] + chances[..., half:]
    best = lines.argmax(axis=-1)
    near = best[..., None] + (-1, 0, 1)
    sure = np.take_along_axis(lines, near % half, axis=-1)
    place = best + (sure[..., 2] - sure[..., 0]) / sure.sum(axis=-1)
    front, back = (np.take_along_axis(chances, (near + turn) % (2 * half), axis=-1).sum(axis=-1) for turn in (0, half))
    angle_rad = math.pi * (place / half + (front < back))
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi, np.asarray(sure.sum(axis=-1))


def _apart(labels: Sequence[KittiLabel], peaks: Peaks) -> tuple[KittiLabel, ...]:
    """One detection for each object: the one with the highest score."""
    ordered = sorted(labels, key=lambda label: -(label.score or 0.0))
    boxes_px = np.array([label.box_px for label in ordered]).reshape(-1, 4)
    logs = np.log([label.location_m[2] for label in ordered])
    is_same = (iou_2d(boxes_px, boxes_px) > peaks.same_overlap) & (abs(logs[:, None] - logs) < peaks.same_depth)
    kept: list[int] = []
    for i in range(len(ordered)):
        if not is_same[i, kept].any():
            kept.append(i)
    return tuple(ordered[i] for i in kept)
