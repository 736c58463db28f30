"""Lines of label files for multi-object tracking: KITTI tracking and MOTChallenge."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gear.formats.kitti_object import VELODYNE_TO_CAMERA, Calibration, KittiLabel
from gear.values.ground_truth import BoxPx

SLIGHTLY_TRUNCATED, MOSTLY_TRUNCATED = 0.01, 0.5
"""Shares of an object outside the picture from which on KITTI tracking's truncation level is 1 (partly) and 2
(largely). The benchmark states no numbers. Its evaluation ignores objects of levels 1 and 2.
"""

NO_TRACK = -1
"""Track id of `DontCare` regions."""

MOT_CLASSES = {
    "person": 1, "rider": 2, "car": 3, "van": 3, "truck": 3, "bus": 3, "bicycle": 4, "motorcycle": 5,
}  # fmt: skip
"""MOTChallenge's class numbers by gear's label. MOTChallenge has one class for vehicles with four or more wheels."""


def truncation_level(truncated: float) -> int:
    """KITTI tracking's truncation level, 0, 1 or 2, of an object with the share `truncated` outside the picture.

    Args:
        truncated: the share, 0..1.
    """
    return int(truncated >= SLIGHTLY_TRUNCATED) + int(truncated >= MOSTLY_TRUNCATED)


def kitti_track_line(frame: int, track: int, label: KittiLabel) -> str:
    """One line of a KITTI tracking label file, without a newline: frame, track id, and the 15 fields of the object.

    The fields are those of the object benchmark, except the truncation, which is a level.

    Args:
        frame: number of the frame in its sequence, from 0.
        track: id of the object in all frames; not used for `DontCare` regions, whose id is -1.
        label: the object.
    """
    box = " ".join(f"{side:.6f}" for side in label.box_px)
    if label.type == "DontCare":
        return f"{frame} {NO_TRACK} DontCare -1 -1 -10 {box} -1000 -1000 -1000 -10 -1 -1 -1"
    numbers = (label.height_m, label.width_m, label.length_m, *label.location_m, label.rotation_y_rad)
    rest = " ".join(f"{number + 0.0:.6f}" for number in numbers)
    levels = f"{truncation_level(label.truncated)} {label.occluded}"
    return f"{frame} {track} {label.type} {levels} {label.alpha_rad + 0.0:.6f} {box} {rest}"


def format_tracking_calibration(calibration: Calibration) -> bytes:
    """The bytes of a calibration file of KITTI tracking, in which three names differ from the object benchmark's.

    Args:
        calibration: the calibration of the cameras.
    """
    lines = [
        f"P{camera}: " + " ".join(f"{value + 0.0:.12e}" for value in calibration.projection(camera).reshape(-1))
        for camera in range(4)
    ]
    identity, scanner = np.eye(3, 4), np.array(VELODYNE_TO_CAMERA)
    for name, matrix in (("R_rect", np.eye(3)), ("Tr_velo_cam", scanner), ("Tr_imu_velo", identity)):
        lines.append(f"{name} " + " ".join(f"{value + 0.0:.12e}" for value in matrix.reshape(-1)))
    return "".join(f"{line}\n" for line in lines).encode()


def kitti_sequence_map(lengths: Iterable[int]) -> bytes:
    """The bytes of `evaluate_tracking.seqmap`: for each sequence its name, first frame, and number of frames.

    Args:
        lengths: number of frames of each sequence, in order of the sequences' numbers.
    """
    return "".join(f"{number:04d} empty 000000 {length:06d}\n" for number, length in enumerate(lengths)).encode()


def mot_line(frame: int, track: int, box_px: BoxPx, class_number: int, visible: float, *, is_evaluated: bool) -> str:
    """One line of MOTChallenge's `gt.txt`, without a newline.

    Args:
        frame: number of the frame in its sequence, from 0; in the file frames count from 1.
        track: id of the object in all frames, at least 1.
        box_px: box in edge pixels; in the file pixels count from 1.
        class_number: MOTChallenge's class.
        visible: visible share of the object, 0..1.
        is_evaluated: whether the evaluation counts the object.
    """
    left, top, right, bottom = box_px
    box = ",".join(f"{side:g}" for side in (left + 1, top + 1, right - left, bottom - top))
    return f"{frame + 1},{track},{box},{int(is_evaluated)},{class_number},{visible:g}"


def mot_sequence_info(name: str, frames: int, interval_s: float, size_px: tuple[int, int]) -> bytes:
    """The bytes of MOTChallenge's `seqinfo.ini`.

    Args:
        name: name of the sequence's folder.
        frames: number of frames.
        interval_s: time between two frames, seconds.
        size_px: width and height of the pictures.
    """
    lines = [
        "[Sequence]",
        f"name={name}",
        "imDir=img1",
        f"frameRate={1 / interval_s:g}",
        f"seqLength={frames}",
        f"imWidth={size_px[0]}",
        f"imHeight={size_px[1]}",
        "imExt=.png",
    ]
    return ("\n".join(lines) + "\n").encode()
