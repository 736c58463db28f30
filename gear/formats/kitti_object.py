"""KITTI object detection: label files and calibration files, by the benchmark's definitions.

Boxes are in index pixels (the first pixel's centre is 0) and clipped to the picture. The location is the middle of the
bottom face in the rectified frame of camera 0, the left camera. `rotation_y` is 0 if the object's front points along
+x.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array, Intrinsics
from gear.values.ground_truth import BoxPx

TYPES = ("Car", "Van", "Truck", "Pedestrian", "Person_sitting", "Cyclist", "Tram", "Misc", "DontCare")


@dataclass(frozen=True, slots=True, kw_only=True)
class KittiLabel:
    """One line (one object) of a KITTI label file.

    Attributes:
        type: one of `TYPES`.
        truncated: share of the object outside the picture, 0..1.
        occluded: 0 fully visible, 1 partly, 2 largely hidden, 3 unknown; -1 in DontCare lines.
        alpha_rad: observation angle, radians.
        box_px: 2D box: left, top, right, bottom in index pixels.
        height_m, width_m, length_m: size of the 3D box.
        location_m: middle of the bottom face, in the frame of camera 0 (x right, y down, z forward).
        rotation_y_rad: rotation about the camera's y axis; 0 if the object's front points along +x.
        score: confidence; in result files only.
    """

    type: str
    truncated: float
    occluded: int
    alpha_rad: float
    box_px: BoxPx
    height_m: float
    width_m: float
    length_m: float
    location_m: tuple[float, float, float]
    rotation_y_rad: float
    score: float | None = None


def dont_care(box_px: BoxPx) -> KittiLabel:
    """A label line of a `DontCare` region, in which detections are not evaluated.

    Args:
        box_px: left, top, right and bottom in index pixels.
    """
    return KittiLabel(
        type="DontCare",
        truncated=-1,
        occluded=-1,
        alpha_rad=-10,
        box_px=box_px,
        height_m=-1,
        width_m=-1,
        length_m=-1,
        location_m=(-1000, -1000, -1000),
        rotation_y_rad=-10,
    )


def format_label(label: KittiLabel) -> str:
    """The text of one line of a KITTI label file, without a newline.

    It has 15 fields (16 with a score), separated by one space. Numbers have two decimals, except the fixed numbers of a
    `DontCare` line.

    Args:
        label: the label or the detection.
    """
    if label.type == "DontCare":
        box = " ".join(f"{v:.2f}" for v in label.box_px)
        return f"DontCare -1 -1 -10 {box} -1 -1 -1 -1000 -1000 -1000 -10"
    numbers = (
        label.alpha_rad,
        *label.box_px,
        label.height_m,
        label.width_m,
        label.length_m,
        *label.location_m,
        label.rotation_y_rad,
    )
    text = f"{label.type} {label.truncated:.2f} {label.occluded:d} " + " ".join(_two(v) for v in numbers)
    return text if label.score is None else f"{text} {label.score:.4f}"


def _two(value: float) -> str:
    """Formats a number with two decimals; never as negative zero."""
    text = f"{value:.2f}"
    return "0.00" if text == "-0.00" else text


def format_labels(labels: Iterable[KittiLabel]) -> bytes:
    """The bytes of a KITTI label file, one line per object; empty for a picture without objects.

    Args:
        labels: the labels of one picture.
    """
    return "".join(format_label(label) + "\n" for label in labels).encode()


def parse_label(line: str) -> KittiLabel:
    """Parses one line of a KITTI label file or result file.

    Args:
        line: the line, with or without newline.

    Raises:
        ValueError: the line has neither 15 nor 16 fields, an unknown type, or a field that is not a number.
    """
    fields = line.split()
    if len(fields) not in (15, 16):
        raise ValueError(f"a label line has 15 or 16 fields, got {len(fields)}: {line!r}")
    if fields[0] not in TYPES:
        raise ValueError(f"unknown type {fields[0]!r}")
    numbers = [float(field) for field in fields[1:]]
    return KittiLabel(
        type=fields[0],
        truncated=numbers[0],
        occluded=int(numbers[1]),
        alpha_rad=numbers[2],
        box_px=(numbers[3], numbers[4], numbers[5], numbers[6]),
        height_m=numbers[7],
        width_m=numbers[8],
        length_m=numbers[9],
        location_m=(numbers[10], numbers[11], numbers[12]),
        rotation_y_rad=numbers[13],
        score=numbers[14] if len(numbers) == 15 else None,
    )


def parse_labels(text: str) -> tuple[KittiLabel, ...]:
    """Parses a KITTI label file: one label per line.

    Args:
        text: the text of the file; empty lines are skipped.
    """
    return tuple(parse_label(line) for line in text.splitlines() if line.strip())


def clip_box(box_px: BoxPx, intrinsics: Intrinsics) -> BoxPx | None:
    """Clips a box in index pixels to the picture; None if the box lies outside the picture.

    Args:
        box_px: left, top, right and bottom in index pixels.
        intrinsics: camera, which gives the size of the picture.
    """
    left, top = max(0.0, box_px[0]), max(0.0, box_px[1])
    right, bottom = min(intrinsics.width_px - 1.0, box_px[2]), min(intrinsics.height_px - 1.0, box_px[3])
    return (left, top, right, bottom) if right > left and bottom > top else None


def from_edge_pixels(box_px: BoxPx, intrinsics: Intrinsics) -> BoxPx:
    """Converts a box from edge pixels to the index pixels of KITTI labels, clipped to the centres of the outermost
    pixels.

    Args:
        box_px: left, top, right and bottom in edge pixels.
        intrinsics: camera, which gives the size of the picture.
    """
    left, top, right, bottom = (side - 0.5 for side in box_px)
    most_x, most_y = intrinsics.width_px - 1.0, intrinsics.height_px - 1.0
    return (max(0.0, left), max(0.0, top), min(most_x, right), min(most_y, bottom))


def to_edge_pixels(box_px: BoxPx) -> BoxPx:
    """Converts a box from index pixels, as in KITTI labels, to edge pixels (0 is the left edge of the first
    pixel).

    Args:
        box_px: left, top, right and bottom in index pixels.
    """
    left, top, right, bottom = (side + 0.5 for side in box_px)
    return (left, top, right, bottom)


def truncation(box_px: BoxPx, clipped_px: BoxPx) -> float:
    """KITTI's truncation: the share, 0..1, of a projected box that lies outside the picture.

    Args:
        box_px: the projected box, before clipping.
        clipped_px: the same box clipped to the picture.
    """
    whole = (box_px[2] - box_px[0]) * (box_px[3] - box_px[1])
    inside = (clipped_px[2] - clipped_px[0]) * (clipped_px[3] - clipped_px[1])
    return min(1.0, max(0.0, 1.0 - inside / whole)) if whole > 0 else 0.0


OCCLUSION_LEVELS = (0.8, 0.5, 0.1)
"""Smallest visible shares of objects with KITTI's occlusion levels 0, 1 and 2. The numbers are gear's choice, because
the benchmark states none.
"""


def occlusion_level(visible_fraction: float) -> int:
    """KITTI's occlusion level of an object, from its visible share.

    Args:
        visible_fraction: visible share of the silhouette inside the picture, 0..1.

    Returns:
        0 (fully visible) for a share of at least 0.8, 1 (partly occluded) for at least 0.5, 2 (largely occluded) for at
        least 0.1, and 3 (unknown) for less. The evaluation ignores objects of level 3 at every difficulty.
    """
    below = (level for level, least in enumerate(OCCLUSION_LEVELS) if visible_fraction >= least)
    return next(below, len(OCCLUSION_LEVELS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The calibration of a rectified stereo pair whose left camera is camera 0, or of a single camera.

    Attributes:
        intrinsics: intrinsics of both cameras.
        baseline_m: distance from the left to the right camera; 0 for a single camera.
    """

    intrinsics: Intrinsics
    baseline_m: float

    def projection(self, camera: int) -> Array:
        """The (3, 4) projection matrix `P<camera>` in pixels: 0 and 2 are the left camera, 1 and 3 the right
        camera.

        Args:
            camera: number of the camera, 0 to 3.
        """
        matrix = np.zeros((3, 4))
        matrix[:, :3] = self.intrinsics.matrix
        if camera in (1, 3):
            matrix[0, 3] = -self.intrinsics.focal_px * self.baseline_m
        return matrix


VELODYNE_TO_CAMERA = ((0.0, -1.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0), (1.0, 0.0, 0.0, 0.0))
"""(3, 4) transform from the laser scanner's frame (x forward, y left, z up) to the frame of camera 0; both origins are
the same point.
"""


def format_calibration(calibration: Calibration) -> bytes:
    """The bytes of a KITTI calibration file: KITTI's seven lines in their usual order.

    Args:
        calibration: the calibration of the cameras.
    """
    identity = np.eye(3, 4)
    rows: list[tuple[str, Array]] = [(f"P{i}", calibration.projection(i)) for i in range(4)]
    rows += [
        ("R0_rect", np.eye(3)),
        ("Tr_velo_to_cam", np.array(VELODYNE_TO_CAMERA)),
        ("Tr_imu_to_velo", identity),
    ]
    lines = [f"{name}: " + " ".join(f"{v + 0.0:.12e}" for v in matrix.reshape(-1)) for name, matrix in rows]
    return ("\n".join(lines) + "\n").encode()


SCAN = "scan/velodyne"
"""Key of the laser scan among the auxiliary files of a sample."""


def format_points(points: npt.NDArray[np.float32]) -> bytes:
    """The bytes of a KITTI laser scan: little-endian float32.

    Args:
        points: (N, 4): x forward, y left, z up in metres, and intensity 0..1.
    """
    return np.ascontiguousarray(points, dtype="<f4").tobytes()


def parse_points(data: bytes) -> npt.NDArray[np.float32]:
    """The (N, 4) float32 points of a KITTI laser scan: x forward, y left, z up in metres, and intensity 0..1.

    Args:
        data: bytes of the file.

    Raises:
        ValueError: the number of bytes is not a multiple of 16, the size of a point.
    """
    return np.frombuffer(data, dtype="<f4").reshape(-1, 4).astype(np.float32)


def parse_calibration(text: str) -> dict[str, Array]:
    """Parses a KITTI calibration file to matrices by name: `P0` to `P3` (3, 4), `R0_rect` (3, 3), `Tr_…` (3, 4).

    Args:
        text: the text of the file.
    """
    found: dict[str, Array] = {}
    for line in text.splitlines():
        if ":" in line:
            name, numbers = line.split(":", 1)
            values = np.array([float(v) for v in numbers.split()])
            found[name] = values.reshape(3, -1)
    return found


def read_baseline_m(matrices: dict[str, Array]) -> float:
    """The baseline of a stereo pair: the distance in metres from the left to the right camera, from `P2` and `P3`.

    Args:
        matrices: the matrices by name, from `parse_calibration`.
    """
    return float((matrices["P2"][0, 3] - matrices["P3"][0, 3]) / matrices["P2"][0, 0])


def label_corners(label: KittiLabel) -> Array:
    """The (8, 3) corners in metres of a label's 3D box in the frame of camera 0; the bottom face's four corners
    come first.

    Args:
        label: the label or the detection.
    """
    c, s = math.cos(label.rotation_y_rad), math.sin(label.rotation_y_rad)
    along = np.array([1, 1, -1, -1, 1, 1, -1, -1]) * label.length_m / 2
    up = np.array([0, 0, 0, 0, -1, -1, -1, -1]) * label.height_m
    across = np.array([1, -1, -1, 1, 1, -1, -1, 1]) * label.width_m / 2
    return np.stack([c * along + s * across, up, -s * along + c * across], axis=1) + label.location_m


WIRES = tuple((i, (i + 1) % 4) for i in range(4)) + tuple((i + 4, (i + 1) % 4 + 4) for i in range(4)) + tuple(
    (i, i + 4) for i in range(4)
)  # fmt: skip
"""Edges of a box as pairs of corner numbers of `label_corners`; its front is the face of corners 0, 1, 4, 5."""


def split_lists(split: str, ids: Sequence[str]) -> dict[str, bytes]:
    """The lists of sample ids of a split, as bytes by path: `ImageSets/<split>.txt` and `splits/<split>.txt`.

    The second file has no final newline, because its reader would take an empty line for an id.

    Args:
        split: name of the split.
        ids: ids of the samples, in order.
    """
    return {
        f"ImageSets/{split}.txt": "".join(f"{name}\n" for name in ids).encode(),
        f"splits/{split}.txt": "\n".join(ids).encode(),
    }
