from typing import Any

import numpy as np
import pytest

from gear.groundtruth.visibility import VisibilityLimits
from gear.values.errors import FieldError
from gear.values.ground_truth import ObjectTruth


def truth(**changes: Any) -> ObjectTruth:
    values: dict[str, Any] = {
        "object_id": 2,
        "label_code": 25,
        "visible_px": 1200,
        "visible_box": (10.0, 10.0, 50.0, 50.0),
        "amodal_px": 1500,
        "amodal_in_image_px": 1400,
        "amodal_box": (0.0, 0.0, 60.0, 60.0),
        "mask": np.ones((40, 40), dtype=np.bool_),
    }
    return ObjectTruth(**(values | changes))


def test_enough_is_enough() -> None:
    assert VisibilityLimits().labels(truth(), 50.0)


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
def test_each_limit_holds(changes: dict[str, Any], distance_m: float) -> None:
    assert not VisibilityLimits().labels(truth(**changes), distance_m)


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
def test_what_just_reaches_a_limit_is_labelled(changes: dict[str, Any], distance_m: float) -> None:
    """900 px², 100 visible pixels, a tenth of what lies in the picture, whatever lies outside, and 200 m."""
    assert VisibilityLimits().labels(truth(**changes), distance_m)


def test_the_share_that_is_too_little_is_of_the_part_in_the_picture() -> None:
    barely = truth(visible_px=199, amodal_in_image_px=2000, amodal_px=2000)
    assert not VisibilityLimits().labels(barely, 50.0)


def test_limits_may_let_everything_through() -> None:
    limits = VisibilityLimits(
        max_distance_m=0.5, min_box_area_px2=0.0, min_visible_fraction=0.0, min_visible_px=0, min_pixels_px=1
    )
    assert limits.labels(truth(visible_px=1, visible_box=(3.0, 3.0, 4.0, 4.0)), 0.5)


def test_three_pixels_are_not_mentioned() -> None:
    assert not VisibilityLimits().mentions(truth(visible_px=3))
    assert VisibilityLimits().mentions(truth(visible_px=4))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_distance_m", 0.0),
        ("min_box_area_px2", -1.0),
        ("min_visible_fraction", 1.5),
        ("min_visible_px", -1),
        ("min_pixels_px", 0),
    ],
)
def test_bad_limits_are_refused(name: str, value: float) -> None:
    with pytest.raises(FieldError, match=name):
        VisibilityLimits(**{name: value})  # type: ignore[arg-type]
