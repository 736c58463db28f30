"""The contract of a metric, and the definition of Boundary IoU on masks that can be counted by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from gear.testing.metric_contract import MetricContract
from gear.values.errors import FieldError

from gear_metric_boundary_iou import BoundaryIouConfig, build, spec
from gear_metric_boundary_iou.boundary_iou import boundary

ROAD, CAR = 7, 26


class TestBoundaryIou(MetricContract):
    spec = spec


def test_a_square_has_a_frame_of_the_given_width() -> None:
    mask = np.zeros((20, 20), np.bool_)
    mask[4:14, 4:14] = True
    for width_px, count in ((1, 100 - 64), (2, 100 - 36), (9, 100)):
        assert boundary(mask, width_px).sum() == count


def test_the_border_of_the_picture_is_a_contour() -> None:
    assert boundary(np.ones((6, 6), np.bool_), 2).sum() == 36 - 4
    assert boundary(np.ones((6, 6), np.bool_), 1).sum() == 36 - 16


def test_a_shift_by_one_pixel_costs_what_the_definition_says() -> None:
    truth = np.full((20, 60), ROAD, np.uint8)
    truth[5:15, 20:40] = CAR
    prediction = np.full_like(truth, ROAD)
    prediction[5:15, 21:41] = CAR
    width_share = 1 / np.hypot(20, 60)
    evaluator = build(BoundaryIouConfig(width_share=width_share))
    evaluator.update(SimpleNamespace(label_ids=truth), prediction)
    # Two frames of 56 pixels, one pixel apart: they share 19 pixels of both long sides, and no others.
    assert evaluator.result()["boundary_iou_car"] == pytest.approx(38 / (56 + 56 - 38))
    assert np.isnan(evaluator.result()["boundary_iou_sky"])


def test_absurd_options_are_refused() -> None:
    with pytest.raises(FieldError, match="width_share"):
        BoundaryIouConfig(width_share=0)
