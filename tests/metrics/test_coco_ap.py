import contextlib
import io
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from gear.formats import rle
from gear.formats.coco import Annotation, Detection, Picture, dataset_json, results_json
from gear.metrics.coco_ap import CocoEvaluator


def picture(number: int, *boxes: tuple[int, tuple[float, float, float, float], bool]) -> Picture:
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


IGNORED = ((100.0, 90.0, 180.0, 190.0), (5.0, 120.0, 60.0, 180.0))


def crowded(seed: int) -> tuple[Picture, list[Detection]]:
    """A picture of cars and persons, and detections near them, in ignored boxes, across their edges, and elsewhere."""
    rng = np.random.default_rng(seed)

    def box(low: float = 0.0) -> tuple[float, float, float, float]:
        x, y = rng.integers(low, 140, 2)
        width, height = rng.integers(10, 60, 2)
        return float(x), float(y), float(width), float(height)

    labels = [(int(rng.choice([1, 3])), box(), bool(rng.random() < 0.15)) for _ in range(5)]
    shown = picture(seed + 1, *labels)
    found = []
    for x, y, w, h in [*(label[1] for label in labels), *(box(80.0) for _ in range(6))]:
        dx, dy, dw, dh = rng.normal(0, 3, 4)
        edges = (x + dx, y + dy, x + dx + w + abs(dw), y + dy + h + abs(dh))
        found.append(Detection(category_id=int(rng.choice([1, 3, 3])), box_px=edges, score=float(rng.random())))
    return shown, found


def by_hand(pictures: list[tuple[Picture, list[Detection]]]) -> list[float]:
    """pycocotools' first twelve numbers, of an annotation file into which crowds are written by hand."""
    content = dataset_json([shown for shown, _ in pictures], description="", created="2022-01-01")
    for shown, _ in pictures:
        for left, top, right, bottom in shown.ignored_px:
            for category_id in (1, 3):
                content["annotations"].append({
                    "id": len(content["annotations"]) + 1, "image_id": shown.id, "category_id": category_id,
                    "bbox": [left, top, right - left, bottom - top], "area": (right - left) * (bottom - top),
                    "iscrowd": 1, "segmentation": {"size": [200, 200], "counts": ""},
                })  # fmt: skip
    truth = COCO()
    with contextlib.redirect_stdout(io.StringIO()):
        truth.dataset = content
        truth.createIndex()
        lines: list[Any] = [line for shown, found in pictures for line in results_json(shown.id, found)]
        evaluation = COCOeval(truth, truth.loadRes(lines), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return [float(value) for value in evaluation.stats]


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
@pytest.mark.parametrize("seed", range(4))
def test_ignored_boxes_are_crowds_of_every_category(seed: int) -> None:
    pictures = [crowded(20 * seed + i) for i in range(12)]
    silent = [(replace(shown, ignored_px=IGNORED), found) for shown, found in pictures]
    results = []
    for some in (pictures, silent):
        metric = evaluator()
        for shown, found in some:
            metric.update(shown, found)
        results.append(list(metric.result().values())[:12])
        assert results[-1] == pytest.approx([v if v >= 0 else math.nan for v in by_hand(some)], nan_ok=True)
    assert results[1][0] > results[0][0] + 0.01


@pytest.mark.parametrize(("left", "alarms"), [(60.0, 1), (85.0, 0)])
def test_half_of_it_in_an_ignored_box_is_no_false_alarm(left: float, alarms: int) -> None:
    """A detection of any category, 40 wide: the ignored box begins at 100."""
    shown = replace(picture(0, CAR), ignored_px=IGNORED)
    made_up = found(0.9, (left, 100, left + 40, 140), category_id=73)
    assert evaluator().update(shown, [found(0.9), made_up]) == {"found_share": 1, "false_alarms": alarms}


def test_an_object_in_an_ignored_box_is_still_to_be_found() -> None:
    shown = replace(picture(0, (3, (110.0, 100.0, 50.0, 60.0), False)), ignored_px=IGNORED)
    metric = evaluator()
    metric.update(shown, [])
    assert metric.result()["ap"] == 0
    metric = evaluator()
    metric.update(shown, [found(0.9, (110, 100, 160, 160)), found(0.95, (112, 110, 178, 180))])
    assert metric.result()["ap"] == pytest.approx(1)


def test_a_size_that_no_label_has_is_not_known() -> None:
    """The car has 6000 px2, which COCO calls medium."""
    metric = evaluator()
    metric.update(picture(0, CAR), [found(0.9)])
    result = metric.result()
    assert [result["ap_medium"], result["ar_medium"]] == pytest.approx([1.0, 1.0])
    for name in ("ap_small", "ap_large", "ar_small", "ar_large"):
        assert math.isnan(result[name]), name


def test_without_labels_nothing_is_known() -> None:
    result = evaluator().result()
    assert len(result) == 12 and all(math.isnan(value) for value in result.values())


def test_names_of_categories_have_no_spaces() -> None:
    metric = evaluator()
    metric.update(picture(0, (10, (20.0, 20.0, 100.0, 60.0), False)), [found(0.9, category_id=10)])
    assert metric.result()["ap_traffic_light"] == pytest.approx(1.0)
    assert metric.resampled(np.array([[0, 0]]))["ap_traffic_light"] == pytest.approx([1.0])


def test_a_false_alarm_of_any_height_counts() -> None:
    flat = found(0.9, (150, 150, 190, 150.5))
    assert evaluator().update(picture(0, CAR), [flat])["false_alarms"] == 1


def test_every_metric_is_a_share() -> None:
    assert evaluator().range_of("ap") == (0.0, 1.0)


def test_a_false_alarm_counts_among_the_sizes_of_its_own_box() -> None:
    """190 x 10 px are 1900 px2, medium as the car is; 150 x 100 px are large, and no alarm among medium objects."""
    for box, precision in (((0, 185, 190, 195), 0.5), ((50, 85, 200, 185), 1.0)):
        metric = evaluator()
        metric.update(picture(0, CAR), [found(0.5), found(0.9, box)])
        assert metric.result()["ap_medium"] == pytest.approx(precision)


def test_a_box_without_width_or_height_is_a_detection_that_finds_nothing() -> None:
    for box in ((50, 20, 50, 80), (20, 50, 120, 50)):
        assert evaluator().update(picture(0, CAR), [found(0.9, box)]) == {"found_share": 0, "false_alarms": 1}
