"""Every promise of a task, and COCO's evaluation, written again from its publication, on the files."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest
from gear.testing.model_contract import ModelContract
from gear.testing.task_contract import INFO, TaskContract

from gear_task_panoptic import parts, spec
from gear_task_panoptic.baseline import in_parts
from gear_task_panoptic.panoptic import as_panoptic, id_to_rgb, rgb_to_id, segments_info
from gear_task_panoptic.quality import Panoptic, QualityEvaluator, Segment, match


class TestPanoptic(TaskContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = {"width_px": 256, "height_px": 128}
    headline = "pq"

    def spoil(self, prediction: Any) -> Any:
        return dataclasses.replace(prediction, ids=np.roll(prediction.ids, 6, axis=1))

    def test_files_are_coco_panoptic_and_ground_truth_is_perfect(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        table = json.loads((tmp_path / "annotations/panoptic_val.json").read_text())
        for annotation in table["annotations"]:
            ids = read_ids(tmp_path / "annotations/panoptic_val" / annotation["file_name"])
            assert {s["id"] for s in annotation["segments_info"]} == set(np.unique(ids).tolist()) - {0}
            for segment in annotation["segments_info"]:
                assert segment["area"] == int((ids == segment["id"]).sum())
                x, y, w, h = segment["bbox"]
                assert (ids[y : y + h, x : x + w] == segment["id"]).sum() == segment["area"]
        metrics = reference_quality(tmp_path, table, lambda ids: ids)
        assert metrics == {"pq": 1.0, "things": 1.0, "stuff": 1.0}

    @pytest.mark.filterwarnings("ignore")
    def test_cityscapes_own_evaluation_finds_it_perfect(self, tmp_path: Path) -> None:
        """The official script for panoptic Cityscapes, on COCO panoptic files and this task's own result files."""
        from cityscapesscripts.evaluation.evalPanopticSemanticLabeling import evaluatePanoptic

        self.write(tmp_path)
        task: Any = self.task()
        samples = [self.sample(index) for index in (0, 1)]
        kept = [task.encode_prediction(sample, task.as_prediction(sample), INFO) for sample in samples]
        facts = [(sample.record, one.facts) for sample, one in zip(samples, kept, strict=True)]
        files = dict(task.finalise_predictions(facts, INFO))
        for one in kept:
            files |= one.files
        for path, data in files.items():
            (tmp_path / "results" / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / "results" / path).write_bytes(data)
        metrics = evaluatePanoptic(
            str(tmp_path / "annotations/panoptic_val.json"),
            str(tmp_path / "annotations/panoptic_val"),
            str(tmp_path / "results/panoptic.json"),
            str(tmp_path / "results/panoptic"),
            str(tmp_path / "official.json"),
        )
        assert {name: metrics[name]["pq"] for name in ("All", "Things", "Stuff")} == {
            "All": 1.0,
            "Things": 1.0,
            "Stuff": 1.0,
        }

    def test_the_evaluator_agrees_with_the_published_algorithm(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        table = json.loads((tmp_path / "annotations/panoptic_val.json").read_text())
        expected = reference_quality(tmp_path, table, lambda ids: np.roll(ids, 3, axis=1))
        evaluator = self.task().evaluator()
        for index in (0, 1):
            sample = self.sample(index)
            moved = np.roll(sample.panoptic.ids, 3, axis=1)
            evaluator.update(sample, dataclasses.replace(sample.panoptic, ids=moved))
        result = evaluator.result()
        assert 0.2 < expected["pq"] < 0.99
        assert result["pq"] == pytest.approx(expected["pq"])
        assert result["pq_things"] == pytest.approx(expected["things"])
        assert result["pq_stuff"] == pytest.approx(expected["stuff"])


class TestParts(ModelContract):
    spec = parts
    options: ClassVar[dict[str, Any]] = {"weights": "none"}

    def test_parts_are_things_apart(self) -> None:
        labels = np.full((20, 40), 7, np.uint8)
        labels[5:15, 2:12] = labels[5:15, 20:34] = 26
        labels[0, 0] = 26
        instances = in_parts(labels, least_px=50)
        assert set(np.unique(instances).tolist()) == {0, 7, 26000, 26001}
        assert (instances == 26000).sum() == 140 and instances[0, 0] == 0
        assert {s.category_id for s in as_panoptic(instances).segments} == {7, 26}


def read_ids(path: Path) -> np.ndarray:
    bgr = cv2.imread(str(path)).astype(np.int64)
    return np.asarray(bgr[..., 2] + 256 * bgr[..., 1] + 65536 * bgr[..., 0])


def reference_quality(root: Path, table: Any, predict: Any) -> dict[str, float]:
    """Kirillov et al., section 4, pixel by pixel, on the files; predicted segments are those of the truth."""
    iou: Counter[int] = Counter()
    tp: Counter[int] = Counter()
    fp: Counter[int] = Counter()
    fn: Counter[int] = Counter()
    for annotation in table["annotations"]:
        ids = read_ids(root / "annotations/panoptic_val" / annotation["file_name"])
        said = predict(ids)
        kind = {s["id"]: s["category_id"] for s in annotation["segments_info"]}
        assert not any(s["iscrowd"] for s in annotation["segments_info"])
        matched = set()
        for real_id, category in kind.items():
            best = None
            for said_id in set(np.unique(said[ids == real_id]).tolist()) - {0}:
                real_mask, said_mask = ids == real_id, (said == said_id) & (ids != 0)
                share = (real_mask & said_mask).sum() / (real_mask | said_mask).sum()
                if kind[said_id] == category and share > 0.5:
                    best = (share, said_id)
            if best:
                iou[category] += best[0]
                tp[category] += 1
                matched.add(best[1])
            else:
                fn[category] += 1
        for said_id in set(np.unique(said).tolist()) - {0} - matched:
            if (ids[said == said_id] == 0).mean() <= 0.5:
                fp[kind[said_id]] += 1
    things = {c["id"] for c in table["categories"] if c["isthing"]}
    pq = {c: iou[c] / (tp[c] + fp[c] / 2 + fn[c] / 2) for c in {*tp, *fp, *fn}}
    return {
        "pq": float(np.mean(list(pq.values()))),
        "things": float(np.mean([v for c, v in pq.items() if c in things])),
        "stuff": float(np.mean([v for c, v in pq.items() if c not in things])),
    }


def test_ids_survive_colours() -> None:
    ids = np.array([[0, 7, 26001], [65536, 255, 256]], np.int32)
    assert np.array_equal(rgb_to_id(id_to_rgb(ids)), ids)


def test_void_and_crowds_are_not_held_against_a_prediction() -> None:
    ids = np.array([[0, 0, 26, 26, 7, 7]], np.int32)
    truth = Panoptic(ids=ids, segments=(Segment(id=26, category_id=26, is_crowd=True), Segment(id=7, category_id=7)))
    said = Panoptic(
        ids=np.array([[1, 1, 2, 2, 7, 7]], np.int32),
        segments=(Segment(id=1, category_id=24), Segment(id=2, category_id=26), Segment(id=7, category_id=7)),
    )
    assert match(truth, said) == {7: [1.0, 1.0, 0.0, 0.0]}
    wrong = dataclasses.replace(said, segments=(said.segments[0], Segment(id=2, category_id=24), said.segments[2]))
    assert match(truth, wrong)[24] == [0.0, 0.0, 1.0, 0.0]


def test_a_missed_car_costs() -> None:
    truth = Panoptic(ids=np.full((2, 2), 26000, np.int32), segments=(Segment(id=26000, category_id=26),))
    evaluator = QualityEvaluator(frozenset({26}))
    evaluator.counts = match(truth, Panoptic(ids=np.zeros((2, 2), np.int32), segments=()))
    assert evaluator.result()["pq"] == 0.0
    assert segments_info(truth)[0]["bbox"] == [0, 0, 2, 2]
