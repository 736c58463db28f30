from typing import Any

import numpy as np
import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.groundtruth.visibility import PRESETS, Visibility, VisibilityLimits
from gear.plugins.tasks.stereo3d import Stereo3dConfig
from gear.values.errors import ConfigError, FieldError
from gear.values.ground_truth import ObjectTruth

PAPER = PRESETS["carla_gear"]
BOX = (0.5, 0.5, 60.0, 60.0)


def truth(**changes: Any) -> ObjectTruth:
    values: dict[str, Any] = {
        "object_id": 2,
        "label_code": 25,
        "visible_px": 1200,
        "visible_box": (10.0, 10.0, 50.0, 50.0),
        "amodal_px": 1500,
        "amodal_in_image_px": 1400,
        "amodal_box": (0.0, 0.0, 60.0, 60.0),
        "pictured_box": BOX,
        "mask": np.ones((40, 40), dtype=np.bool_),
    }
    return ObjectTruth(**(values | changes))


def test_enough_is_enough() -> None:
    assert all(limits.labels(truth(), BOX, 50.0) for limits in (VisibilityLimits(), *PRESETS.values()))


@pytest.mark.parametrize(
    ("changes", "distance_m"),
    [
        ({}, 201.0),
        ({"visible_box": (10.0, 10.0, 39.0, 41.0)}, 50.0),
        ({"visible_px": 99}, 50.0),
        ({"visible_px": 130, "amodal_in_image_px": 1400}, 50.0),
        ({"visible_px": 0, "visible_box": None}, 50.0),
    ],
)
def test_each_of_the_papers_limits_holds(changes: dict[str, Any], distance_m: float) -> None:
    assert not PAPER.labels(truth(**changes), BOX, distance_m)


@pytest.mark.parametrize(
    ("changes", "distance_m"),
    [
        ({}, 200.0),
        ({"visible_box": (10.0, 10.0, 40.0, 40.0)}, 50.0),
        ({"visible_px": 100, "amodal_in_image_px": 400}, 50.0),
        ({"visible_px": 201, "amodal_in_image_px": 2000, "amodal_px": 9000}, 50.0),
        ({"visible_px": 200, "amodal_in_image_px": 2000}, 50.0),
        ({"visible_px": 123, "amodal_in_image_px": 1230}, 50.0),
    ],
)
def test_what_just_reaches_the_papers_limits_is_labelled(changes: dict[str, Any], distance_m: float) -> None:
    """900 px², 100 visible pixels, a tenth of what lies in the picture, whatever lies outside, and 200 m."""
    assert PAPER.labels(truth(**changes), BOX, distance_m)


def test_the_share_that_is_too_little_is_of_the_part_in_the_picture() -> None:
    barely = truth(visible_px=199, amodal_in_image_px=2000, amodal_px=2000)
    assert not PAPER.labels(barely, BOX, 50.0)


def test_kitti_labels_by_the_height_of_the_box_and_by_what_is_visible() -> None:
    """24 px and a tenth of the silhouette, however narrow, far or small: all that a level of its evaluation counts."""
    narrow = truth(visible_px=7, visible_box=(0.0, 0.0, 1.0, 25.0), amodal_in_image_px=70, amodal_px=700)
    assert PRESETS["kitti"].labels(narrow, (5.0, 10.0, 6.0, 34.0), 900.0)
    assert not PRESETS["kitti"].labels(narrow, (5.0, 10.0, 60.0, 33.99), 1.0)
    hidden = truth(visible_px=6, visible_box=(0.0, 0.0, 1.0, 25.0), amodal_in_image_px=70, amodal_px=700)
    assert not PRESETS["kitti"].labels(hidden, (5.0, 10.0, 6.0, 35.0), 1.0)


def test_coco_labels_by_visible_pixels_alone() -> None:
    sliver = truth(visible_px=100, visible_box=(0.0, 0.0, 1.0, 100.0), amodal_in_image_px=90_000, amodal_px=90_000)
    assert PRESETS["coco"].labels(sliver, BOX, 900.0)
    assert not PRESETS["coco"].labels(truth(visible_px=99), BOX, 1.0)


def test_given_limits_take_the_place_of_the_presets() -> None:
    assert Visibility(preset="kitti").limits() == PRESETS["kitti"]
    mixed = Visibility(preset="carla_gear", min_height_px=12.0, max_distance_m=30.0).limits()
    assert (mixed.min_height_px, mixed.max_distance_m, mixed.min_box_area_px2) == (12.0, 30.0, 900.0)
    with pytest.raises(FieldError, match="min_visible_px"):
        Visibility(preset="coco", min_visible_px=-1)


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("visibility: carla_gear", PAPER),
        ("visibility: {preset: coco, min_visible_px: 7}", VisibilityLimits(min_visible_px=7)),
        ("visibility: {min_visible_fraction: 0}", VisibilityLimits(min_height_px=24.0)),
        ("{}", PRESETS["kitti"]),
    ],
)
def test_a_config_names_a_preset_or_limits_or_both(text: str, limits: VisibilityLimits) -> None:
    assert read_node(Stereo3dConfig, parse_text(text, "own.yml")).visibility.limits() == limits


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "visibility: carla_geer",
            r":1:13: visibility\.preset: expected one of kitti, .*did you mean carla_gear\?",
        ),
        ("visibility:\n  min_height_px: -3", r"own.yml:2:18: visibility\.min_height_px: must not be negative, got -3"),
        ("visibility:\n  min_heigth_px: 3", r"own.yml:2:3: visibility\.min_heigth_px: unknown key .*'min_height_px'"),
    ],
)
def test_a_wrong_preset_or_limit_is_one_line_with_its_place(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        read_node(Stereo3dConfig, parse_text(text, "own.yml"))


def test_limits_may_let_everything_through() -> None:
    limits = VisibilityLimits(max_distance_m=0.5, min_pixels_px=1)
    assert limits.labels(truth(visible_px=1, visible_box=(3.0, 3.0, 4.0, 4.0)), BOX, 0.5)


def test_three_pixels_are_not_mentioned() -> None:
    assert not VisibilityLimits().mentions(truth(visible_px=3))
    assert VisibilityLimits().mentions(truth(visible_px=4))
    assert not VisibilityLimits().labels(truth(visible_px=3), BOX, 50.0), "what is not mentioned is no label either"
    assert VisibilityLimits().labels(truth(visible_px=4), BOX, 50.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_distance_m", 0.0),
        ("min_height_px", -1.0),
        ("min_box_area_px2", -1.0),
        ("min_visible_fraction", 1.5),
        ("min_visible_px", -1),
        ("min_pixels_px", 0),
    ],
)
def test_bad_limits_are_refused(name: str, value: float) -> None:
    with pytest.raises(FieldError, match=name):
        VisibilityLimits(**{name: value})  # type: ignore[arg-type]
