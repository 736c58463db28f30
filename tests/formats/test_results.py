"""Paths and lines of result files, as the benchmarks' own scripts look for them."""

from __future__ import annotations

import dataclasses

import pytest

from gear.formats import results
from gear.formats.kitti_object import KittiLabel, parse_labels

LABEL = KittiLabel(
    type="Car", truncated=0.0, occluded=0, alpha_rad=-1.5, box_px=(1.25, 2.0, 30.5, 40.0), height_m=1.5, width_m=1.6,
    length_m=4.0, location_m=(1.0, 1.6, 20.0), rotation_y_rad=0.1, score=0.123456789,
)  # fmt: skip


def test_paths() -> None:
    assert results.kitti_object_path(7) == "data/000007.txt"
    assert results.kitti_depth_paths(7) == ("depth/rgb_0007.png", "depth_metres/rgb_0007.tiff")
    assert results.coco_path("val") == "coco_results_val.json"
    path = results.cityscapes_path("town10", 3, 4)
    assert path.startswith("cityscapes/") and path.endswith("_predLabelIds.png") and "_000003_000004" in path


def test_result_lines_keep_every_digit() -> None:
    text = results.kitti_result_lines([LABEL]).decode()
    assert len(text.split()) == 16 and text.endswith("0.123456789\n")
    (read,) = parse_labels(text)
    assert read == LABEL


def test_a_detection_needs_a_score() -> None:
    with pytest.raises(ValueError, match="needs a score"):
        results.kitti_result_lines([dataclasses.replace(LABEL, score=None)])
