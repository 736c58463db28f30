"""From the outputs of the network of centres to lines of KITTI's result files."""

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
from gear.values.geometry import Array, wrap_angle_rad

TRUSTED_M = 1.0
"""A detection's score is the geometric mean of the chances that it is one, that its depth is this right, and that its
line is, where that matters."""

LONG = ("Car", "Van", "Truck", "Cyclist")
"""Kinds whose boxes lie elsewhere when they are turned."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peaks:
    """Which centres become detections.

    Attributes:
        most: in a picture.
        least_score: below which nothing is reported.
        same_overlap: two detections that overlap by more in the picture are one, if their depths agree too.
        same_depth: how far the depths of one object's detections may differ, relatively.
    """

    most: int = 50
    least_score: float = 0.02
    same_overlap: float = 0.6
    same_depth: float = 0.15


def decode(
    outputs: Mapping[str, Tensor],
    kinds: Sequence[str],
    calibration: Calibration,
    cell_px: tuple[float, float],
    peaks: Peaks,
) -> list[tuple[KittiLabel, ...]]:
    """The detections of each picture of a batch, the surest first.

    Args:
        outputs: as `gear.nn.stereo_centre.StereoCentre` names them, lengths in pixels of the picture.
        kinds: KITTI's types in the order of the channels of `heat`.
        calibration: of the pair.
        cell_px: width and height of a cell.
        peaks: which of them are kept.
    """
    heat = outputs["heat"].sigmoid()
    any_kind, kind = heat.max(dim=1)
    is_peak = functional.max_pool2d(any_kind[:, None], 3, 1, 1)[:, 0] == any_kind
    chance = any_kind * is_peak
    count = min(peaks.most, chance[0].numel())
    found = []
    for batch in range(len(heat)):
        best, cells = chance[batch].reshape(-1).topk(count)
        cells = cells[best >= peaks.least_score]
        rows, columns = cells // chance.shape[2], cells % chance.shape[2]
        maps = {name: _plain(tensor[batch, :, rows, columns].T) for name, tensor in outputs.items()}
        chosen = [kinds[index] for index in kind[batch, rows, columns].tolist()]
        scores = _plain(chance[batch, rows, columns])
        u = (_plain(columns) + 0.5) * cell_px[0] - 0.5
        v = (_plain(rows) + 0.5) * cell_px[1] - 0.5
        labels = [
            _label({name: values[i] for name, values in maps.items()}, chosen[i], scores[i], (u[i], v[i]), calibration)
            for i in range(len(chosen))
        ]
        found.append(_apart([label for label in labels if label is not None], peaks))
    return found


def _plain(tensor: Tensor) -> Array:
    return np.asarray(tensor.to(torch.float64).cpu().numpy())


def _label(
    said: Mapping[str, Array], kind: str, chance: float, cell_middle_px: tuple[float, float], calibration: Calibration
) -> KittiLabel | None:
    """One detection; None where its box lies outside the picture."""
    intrinsics = calibration.intrinsics
    depth_m = intrinsics.focal_px * calibration.baseline_m / float(said["disparity_px"][0])
    middle_m = intrinsics.unproject(np.array(cell_middle_px) + said["centre_px"], np.array(depth_m))
    height_m, width_m, length_m = (float(value) for value in said["size_m"])
    alpha_rad, line_chance = heading_rad(said["heading_logits"])
    rotation_y_rad = wrap_angle_rad(alpha_rad + math.atan2(middle_m[0], middle_m[2]))
    location_m = (float(middle_m[0]), float(middle_m[1] + height_m / 2), depth_m)
    (u, v), (left, top, right, bottom) = cell_middle_px, said["sides_px"]
    box_px = clip_box((u - left, v - top, u + right, v + bottom), intrinsics)
    if box_px is None:
        return None
    box = Box3d(
        height_m=height_m, width_m=width_m, length_m=length_m, bottom_m=location_m, rotation_y_rad=rotation_y_rad
    )
    projected = project_box(box.corners_m, intrinsics)
    clipped = clip_box(projected, intrinsics) if projected else None
    error_m = depth_m * math.exp(float(said["disparity_spread"][0]))
    chances = (chance, 1 - math.exp(-TRUSTED_M / error_m), *((line_chance,) if kind in LONG else ()))
    return KittiLabel(
        type=kind,
        truncated=truncation(projected, clipped) if projected and clipped else 1.0,
        occluded=occlusion_level(1 / (1 + math.exp(-float(said["hidden"][0])))),
        alpha_rad=alpha_rad,
        box_px=box_px,
        height_m=height_m,
        width_m=width_m,
        length_m=length_m,
        location_m=location_m,
        rotation_y_rad=rotation_y_rad,
        score=math.prod(chances) ** (1 / len(chances)),
    )


def heading_rad(logits: Array) -> tuple[float, float]:
    """The angle of a distribution over directions, evenly round the circle from 0 on, and how sure its line is, 0..1.

    Its line is where the chances of both ends are highest together, so that not knowing front from back does not turn
    it; between directions it is the mean of the best one and its neighbours. Then the likelier end is the front.
    """
    chances = np.exp(logits - logits.max())
    chances /= chances.sum()
    half = len(chances) // 2
    lines = chances[:half] + chances[half:]
    best = int(lines.argmax())
    near = np.arange(best - 1, best + 2)
    sure = lines[near % half]
    place = best + float(sure @ (-1, 0, 1)) / float(sure.sum())
    is_front = chances[near % len(chances)].sum() >= chances[(near + half) % len(chances)].sum()
    angle_rad = math.pi * (place / half + (0 if is_front else 1))
    return wrap_angle_rad(angle_rad), float(sure.sum())


def _apart(labels: Sequence[KittiLabel], peaks: Peaks) -> tuple[KittiLabel, ...]:
    """The surest of those that are one object."""
    ordered = sorted(labels, key=lambda label: -(label.score or 0.0))
    boxes_px = np.array([label.box_px for label in ordered]).reshape(-1, 4)
    overlaps = iou_2d(boxes_px, boxes_px)
    depths_m = np.array([label.location_m[2] for label in ordered])
    kept: list[int] = []
    for i in range(len(ordered)):
        is_same = [
            overlaps[i, j] > peaks.same_overlap and abs(math.log(depths_m[i] / depths_m[j])) < peaks.same_depth
            for j in kept
        ]
        if not any(is_same):
            kept.append(i)
    return tuple(ordered[i] for i in kept)
