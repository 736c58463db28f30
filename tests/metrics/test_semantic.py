import contextlib
import importlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gear.formats.png import encode_labels
from gear.metrics.semantic import AVERAGE_INSTANCE_PX, PIECE_PX, PresentClasses, SemanticEvaluator


@dataclass(frozen=True)
class Labelled:
    instance_ids: np.ndarray

    @property
    def label_ids(self) -> np.ndarray:
        ids = self.instance_ids
        return np.where(ids >= 1000, ids // 1000, ids).astype(np.uint8)


def labelled(seed: int) -> Labelled:
    rng = np.random.default_rng(seed)
    picture = np.full((120, 200), 23, dtype=np.uint16)
    picture[70:] = 7
    picture[20:80, 20:90] = 11
    picture[100:, :30] = 4
    for number in range(4):
        x, y = int(rng.integers(10, 190)), int(rng.integers(60, 110))
        cv2.ellipse(
            picture,
            (x, y),
            (int(rng.integers(4, 30)), 9),
            0,
            0,
            360,
            int(rng.choice([24, 26, 29, 33])) * 1000 + number,
            -1,
        )
    return Labelled(picture)


def spoilt(sample: Labelled, seed: int) -> np.ndarray:
    prediction = np.roll(sample.label_ids, 5, axis=1)
    prediction[:, 150:170] = 21
    prediction[10:20, :50] = 9
    for label, share in ((25, 0.02), (29, 0.03), (30, 0.03)):  # rider; caravan and trailer, which are not evaluated
        prediction[np.random.default_rng(seed + label).random(prediction.shape) < share] = label
    return prediction


def test_by_hand() -> None:
    # Cars of 8 and of 2 pixels on road: one pixel of the large one is missed, two of road are taken for car.
    picture = np.full((4, 8), 7, dtype=np.uint16)
    picture[0] = 26000
    picture[3, :2] = 26001
    sample = Labelled(picture)
    prediction = sample.label_ids.copy()
    prediction[0, 0] = 7
    prediction[1, :2] = 26
    evaluator = SemanticEvaluator()
    own = evaluator.update(sample, prediction)
    result = evaluator.result()
    road, car = 20 / 23, 9 / 12
    assert own["miou"] == result["miou"] == pytest.approx((road + car) / 2)
    size = AVERAGE_INSTANCE_PX["car"]
    tp, fn = 7 * size / 8 + 2 * size / 2, 1 * size / 8
    assert result["iiou"] == pytest.approx(tp / (tp + fn + 2))
    assert result["iou_road"] == pytest.approx(road) and result["iou_car"] == pytest.approx(car)
    assert result["pixel_accuracy"] == pytest.approx(29 / 32)
    assert np.isnan(result["iou_bus"])


def test_what_is_not_evaluated_counts_nowhere() -> None:
    picture = np.full((4, 8), 7, dtype=np.uint16)
    picture[2:] = 4
    prediction = np.full((4, 8), 7, dtype=np.uint8)
    evaluator = SemanticEvaluator()
    evaluator.update(Labelled(picture), prediction)
    assert evaluator.result()["miou"] == 1.0


def test_agrees_with_the_official_tool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "in1d", lambda a, b, **k: np.isin(np.ravel(a), b, **k), raising=False)
    tool = importlib.import_module("cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling")
    helpers = importlib.import_module("cityscapesscripts.helpers.labels")
    evaluator, truths, found = SemanticEvaluator(), [], []
    for seed in range(3):
        sample, prediction = labelled(seed), spoilt(labelled(seed), seed)
        evaluator.update(sample, prediction)
        stem = tmp_path / f"gearaachen_{seed:06d}_000000_gtFine"
        Path(f"{stem}_labelIds.png").write_bytes(encode_labels(sample.label_ids))
        Path(f"{stem}_instanceIds.png").write_bytes(encode_labels(sample.instance_ids))
        Path(f"{stem}_found.png").write_bytes(encode_labels(prediction))
        truths.append(f"{stem}_labelIds.png")
        found.append(f"{stem}_found.png")
    tool.args.evalLabels = [label.id for label in helpers.labels if label.id >= 0]
    tool.args.JSONOutput, tool.args.quiet = False, True
    with contextlib.redirect_stdout(io.StringIO()):
        official: dict[str, Any] = tool.evaluateImgLists(found, truths, tool.args)
    result = evaluator.result()
    pairs = {
        "miou": "averageScoreClasses",
        "iiou": "averageScoreInstClasses",
        "category_miou": "averageScoreCategories",
        "category_iiou": "averageScoreInstCategories",
    }
    for ours, theirs in pairs.items():
        assert 0.1 < result[ours] < 0.99
        assert result[ours] == pytest.approx(official[theirs], abs=1e-9), json.dumps(result)
    for name, value in official["classScores"].items():
        if value == value and f"iou_{name.replace(' ', '_')}" in result:
            assert result[f"iou_{name.replace(' ', '_')}"] == pytest.approx(value, abs=1e-9)


def test_average_sizes_are_the_official_ones() -> None:
    tool = importlib.import_module("cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling")
    assert tool.args.avgClassSize == AVERAGE_INSTANCE_PX


@pytest.mark.parametrize("kind", [SemanticEvaluator, PresentClasses])
def test_merged_pictures_count_as_if_one_had_seen_them_all(kind: type[SemanticEvaluator]) -> None:
    whole, first, second = kind(), kind(), kind()
    for seed, part in enumerate((first, first, second, second)):
        for evaluator in (whole, part):
            evaluator.update(labelled(seed), spoilt(labelled(seed), seed))
    first.merge(second)
    assert first.result() == pytest.approx(whole.result(), nan_ok=True)


def test_large_pictures_are_counted_whole() -> None:
    """They are taken in pieces."""
    rng = np.random.default_rng(2)
    truth = rng.integers(7, 14, (3, PIECE_PX // 2 + 77)).astype(np.uint16)
    prediction = rng.integers(7, 14, truth.shape).astype(np.uint8)
    evaluator = SemanticEvaluator()
    evaluator.update(Labelled(truth), prediction)
    for label, train_id_name in ((7, "road"), (11, "building"), (13, "fence")):
        both = (truth == label) & (prediction == label)
        either = ((truth == label) | (prediction == label)) & np.isin(truth, [7, 8, 11, 12, 13])
        assert evaluator.result()[f"iou_{train_id_name}"] == pytest.approx(both.sum() / either.sum(), abs=1e-12)


def test_wrong_predictions_are_refused() -> None:
    sample = labelled(0)
    with pytest.raises(ValueError, match="shape"):
        SemanticEvaluator().update(sample, np.zeros((2, 2), dtype=np.uint8))
    with pytest.raises(ValueError, match="label ids"):
        SemanticEvaluator().update(sample, np.full((120, 200), 255, dtype=np.uint8))
    with pytest.raises(ValueError, match="whole numbers, got float32"):
        SemanticEvaluator().update(sample, sample.label_ids.astype(np.float32))


def test_an_id_below_0_is_no_pixel_of_the_class_before() -> None:
    """Minus one is what networks say of what they do not know; it would land among the pixels of the label before."""
    sample = labelled(0)
    unsure = np.where(sample.label_ids == 7, -1, sample.label_ids.astype(np.int64))
    with pytest.raises(ValueError, match=r"label ids 0\.\.33, got -1"):
        SemanticEvaluator().update(sample, unsure)


def test_names_of_classes_have_no_spaces() -> None:
    sample = Labelled(np.full((4, 8), 19, dtype=np.uint16))
    for evaluator in (SemanticEvaluator(), PresentClasses()):
        evaluator.update(sample, sample.label_ids)
        assert evaluator.result()["iou_traffic_light"] == 1.0


def test_a_single_pixel_of_a_class_is_its_presence() -> None:
    picture = np.full((4, 8), 7, dtype=np.uint16)
    picture[1, 2] = 19
    sample = Labelled(picture)
    evaluator = PresentClasses()
    evaluator.update(sample, np.full((4, 8), 7, dtype=np.uint8))
    result = evaluator.result()
    assert (result["iou_traffic_light"], result["iou_road"]) == (0.0, pytest.approx(31 / 32))
    assert result["miou"] == pytest.approx(31 / 64)


def test_every_metric_is_a_share() -> None:
    assert SemanticEvaluator().range_of("miou") == (0.0, 1.0)


def test_the_first_and_the_last_id_may_be_predicted_and_no_later_one() -> None:
    sample = Labelled(np.full((4, 8), 7, dtype=np.uint16))
    for label in (0, 33):
        assert SemanticEvaluator().update(sample, np.full((4, 8), label, dtype=np.uint8))["miou"] == 0.0
    with pytest.raises(ValueError, match="got 34"):
        SemanticEvaluator().update(sample, np.full((4, 8), 34, dtype=np.uint8))


def test_a_picture_without_pixels_has_no_metric() -> None:
    empty = Labelled(np.zeros((0, 8), dtype=np.uint16))
    assert np.isnan(SemanticEvaluator().update(empty, np.zeros((0, 8), dtype=np.uint8))["miou"])
