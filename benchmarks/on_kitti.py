"""What networks that were trained on gear's pictures alone see in KITTI's photographs.

    python benchmarks/on_kitti.py KITTI/training [--detector NAME] [--depth NAME] [--frames 000008 ...] [--out DIR]

KITTI/training is a tree of KITTI's object benchmark: `image_2`, `label_2`, `calib`, `velodyne`. Detections with a
score of at least 0.3 are matched with labels at IoU 0.5; cars and vans count as one class. `DontCare` regions and
labels below KITTI's moderate level (lower than 25 px, truncated by more than 30 %, largely hidden) are neither hits
nor misses. Depth is compared with LiDAR points projected into the picture (1 to 80 m), as predicted and after
scaling by the ratio of the medians (Zhou et al. 2017). With `--out`, each picture is written with its boxes, above
its depth.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats.kitti_object import KittiLabel, parse_calibration, parse_labels, parse_points
from gear.plugins.build import NO_OPTIONS, build, find

CLASSES = {"car": ((3,), ("Car", "Van")), "person": ((1,), ("Pedestrian", "Person_sitting"))}
"""COCO's category ids and KITTI's types of the classes that both know."""

LEAST_SCORE, LEAST_IOU = 0.3, 0.5
LEAST_HEIGHT_PX, MOST_TRUNCATION, MOST_OCCLUSION = 25.0, 0.3, 1
NEAREST_M, FURTHEST_M = 1.0, 80.0

Box = tuple[float, float, float, float]


def iou(one: Box, other: Box) -> float:
    """Intersection over union of two boxes (left, top, right, bottom)."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    common = max(width, 0.0) * max(height, 0.0)
    areas = sum((box[2] - box[0]) * (box[3] - box[1]) for box in (one, other))
    return common / (areas - common)


def counts(label: KittiLabel) -> bool:
    """Whether a label is at KITTI's moderate level or easier."""
    height = label.box_px[3] - label.box_px[1]
    easy_enough = label.truncated <= MOST_TRUNCATION and label.occluded <= MOST_OCCLUSION
    return height >= LEAST_HEIGHT_PX and easy_enough


def matched(labels: list[KittiLabel], ignored: list[KittiLabel], found: list[Any]) -> tuple[int, int]:
    """Numbers of labels that were found, and of detections that match nothing; highest scores first."""
    left, false_alarms = list(labels), 0
    for detection in sorted(found, key=lambda each: -each.score):
        best = max(left, key=lambda label: iou(label.box_px, detection.box_px), default=None)
        if best is not None and iou(best.box_px, detection.box_px) >= LEAST_IOU:
            left.remove(best)
        elif not any(iou(label.box_px, detection.box_px) >= LEAST_IOU for label in (*ignored, *labels)):
            false_alarms += 1
    return len(labels) - len(left), false_alarms


def lidar_depth(points: npt.NDArray[np.float32], calibration: dict[str, Any], shape: tuple[int, ...]) -> Any:
    """Columns, rows and depths in metres of the LiDAR points in the picture of camera 2."""
    rectify, to_camera = np.eye(4), np.eye(4)
    rectify[:3, :3] = calibration["R0_rect"].reshape(3, 3)
    to_camera[:3] = calibration["Tr_velo_to_cam"].reshape(3, 4)
    homogeneous = np.column_stack([points[:, :3], np.ones(len(points))])
    seen = homogeneous @ (calibration["P2"].reshape(3, 4) @ rectify @ to_camera).T
    seen = seen[(seen[:, 2] >= NEAREST_M) & (seen[:, 2] <= FURTHEST_M)]
    columns, rows = (np.floor(seen[:, axis] / seen[:, 2]).astype(int) for axis in (0, 1))
    inside = (columns >= 0) & (columns < shape[1]) & (rows >= 0) & (rows < shape[0])
    return columns[inside], rows[inside], seen[inside, 2]


def depth_row(predicted: npt.NDArray[Any], true: npt.NDArray[Any]) -> dict[str, float]:
    """Share of points with a ratio below 1.25, and mean relative error, as predicted and scaled by the medians."""
    row = {"points": float(len(true)), "median_ratio": float(np.median(predicted) / np.median(true))}
    for name, values in (("", predicted), ("scaled_", predicted / row["median_ratio"])):
        row[name + "d1"] = float(np.mean(np.maximum(values / true, true / values) < 1.25))
        row[name + "abs_rel"] = float(np.mean(np.abs(values - true) / true))
    return row


def picture_of(rgb: npt.NDArray[Any], detections: list[Any], depth_m: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The picture with its boxes above the depth, near in red; BGR."""
    drawn = rgb[:, :, ::-1].copy()
    for each in detections:
        left, top, right, bottom = (round(value) for value in each.box_px)
        cv2.rectangle(drawn, (left, top), (right, bottom), (40, 40, 255), 2)
        text = f"{each.category_id} {each.score:.2f}"
        cv2.putText(drawn, text, (left, max(top - 4, 12)), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 255, 255), 1)
    nearness = 1 - np.log(np.clip(depth_m, 2, FURTHEST_M) / 2) / np.log(FURTHEST_M / 2)
    return np.vstack([drawn, cv2.applyColorMap((255 * nearness).astype(np.uint8), cv2.COLORMAP_TURBO)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=Path)
    parser.add_argument("--detector", default="retinanet_lite0_fpn")
    parser.add_argument("--depth", default="ddrnet23_slim_depth")
    parser.add_argument("--frames", nargs="*")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    detector, depth = (build(find("model", name), NO_OPTIONS) for name in (args.detector, args.depth))
    frames = args.frames or sorted(path.stem for path in (args.root / "image_2").glob("*.png"))
    totals = {name: np.zeros(3, dtype=int) for name in CLASSES}
    for frame in frames:
        stored = cv2.imread(str(args.root / "image_2" / f"{frame}.png"))
        if stored is None:
            raise SystemExit(f"{args.root / 'image_2' / f'{frame}.png'} is not a picture")
        rgb = np.ascontiguousarray(stored[:, :, ::-1])
        labels = parse_labels((args.root / "label_2" / f"{frame}.txt").read_text())
        found = [each for each in detector.predict({"left": rgb}) if each.score >= LEAST_SCORE]
        for name, (categories, types) in CLASSES.items():
            wanted = [label for label in labels if label.type in types and counts(label)]
            ignored = [label for label in labels if label not in wanted]
            hits = matched(wanted, ignored, [each for each in found if each.category_id in categories])
            totals[name] += (len(wanted), *hits)
        depth_m = np.asarray(depth.predict({"left": rgb}))
        cloud = args.root / "velodyne" / f"{frame}.bin"
        if cloud.exists():
            calibration = parse_calibration((args.root / "calib" / f"{frame}.txt").read_text())
            columns, rows, true = lidar_depth(parse_points(cloud.read_bytes()), calibration, rgb.shape)
            row = depth_row(depth_m[rows, columns], true)
            print(f"{frame} {args.depth}: " + ", ".join(f"{key} {value:.3f}" for key, value in row.items()))
        if args.out:
            args.out.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(args.out / f"{frame}.png"), picture_of(rgb, found, depth_m))
    for name, (labelled, hits, false_alarms) in totals.items():
        print(
            f"{args.detector}, {name}: {hits} of {labelled} found, {false_alarms} false alarms, {len(frames)} pictures"
        )


if __name__ == "__main__":
    main()
