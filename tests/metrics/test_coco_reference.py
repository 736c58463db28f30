"""Which categories and which objects the metric of reference detectors counts."""

import math

import numpy as np
import pytest

from gear.formats.coco import Annotation, Detection, Picture
from gear.metrics.coco_reference import TallObjects

CAR, TRAFFIC_LIGHT = 3, 10


def shown(category_id: int = CAR, height_px: float = 60.0) -> Picture:
    box = Annotation(
        category_id=category_id, box_xywh=(0, 0, 50, height_px), area_px=1, rle="", is_crowd=False, extras={}
    )
    return Picture(id=0, file_name="", height_px=800, width_px=1333, annotations=(box,))


def evaluated(pictures: list[Picture], bottom: float = 60.0) -> TallObjects[Picture]:
    evaluator: TallObjects[Picture] = TallObjects(lambda picture: picture)
    for picture in pictures:
        evaluator.update(picture, (Detection(category_id=CAR, box_px=(0, 0, 50, bottom), score=0.6),))
    return evaluator


@pytest.mark.parametrize(("cars", "is_known"), [(50, True), (49, False)])
def test_a_category_counts_from_fifty_instances_on(cars: int, is_known: bool) -> None:
    evaluator = evaluated([shown()] * cars)
    result, draw = evaluator.result(), np.array([np.arange(cars)])
    assert result["instances_car"] == cars
    if is_known:
        assert [result["ap50_car"], result["ap50"]] == pytest.approx([1.0, 1.0])
        assert evaluator.resampled(draw)["ap50_car"] == pytest.approx([1.0])
    else:
        assert math.isnan(result["ap50_car"]) and math.isnan(result["ap50"])
        assert "ap50_car" not in evaluator.resampled(draw) and np.isnan(evaluator.resampled(draw)["ap50"]).all()


@pytest.mark.parametrize(("height_px", "instances"), [(32.0, 1), (31.9, 0)])
def test_an_instance_counts_from_a_height_of_32_of_800_rows_on(height_px: float, instances: int) -> None:
    evaluator = evaluated([shown(height_px=height_px)], bottom=height_px)
    assert evaluator.result()["instances_car"] == instances
    found = evaluator.update(shown(height_px=height_px), ())["found_share"]
    assert found == 0.0 if instances else math.isnan(found)


def test_categories_outside_of_traffic_are_not_counted() -> None:
    evaluator: TallObjects[Picture] = TallObjects(lambda picture: picture)
    lamp = Detection(category_id=TRAFFIC_LIGHT, box_px=(0, 0, 50, 60), score=0.9)
    own = evaluator.update(shown(TRAFFIC_LIGHT), (lamp,))
    assert math.isnan(own["found_share"]) and own["false_alarms"] == 0
    assert "instances_traffic light" not in evaluator.result() and evaluator.result()["instances_car"] == 0


def test_without_pictures_nothing_is_known() -> None:
    result = TallObjects(lambda picture: picture).result()
    assert set(result) == {"ap50"} | {
        f"{stem}_{name}"
        for stem in ("ap50", "instances")
        for name in ("person", "bicycle", "car", "motorcycle", "bus", "truck")
    }
    assert all(math.isnan(value) for value in result.values())


@pytest.mark.parametrize(("bottom", "precision"), [(30.0, 1.0), (29.0, 0.0)])
def test_half_an_overlap_finds_an_instance(bottom: float, precision: float) -> None:
    assert evaluated([shown()] * 50, bottom=bottom).result()["ap50_car"] == pytest.approx(precision)
