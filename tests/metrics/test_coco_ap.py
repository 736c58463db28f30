import math

import pytest

from gear.formats import rle
from gear.formats.coco import Annotation, Detection, Picture
from gear.metrics.coco_ap import CocoEvaluator


def picture(number: int, *boxes: tuple[int, tuple[float, float, float, float], bool]) -> Picture:
    import numpy as np

    annotations = []
    for category_id, (x, y, w, h), is_crowd in boxes:
        mask = np.zeros((200, 200), dtype=np.bool_)
        mask[int(y) : int(y + h), int(x) : int(x + w)] = True
        annotations.append(Annotation(category_id=category_id, box_xywh=(x, y, w, h), area_px=int(w * h),
                                      rle=rle.encode(mask), is_crowd=is_crowd, extras={}))  # fmt: skip
    return Picture(id=number, file_name=f"{number}.png", height_px=200, width_px=200, annotations=tuple(annotations))


CAR = (3, (20.0, 20.0, 100.0, 60.0), False)


def found(score: float, box: tuple[float, float, float, float] = (20, 20, 120, 80), category_id: int = 3) -> Detection:
    return Detection(category_id=category_id, box_px=box, score=score)


def evaluator() -> CocoEvaluator[Picture]:
    return CocoEvaluator(lambda sample: sample)


def test_a_false_alarm_above_the_hit_halves_the_precision() -> None:
    metric = evaluator()
    metric.update(picture(0, CAR), [found(0.5), found(0.9, (150, 150, 190, 190))])
    result = metric.result()
    assert result["ap"] == result["ap_car"] == pytest.approx(0.5)


def test_ignored_objects_count_neither_way() -> None:
    metric = evaluator()
    metric.update(picture(0, CAR, (3, (150, 150, 40, 40), True)), [found(0.5), found(0.9, (150, 150, 190, 190))])
    assert metric.result()["ap"] == pytest.approx(1.0)
    metric.update(picture(1, CAR, (3, (150, 150, 40, 40), True)), [found(0.5)])
    assert metric.result()["ap"] == pytest.approx(1.0)


def test_the_mean_is_over_what_occurs() -> None:
    metric = evaluator()
    metric.update(picture(0, CAR, (1, (150, 100, 30, 60), False)), [found(0.9)])
    result = metric.result()
    assert result["ap"] == pytest.approx(0.5)
    assert (result["ap_car"], result["ap_person"]) == (pytest.approx(1.0), pytest.approx(0.0))
    assert "ap_bus" not in result


def test_a_pictures_own_metrics_know_width_from_height() -> None:
    """The upper half of a car that is 100 wide and 60 high, and its left half."""
    upper, left = (found(0.9, box) for box in ((20, 20, 120, 51), (20, 20, 71, 80)))
    for half in (upper, left):
        assert evaluator().update(picture(0, CAR), [half]) == {"found_share": 1, "false_alarms": 0}


def test_no_detections_is_nothing_found() -> None:
    metric = evaluator()
    metric.update(picture(0, CAR), [])
    assert metric.result()["ap"] == 0.0


def test_merged_pictures_may_share_their_numbers() -> None:
    first, second = evaluator(), evaluator()
    first.update(picture(0, CAR), [found(0.9)])
    second.update(picture(0, CAR), [])
    first.merge(second)
    assert first.result()["ap"] == pytest.approx(0.5, abs=0.01)
    third = evaluator()
    third.update(picture(0, CAR), [found(0.9)])
    first.merge(third)
    assert first.result()["ap"] == pytest.approx(2 / 3, abs=0.01), "what the other one found has come along"


def test_categories_have_their_metrics_over_all_sizes_and_a_hundred_detections() -> None:
    small = (3, (150.0, 150.0, 20.0, 20.0), False)
    alarms = [found(0.9 - i / 1000, (10 * i, 180, 10 * i + 8, 188), category_id=1) for i in range(11)]
    metric = evaluator()
    metric.update(
        picture(0, CAR, small, (1, (150, 100, 30, 60), False)),
        [found(0.9), found(0.8, (150, 150, 170, 170)), *alarms, found(0.1, (150, 100, 180, 160), category_id=1)],
    )
    result = metric.result()
    assert result["ap_car"] == pytest.approx(1.0)
    assert result["ap_person"] == pytest.approx(1 / 12), "the twelfth detection is the first right one"


def test_bad_detections_are_refused() -> None:
    with pytest.raises(ValueError, match="category_id"):
        evaluator().update(picture(0, CAR), [found(0.9, category_id=12)])
    with pytest.raises(ValueError, match="box_px"):
        evaluator().update(picture(0, CAR), [found(0.9, (50, 20, 20, 80))])
    for bad in (found(math.nan), found(math.inf), found(0.9, (20, 20, math.inf, 80))):
        with pytest.raises(ValueError, match="finite"):
            evaluator().update(picture(0, CAR), [bad])
