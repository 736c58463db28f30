"""Paths and lines of files with predictions, in the layouts that the benchmarks' own scripts read.

Paths are relative to the folder of the predictions.
"""

from __future__ import annotations

from collections.abc import Iterable

from gear.formats.cityscapes import city_name, stem
from gear.formats.kitti_object import KittiLabel


def cityscapes_path(town: str, sequence: int, frame: int) -> str:
    """Path of a predicted picture of label ids. The benchmark's script finds the file by its name in any subfolder.

    Args:
        town: name of the town.
        sequence, frame: number of the sequence, and of the picture in it.
    """
    return f"cityscapes/{city_name(town)}/{stem(town, sequence, frame)}_predLabelIds.png"


def kitti_depth_paths(index: int) -> tuple[str, str]:
    """Paths of the two files of a predicted depth map: a 16-bit picture for KITTI's development kit, and a
    lossless file in metres.

    Args:
        index: index of the sample in its split.
    """
    return f"depth/rgb_{index:04d}.png", f"depth_metres/rgb_{index:04d}.tiff"


def kitti_object_path(index: int) -> str:
    """Path of a file with predicted 3D boxes; KITTI's development kit reads `data/%06d.txt`.

    Args:
        index: index of the sample in its split.
    """
    return f"data/{index:06d}.txt"


def kitti_result_lines(detections: Iterable[KittiLabel]) -> bytes:
    """The bytes of a KITTI result file: one line of 16 fields per predicted box.

    Numbers have all digits, so that an independent evaluation gets exactly the same metrics as gear.

    Args:
        detections: the predicted boxes of one picture, each with a score.

    Raises:
        ValueError: a detection has no score.
    """
    return "".join(_result_line(label) + "\n" for label in detections).encode()


def _result_line(label: KittiLabel) -> str:
    if label.score is None:
        raise ValueError("every detection needs a score")
    numbers = (
        label.alpha_rad,
        *label.box_px,
        label.height_m,
        label.width_m,
        label.length_m,
        *label.location_m,
        label.rotation_y_rad,
        label.score,
    )
    head = f"{label.type} {float(label.truncated)!r} {label.occluded:d} "
    return head + " ".join(repr(float(value)) for value in numbers)


def coco_path(split: str) -> str:
    """Path of the file with the detections of a split, in COCO's results format.

    Args:
        split: name of the split.
    """
    return f"coco_results_{split}.json"
