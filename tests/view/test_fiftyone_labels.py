"""The values of labels for FiftyOne, with a stand-in for its classes that keeps their arguments."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from gear.formats import cityscapes, coco, rle
from gear.metrics.object_changes import ObjectChange
from gear.values.picture_objects import PatchDistance
from gear.view.fiftyone_labels import (
    change_labels,
    field_name,
    mask_colours,
    mask_targets,
    prediction_labels,
    truth_labels,
)

Opened = Callable[..., Any]


def _cuboid(vertices: Any, frame_size: Any, **named: Any) -> Any:
    return SimpleNamespace(corners_px=vertices, frame_size=frame_size, **named)


STAND_IN = SimpleNamespace(
    Detection=SimpleNamespace,
    Detections=SimpleNamespace,
    Segmentation=SimpleNamespace,
    Heatmap=SimpleNamespace,
    Polylines=SimpleNamespace,
    Polyline=type("Polyline", (SimpleNamespace,), {"from_cuboid": staticmethod(_cuboid)}),
)


def _files(dataset: Any, index: int) -> list[Path]:
    return [dataset.root / path for path in dataset.sidecar(index).files]


def _truth(dataset: Any, index: int = 0) -> Any:
    return truth_labels(STAND_IN, dataset.task, dataset[index], _files(dataset, index))


def test_boxes_and_masks_of_objects_are_those_of_the_sample(opened: Opened) -> None:
    dataset = opened("detect2d", 1)
    sample, found = dataset[0], _truth(dataset)["left"]["objects"].detections
    height, width = sample.images["left"].shape[:2]
    assert found and len(found) == len(sample.objects)
    for thing, one in zip(sample.objects, found, strict=True):
        assert one.label == coco.CATEGORY_NAMES[thing.category_id]
        x, y, w, h = (round(side * size) for side, size in zip(one.bounding_box, (width, height) * 2, strict=True))
        whole = np.zeros((height, width), dtype=np.bool_)
        whole[y : y + h, x : x + w] = one.mask
        assert np.array_equal(whole, rle.decode(thing.rle, height, width))
        assert (one.object_id, one.iscrowd, one.distance_m) == (
            thing.object_id, int(thing.is_ignored), thing.distance_m,
        )  # fmt: skip


def test_boxes_of_3d_objects_enclose_their_projected_boxes(opened: Opened) -> None:
    dataset = opened("stereo3d", 1)
    labels = _truth(dataset)
    assert set(labels) == {"left", "right"} and set(labels["right"]) == {"patches"}
    left = labels["left"]
    boxes = {one.object_id: one for one in left["objects"].detections}
    wires = left["boxes_3d"].polylines
    assert wires
    for one in wires:
        box = boxes[one.object_id]
        assert one.label == box.label != "DontCare" and one.frame_size == (408, 124)
        low, high = one.corners_px.min(axis=0), one.corners_px.max(axis=0)
        x, y, w, h = np.array(box.bounding_box) * (408, 124, 408, 124)
        assert (low <= np.array([x, y]) + 1.5).all() and (high >= np.array([x + w, y + h]) - 1.5).all()
        front, back = one.corners_px[:4], one.corners_px[4:]
        assert front[0, 1] > front[3, 1] and back[0, 1] > back[3, 1]  # in both faces the first corner is at the bottom
    assert all(one.iscrowd for one in boxes.values() if one.label == "DontCare")


def test_a_label_map_is_the_file_of_the_dataset(opened: Opened) -> None:
    dataset = opened("semseg", 1)
    left, sample = _truth(dataset)["left"], dataset[0]
    stored = cv2.imread(left["labels"].mask_path, cv2.IMREAD_UNCHANGED)
    assert np.array_equal(stored, sample.label_ids)
    assert Path(left["labels"].mask_path).is_relative_to(dataset.root)
    height, width = sample.label_ids.shape
    painted = np.zeros((height, width), dtype=np.uint16)
    for one in left["instances"].detections:
        x, y, w, h = (round(side * size) for side, size in zip(one.bounding_box, (width, height) * 2, strict=True))
        painted[y : y + h, x : x + w][one.mask] = one.cityscapes_id
        assert cityscapes.LABELS[one.cityscapes_id // 1000].name == one.label
    instances = np.where(sample.instance_ids >= 1000, sample.instance_ids, 0)
    assert instances.any() and np.array_equal(painted, instances)


def test_files_that_are_no_pictures_are_not_shown(opened: Opened, tmp_path: Path) -> None:
    dataset = opened("semseg", 1)
    os.mkfifo(tmp_path / "fifo.png")
    (tmp_path / "cut.png").write_bytes(_files(dataset, 0)[0].read_bytes()[:60])
    files = [tmp_path / name for name in ("fifo.png", "cut.png", "gone.png")]
    label = truth_labels(STAND_IN, dataset.task, dataset[0], files)["left"]["labels"]
    assert np.array_equal(label.mask, dataset[0].label_ids)


def test_a_depth_map_is_the_16_bit_file_with_the_range_of_the_preview(opened: Opened) -> None:
    dataset = opened("depth", 1)
    label = _truth(dataset)["left"]["depth"]
    stored = cv2.imread(label.map_path, cv2.IMREAD_UNCHANGED)
    known = stored > 0
    assert stored.dtype == np.uint16 and known.any()
    assert np.allclose(stored[known] / 256, dataset[0].depth_m[known], atol=1 / 512)
    assert label.range == [0, 80 * 256]


def test_patches_are_outlined_in_fractions_of_the_picture(opened: Opened) -> None:
    dataset = opened("depth", 1)
    sample = dataset[0]
    lines = _truth(dataset)["left"]["patches"].polylines
    assert [one.label for one in lines] == [truth.name for truth in sample.surfaces]
    x, y = lines[0].points[0][0]
    corner = sample.surfaces[0].corners_px[0]
    assert (x * 408 - 0.5, y * 124 - 0.5) == pytest.approx(corner) and lines[0].closed


def test_predictions_keep_scores_maps_and_metres(opened: Opened) -> None:
    dataset = opened("detect2d", 1)
    sample = dataset[0]
    found = [coco.Detection(category_id=3, box_px=(40.0, 24.0, 80.0, 48.0), score=0.25)]
    camera, label = prediction_labels(STAND_IN, dataset.task, sample, found, [])
    assert camera == "left"
    (one,) = label.detections
    assert (one.label, one.confidence) == ("car", 0.25) and one.bounding_box == pytest.approx([0.1, 0.1, 0.1, 0.1])
    dataset = opened("semseg", 1)
    other = (dataset[0].label_ids + 1) % 30
    label = prediction_labels(STAND_IN, dataset.task, dataset[0], other, _files(dataset, 0))[1]
    assert np.array_equal(label.mask, other)  # no file holds these labels
    dataset = opened("depth", 1)
    depth_m = dataset[0].depth_m.copy()
    depth_m[0, 0], depth_m[0, 1] = np.nan, 7.5
    label = prediction_labels(STAND_IN, dataset.task, dataset[0], depth_m, [])[1]
    assert (label.map[0, 0], label.map[0, 1], label.range) == (0.0, 7.5, [0, 80])


def test_tasks_of_other_packages_have_boxes_if_they_have_objects(opened: Opened) -> None:
    dataset = opened("detect2d", 1)
    known = dataset[0]
    foreign = SimpleNamespace(record=known.record, images=known.images, surfaces=())
    task = SimpleNamespace(
        as_prediction=lambda _: (), picture_objects=lambda *_: dataset.task.picture_objects(known, ())
    )
    labels = truth_labels(STAND_IN, task, foreign, [])["left"]  # type: ignore[arg-type]
    kept = [thing for thing in known.objects if not thing.is_ignored]
    assert [one.object_id for one in labels["objects"].detections] == [thing.object_id for thing in kept]
    plain = truth_labels(STAND_IN, SimpleNamespace(), foreign, [])["left"]  # type: ignore[arg-type]
    assert set(plain) == {"patches"}
    assert prediction_labels(STAND_IN, SimpleNamespace(), foreign, 3, []) == ("left", None)  # type: ignore[arg-type]


def test_changes_are_boxes_named_after_the_change() -> None:
    distance = PatchDistance(is_on_patch=False, pixels=3.0)
    hidden = ObjectChange(
        change="hidden", object_id=4, label="car", box_px=(10, 20, 30, 40), detected_as=None, score=None, patch=distance
    )
    (one,) = change_labels(STAND_IN, [hidden], (100, 200)).detections
    assert (one.label, one.object, one.is_on_patch) == ("hidden", "car", False)
    assert one.bounding_box == [0.1, 0.1, 0.2, 0.1] and not hasattr(one, "score")


def test_legends_are_those_of_cityscapes() -> None:
    assert mask_targets()[7] == "road" and -1 not in mask_targets()
    assert {"intTarget": 7, "color": "#804080"} in mask_colours()
    assert all(set(one) == {"intTarget", "color"} for one in mask_colours())


@pytest.mark.parametrize(
    ("text", "name"),
    [("fasterrcnn_r50_fpn + jpeg", "fasterrcnn_r50_fpn_jpeg"), ("$a.b", "a_b"), ("_", "unnamed"), ("", "unnamed")],
)
def test_names_become_names_of_fields(text: str, name: str) -> None:
    assert field_name(text) == name
