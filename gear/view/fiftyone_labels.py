"""Converts ground truth and predictions of samples to labels of FiftyOne.

Functions take the imported package `fiftyone` as their first parameter, because importing it starts its database.
Coordinates of FiftyOne are fractions of the picture's width and height; (0, 0) is the corner of the first pixel.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from gear.contracts.evaluation import WithObjects
from gear.contracts.tasks import Sample, Task
from gear.formats import cityscapes, coco, rle
from gear.formats.kitti_object import label_corners, to_edge_pixels
from gear.formats.png import decode_plain
from gear.groundtruth.silhouettes import NEAR_M
from gear.metrics.object_changes import ObjectChange
from gear.plugins.tasks.depth import PREVIEW_DEPTHS_M, DepthSample
from gear.plugins.tasks.detect2d import Detect2dSample, Object2d
from gear.plugins.tasks.semseg import SemsegSample
from gear.plugins.tasks.stereo3d import Object3d, Stereo3dSample
from gear.values.ground_truth import BoxPx
from gear.values.regular_file import read_regular

Labels = dict[str, Any]
"""FiftyOne's labels of one picture by name of the field."""

Size = tuple[int, int]
"""Width and height of a picture in pixels."""

DEPTH_UNITS_RANGE = [0, round(PREVIEW_DEPTHS_M[-1]) * 256]
"""Values of 16-bit depth pictures (1/256 m) between which FiftyOne spreads its colours: the depths of the preview."""


def truth_labels(fiftyone: Any, task: Task[Any, Any], sample: Sample, files: Iterable[Path]) -> dict[str, Labels]:
    """Converts the ground truth of a sample to labels by name of the camera and of the field.

    The fields are `objects` (boxes, and masks where the task has them), `boxes_3d` (projected boxes), `labels` (label
    map), `instances` (boxes and masks of Cityscapes' instances), `depth` (depth map) and `patches` (outlines of patch
    surfaces), as far as the task measures them.

    Args:
        fiftyone: the imported package.
        task: the task of the sample.
        sample: the sample; samples of other packages' tasks have boxes if the task implements `WithObjects`.
        files: files of the sample, of which label maps and depth maps are shown without a copy.
    """
    first = next(iter(sample.images))
    found: dict[str, Labels] = {camera: {} for camera in sample.images}
    if isinstance(sample, Detect2dSample):
        found[first]["objects"] = _objects_2d(fiftyone, sample, _size(sample, first))
    elif isinstance(sample, Stereo3dSample):
        found[first] |= _objects_3d(fiftyone, sample, _size(sample, first))
    elif isinstance(sample, SemsegSample):
        found[first]["labels"] = _label_map(fiftyone, sample.label_ids, files)
        found[first]["instances"] = _instances(fiftyone, sample.instance_ids)
    elif isinstance(sample, DepthSample):
        found[first]["depth"] = _depth_map(fiftyone, sample.depth_m, files)
    elif isinstance(task, WithObjects):
        seen = task.picture_objects(sample, task.as_prediction(sample))
        boxes = [(one.label, one.box_px, {"object_id": one.object_id}) for one in seen.objects]
        found[seen.camera]["objects"] = _boxes(fiftyone, boxes, _size(sample, seen.camera))
    for camera, labels in found.items():
        labels["patches"] = _patches(fiftyone, sample, camera)
    return found


def prediction_labels(
    fiftyone: Any, task: Task[Any, Any], sample: Sample, prediction: Any, files: Iterable[Path]
) -> tuple[str, Any]:
    """Converts a prediction to a label: detections with their scores, a label map, or a depth map.

    Args:
        fiftyone: the imported package.
        task: the task of the sample.
        sample: the sample.
        prediction: its prediction in the task's form.
        files: files of the stored prediction, of which maps are shown without a copy.

    Returns:
        Name of the camera, and the label; None for a prediction that has no form in FiftyOne.
    """
    first = next(iter(sample.images))
    if isinstance(sample, SemsegSample):
        return first, _label_map(fiftyone, np.asarray(prediction), files)
    if isinstance(sample, DepthSample):
        return first, _depth_map(fiftyone, np.asarray(prediction), files)
    if isinstance(task, WithObjects):
        seen = task.picture_objects(sample, prediction)
        boxes = [(one.label, one.box_px, {"confidence": float(one.score)}) for one in seen.detections]
        return seen.camera, _boxes(fiftyone, boxes, _size(sample, seen.camera))
    return first, None


def change_labels(fiftyone: Any, changes: Sequence[ObjectChange], size: Size) -> Any:
    """Converts the changes of objects between twins to boxes, whose labels are `hidden`, `misclassified`, `moved` and
    `invented`.

    Args:
        fiftyone: the imported package.
        changes: what a patch changed in one picture.
        size: width and height of the picture in pixels.
    """
    boxes = [
        (one.change, one.box_px, {"object": one.label, "detected_as": one.detected_as, "score": one.score,
                                  "is_on_patch": one.patch.is_on_patch})
        for one in changes
    ]  # fmt: skip
    return _boxes(fiftyone, boxes, size)


def mask_targets() -> dict[int, str]:
    """Names of Cityscapes' label ids, for FiftyOne's legend of label maps."""
    return {one.id: one.name for one in cityscapes.LABELS}


def mask_colours() -> list[dict[str, Any]]:
    """Cityscapes' colours of label ids, in the form of FiftyOne's `ColorScheme.default_mask_targets_colors`."""
    return [{"intTarget": one.id, "color": "#{:02x}{:02x}{:02x}".format(*one.rgb)} for one in cityscapes.LABELS]


def field_name(text: str) -> str:
    """Converts a name to a name of a field in FiftyOne: letters, digits and `_`, not `_` first.

    Args:
        text: any name, such as that of an evaluation.
    """
    return re.sub(r"[^0-9a-zA-Z]+", "_", text).strip("_") or "unnamed"


def _size(sample: Sample, camera: str) -> Size:
    height, width = sample.images[camera].shape[:2]
    return width, height


def _boxes(fiftyone: Any, boxes: Iterable[tuple[str, BoxPx, Mapping[str, Any]]], size: Size) -> Any:
    """Makes detections of (label, box in edge pixels, attributes); attributes without a value are left out."""
    return fiftyone.Detections(
        detections=[
            fiftyone.Detection(
                label=label,
                bounding_box=_bounding_box(box, size),
                **{name: value for name, value in attributes.items() if value is not None},
            )
            for label, box, attributes in boxes
        ]
    )


def _bounding_box(box_px: BoxPx, size: Size) -> list[float]:
    """Converts a box in edge pixels to [left, top, width, height] as fractions of the picture."""
    (left, top, right, bottom), (width, height) = box_px, size
    return [left / width, top / height, (right - left) / width, (bottom - top) / height]


def _objects_2d(fiftyone: Any, sample: Detect2dSample, size: Size) -> Any:
    return _boxes(fiftyone, [(*_named(thing), _facts_2d(thing, size)) for thing in sample.objects], size)


def _named(thing: Object2d) -> tuple[str, BoxPx]:
    return coco.CATEGORY_NAMES[thing.category_id], thing.box_px


def _facts_2d(thing: Object2d, size: Size) -> dict[str, Any]:
    width, height = size
    left, top, right, bottom = (int(side) for side in thing.box_px)
    return {
        "mask": rle.decode_crop(thing.rle, height, width, (left, top, right, bottom)),
        "object_id": thing.object_id,
        "iscrowd": int(thing.is_ignored),  # FiftyOne's evaluation in COCO's manner reads the field of this name
        "area_px": thing.area_px,
        "visible_fraction": thing.visible_fraction,
        "occluded_fraction": thing.occluded_fraction,
        "truncated_fraction": thing.truncated_fraction,
        "distance_m": thing.distance_m,
    }


def _objects_3d(fiftyone: Any, sample: Stereo3dSample, size: Size) -> Labels:
    lines = [(thing, thing.label()) for thing in sample.objects]
    boxes = [(line.type, to_edge_pixels(line.box_px), _facts_3d(thing)) for thing, line in lines]
    wires = []
    for thing, line in lines:
        corners_m = label_corners(line)
        if thing.is_ignored or corners_m[:, 2].min() < NEAR_M:
            continue
        corners_px = sample.calibration.intrinsics.project(corners_m) + 0.5  # index pixels to edge pixels
        front_and_back = corners_px[[0, 1, 5, 4, 3, 2, 6, 7]]
        wires.append(
            fiftyone.Polyline.from_cuboid(
                front_and_back.copy(), frame_size=size, label=line.type, object_id=thing.object_id
            )
        )
    return {"objects": _boxes(fiftyone, boxes, size), "boxes_3d": fiftyone.Polylines(polylines=wires)}


def _facts_3d(thing: Object3d) -> dict[str, Any]:
    ignored = {"object_id": thing.object_id, "iscrowd": int(thing.is_ignored)}
    if thing.is_ignored:
        return ignored
    box = thing.box
    return ignored | {
        "truncated": thing.truncated,
        "occluded": thing.occluded,
        "occluded_fraction": thing.occluded_fraction,
        "distance_m": box.distance_m,
        "size_hwl_m": [box.height_m, box.width_m, box.length_m],
        "bottom_m": list(box.bottom_m),
        "rotation_y_rad": box.rotation_y_rad,
        "alpha_rad": box.alpha_rad,
    }


def _instances(fiftyone: Any, instance_ids: Any) -> Any:
    """Makes detections of the instances in an (H, W) map of label id * 1000 + number."""
    values, places = np.unique(instance_ids, return_inverse=True)
    regions = ndimage.find_objects(places.reshape(instance_ids.shape) + 1)
    height, width = instance_ids.shape
    boxes = []
    for value, region in zip(values.tolist(), regions, strict=True):
        if value >= cityscapes.INSTANCE_FACTOR:
            rows, columns = region
            name = cityscapes.LABELS[value // cityscapes.INSTANCE_FACTOR].name
            box = (columns.start, rows.start, columns.stop, rows.stop)
            boxes.append((name, box, {"mask": instance_ids[region] == value, "cityscapes_id": value}))
    return _boxes(fiftyone, boxes, (width, height))


def _label_map(fiftyone: Any, label_ids: Any, files: Iterable[Path]) -> Any:
    """Makes a label of an (H, W) map: of the file that holds exactly this map, otherwise of the values."""
    for path in files:
        stored = _stored_map(path)
        if stored is not None and stored.dtype == np.uint8 and np.array_equal(stored, label_ids):
            return fiftyone.Segmentation(mask_path=str(path.resolve()))
    return fiftyone.Segmentation(mask=label_ids)


def _depth_map(fiftyone: Any, depth_m: Any, files: Iterable[Path]) -> Any:
    """Makes a label of an (H, W) depth map: of the 16-bit picture in 1/256 m, otherwise of the metres."""
    for path in files:
        stored = _stored_map(path)
        if stored is not None and stored.dtype == np.uint16 and stored.shape == depth_m.shape:
            return fiftyone.Heatmap(map_path=str(path.resolve()), range=DEPTH_UNITS_RANGE)
    metres = np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)
    return fiftyone.Heatmap(map=metres, range=[0, DEPTH_UNITS_RANGE[1] // 256])


def _stored_map(path: Path) -> Any:
    """Reads a PNG with one channel; None for other files and for damaged ones."""
    if path.suffix.lower() != ".png":
        return None
    try:
        stored = decode_plain(read_regular(path))
    except (OSError, ValueError):
        return None
    return stored if stored.ndim == 2 else None


def _patches(fiftyone: Any, sample: Sample, camera: str) -> Any:
    """Makes outlines of the patch surfaces that lie in front of a camera; they may exceed the picture."""
    width, height = _size(sample, camera)
    lines = [
        fiftyone.Polyline(
            label=truth.name,
            points=[[((x + 0.5) / width, (y + 0.5) / height) for x, y in truth.corners_px]],
            closed=True,
            filled=False,
            visible_fraction=truth.visible_fraction,
            visible_px=truth.visible_px,
            distance_m=truth.distance_m,
            incidence_deg=truth.incidence_deg,
        )
        for truth in sample.surfaces
        if truth.camera == camera and truth.corners_px is not None
    ]
    return fiftyone.Polylines(polylines=lines)
