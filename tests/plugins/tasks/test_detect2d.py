import contextlib
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from gear.augment.apply import shrunk
from gear.formats import rle
from gear.formats.coco import Detection
from gear.groundtruth.visibility import Visibility
from gear.metrics.coco_reference import CATEGORIES
from gear.plugins.tasks.detect2d import Detect2dConfig, Detect2dTask, detect2d, flip
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import INFO, TaskContract
from gear.testing.things import CAR, CYCLIST, PERSON, Part, Thing, board, box_part

# pycocotools 2.0.11 has not caught up with NumPy 2's protocol.
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


def load(path: Path) -> COCO:
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(str(path))


class TestDetect2d(TaskContract):
    spec = detect2d
    options: ClassVar = {"width_px": 667, "height_px": 400}
    headline = "ap"
    undirected = frozenset(f"reference.instances_{name}" for name in CATEGORIES)

    def spoil(self, prediction: Any) -> Any:
        return tuple(replace(found, box_px=tuple(v + 9 for v in found.box_px)) for found in prediction)

    def test_pycocotools_reads_exact_masks_boxes_and_areas(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        both = [tmp_path / "annotations/instances_val.json", tmp_path / "annotations/val/coco_annotations.json"]
        assert both[0].read_bytes() == both[1].read_bytes()
        coco = load(both[0])
        assert len(coco.cats) == 80 and sorted(coco.imgs) == [1, 2]
        assert sorted(coco.anns) == list(range(1, len(coco.anns) + 1))
        for image_id in coco.imgs:
            frame, _ = self.frame(image_id - 1)
            view = frame.views["left"]
            picture = tmp_path / "images/val" / coco.imgs[image_id]["file_name"]
            assert picture.is_file()
            annotations = coco.imgToAnns[image_id]
            assert {a["category_id"] for a in annotations} >= {1, 2, 3, 8, 10}
            for annotation in annotations:
                mask = coco.annToMask(annotation).astype(bool)
                of_object = frame.geoms.object_id[view.geom_id] == annotation["gear"]["object_id"]
                assert (mask & (view.geom_id < 0)).sum() == 0
                assert (mask & ~of_object).sum() == 0
                assert annotation["area"] == mask.sum() == coco_mask.area(coco.annToRLE(annotation))
                assert annotation["bbox"] == list(coco_mask.toBbox(coco.annToRLE(annotation)))
        assert any(a["iscrowd"] == 0 for a in coco.anns.values())

    def test_training_code_that_knows_polygons_alone_reads_single_objects(self, tmp_path: Path) -> None:
        """The steps of `convert_coco_poly_to_mask` in torchvision's references and in DETR's processors."""
        self.write(tmp_path)
        content = json.loads((tmp_path / "annotations/instances_val.json").read_text())
        exact = load(tmp_path / "annotations/instances_val.json")
        single = [one for one in content["annotations"] if not one["iscrowd"]]
        assert len(single) > 10
        for annotation in single:
            polygons = annotation["segmentation"]
            mask = coco_mask.decode(coco_mask.frPyObjects(polygons, 400, 667)).any(axis=2)
            assert all(len(polygon) >= 6 and len(polygon) % 2 == 0 for polygon in polygons)
            assert mask.sum() == annotation["area"] and np.array_equal(mask, exact.annToMask(annotation))

    def test_run_lengths_describe_the_same_masks(self, tmp_path: Path) -> None:
        self.write(tmp_path / "polygons")
        content = json.loads((tmp_path / "polygons/annotations/instances_val.json").read_text())
        task = Detect2dTask(Detect2dConfig(width_px=667, height_px=400, masks="rle"))
        sidecars = [self.sidecar(sample, task.encode(sample, INFO)) for sample in map(self.sample, (0, 1))]
        other = json.loads(task.finalise(sidecars, INFO)["annotations/instances_val.json"])
        polygons, lengths = COCO(), COCO()
        polygons.dataset, lengths.dataset = content, other
        for coco in (polygons, lengths):
            coco.createIndex()
        assert {type(one["segmentation"]) for one in other["annotations"]} == {dict}
        for one, two in zip(content["annotations"], other["annotations"], strict=True):
            assert np.array_equal(polygons.annToMask(one), lengths.annToMask(two))
            assert {k: v for k, v in one.items() if k != "segmentation"} == {
                k: v for k, v in two.items() if k != "segmentation"
            }

    @pytest.mark.parametrize("kind", ["bbox", "segm"])
    def test_ground_truth_scores_perfect_with_the_official_tool(self, tmp_path: Path, kind: str) -> None:
        self.write(tmp_path)
        coco = load(tmp_path / "annotations/instances_val.json")
        found = [
            {k: a[k] for k in ("image_id", "category_id", "bbox", "segmentation")} | {"score": 0.9}
            for a in coco.anns.values()
            if not a["iscrowd"]
        ]
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation = COCOeval(coco, coco.loadRes(found), kind)
            evaluation.evaluate()
            evaluation.accumulate()
            evaluation.summarize()
        assert evaluation.stats[0] == pytest.approx(1.0)

    def test_a_detection_with_iou_half_has_the_value_computed_by_hand(self) -> None:
        # Boxes shrunk to 82 % of their width have IoU 0.82: right at 0.50, .55, …, .80 and wrong at .85, .90, .95.
        task, sample = self.task(), self.sample()
        evaluator = task.evaluator()
        shrunk = []
        for found in task.as_prediction(sample):
            left, top, right, bottom = found.box_px
            shrunk.append(replace(found, box_px=(left, top, left + 0.82 * (right - left), bottom)))
        evaluator.update(sample, tuple(shrunk))
        result = evaluator.result()
        assert result["ap"] == pytest.approx(0.7)
        assert result["ap50"] == pytest.approx(1.0)


def observe(things: list[Thing], **limits: Any) -> list[Any]:
    task = Detect2dTask(
        Detect2dConfig(width_px=667, height_px=400, visibility=Visibility(**({"preset": "coco"} | limits)))
    )
    sample = task.ground_truth(*synthetic_frame(task.rig(), things))
    return list(sample.objects)


def car(ahead_m: float, left_m: float = 0.0, object_id: int = 2) -> Thing:
    return Thing(parts=CAR, position_m=(ahead_m, left_m, 0.0), object_id=object_id, role="npc")


def test_a_cyclist_is_a_bicycle_and_a_person() -> None:
    objects = observe([Thing(parts=CYCLIST, position_m=(9.0, 0.0, 0.0), object_id=2, role="npc")])
    assert sorted((o.category_id, o.label) for o in objects) == [(1, "rider"), (2, "bicycle")]
    bicycle, rider = sorted(objects, key=lambda o: -o.category_id)
    assert rider.box_px[3] <= bicycle.box_px[1] + 2


def test_a_far_car_is_ignored_not_labelled() -> None:
    (near,) = observe([car(12.0)])
    assert not near.is_ignored
    (far,) = observe([car(12.0)], max_distance_m=10.0)
    assert far.is_ignored
    assert far.distance_m == pytest.approx(np.hypot(10.5, 0.9), abs=1e-3)


def test_a_hidden_person_is_never_labelled_as_whole() -> None:
    behind = Thing(parts=PERSON, position_m=(16.0, 0.0, 0.0), object_id=3, role="pedestrian")
    objects = {o.object_id: o for o in observe([car(10.0), behind], min_box_area_px2=0, min_visible_px=0)}
    person = objects[3]
    assert person.occluded_fraction > 0.4
    assert person.amodal_box_px[3] > person.box_px[3] + 10
    assert person.visible_fraction == pytest.approx(1 - person.occluded_fraction, abs=1e-6)
    (ignored,) = (o for o in observe([car(10.0), behind], min_visible_fraction=0.95) if o.object_id == 3)
    assert ignored.is_ignored


def test_a_cropped_car_says_so() -> None:
    (cropped,) = observe([car(4.5, 3.0)])
    assert cropped.truncated_fraction > 0.3
    assert cropped.amodal_box_px[0] < 0 <= cropped.box_px[0]


def test_three_pixels_are_not_mentioned() -> None:
    far = car(150.0)
    (seen,) = observe([far], min_pixels_px=1)
    assert seen.area_px > 3
    assert observe([far], min_pixels_px=seen.area_px + 1) == []


def test_what_is_tall_enough_is_so_in_a_smaller_picture_too() -> None:
    """24 of 400 rows are 48 of 800, where 32 are enough; so are 12 of 200."""
    task = Detect2dTask(Detect2dConfig(width_px=667, height_px=400, visibility=Visibility(preset="coco")))
    sample = task.ground_truth(*synthetic_frame(task.rig(), [car(25.0)]))
    for share, height_px in ((1.0, 24), (0.5, 12)):
        small = shrunk(sample, share)
        (thing,) = small.objects
        assert thing.box_px[3] - thing.box_px[1] == height_px and not thing.is_ignored
        evaluator = task.reports()["reference"]
        assert evaluator.update(small, task.as_prediction(small))["found_share"] == 1
        assert evaluator.result()["instances_car"] == 1


def test_stray_pixels_do_not_stretch_a_box() -> None:
    """Of what stands behind a wall with a slit, the part beside the wall is labelled, not the line in the slit."""
    part = Part(label="person", centre_m=(0.0, 0.0, 0.9), size_m=(0.3, 3.0, 1.8))
    wall = [
        Thing(parts=(box_part("building", 0.1, 0.8, 3.0),), position_m=(10.0, -0.5, 0.0)),
        Thing(parts=(box_part("building", 0.1, 2.0, 3.0),), position_m=(10.0, -1.94, 0.0)),
    ]
    wide = Thing(parts=(part,), position_m=(14.0, 0.0, 0.0), object_id=3, role="pedestrian")
    (seen,) = observe([wide])
    (hidden,) = observe([wide, *wall])
    assert hidden.box_px[0] == seen.box_px[0] and hidden.box_px[2] < seen.box_px[2] - 20
    assert hidden.visible_fraction > hidden.area_px / seen.area_px
    decoded = rle.decode(hidden.rle, 400, 667)
    assert decoded.sum() == hidden.area_px == (hidden.box_px[2] - hidden.box_px[0]) * (seen.box_px[3] - seen.box_px[1])


def test_annotations_keep_the_masks_order(tmp_path: Path) -> None:
    objects = observe([car(10.0, 2.0, 2), car(12.0, -2.0, 3)])
    left, right = objects
    assert rle.decode(left.rle, 400, 667)[:, :333].any() and not rle.decode(left.rle, 400, 667)[:, 333:].any()
    assert rle.decode(right.rle, 400, 667)[:, 334:].any()
    assert json.dumps(left.rle)


def test_without_the_patch_ignores_its_box_and_objects_that_lie_on_it() -> None:
    """A car beside a board, a person in front of it, and detections here and there."""
    task = Detect2dTask(Detect2dConfig(width_px=667, height_px=400, visibility=Visibility(preset="coco")))
    things = [
        car(12.0, 4.0),
        board(14.0, -2.0),
        Thing(parts=PERSON, position_m=(9.0, -1.3, 0.0), object_id=3, role="pedestrian"),
    ]
    sample = task.ground_truth(*synthetic_frame(task.rig(), things))
    (surface,) = sample.surfaces
    patch = rle.decode(surface.mask_rle, 400, 667)
    silent = task.without(sample, {"left": patch})
    (region,) = silent.ignored_px
    rows, columns = np.nonzero(patch)
    assert region == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    assert silent.objects == sample.objects, "the person hides the patch, not the other way round"
    left, top, right, bottom = region
    on_it = coco_detection(8, (left + 5, top + 5, right - 5, bottom - 5))
    beside = coco_detection(8, (left - 60, top, left + 10, bottom))
    truth = task.as_prediction(sample)
    for given, expected in (((on_it,), (1, 0)), ((beside,), (1, 1)), ((on_it, beside), (2, 1))):
        alarms = tuple(task.evaluator().update(one, (*truth, *given))["false_alarms"] for one in (sample, silent))
        assert alarms == expected
    whole = rle.decode(next(o for o in sample.objects if o.object_id == 2).rle, 400, 667)
    covered = task.without(sample, {"left": whole})
    assert [o.object_id for o in covered.objects if o.is_ignored] == [2]
    for kept, is_ignored in ((0.45, False), (0.55, True)):
        part = whole & (np.cumsum(whole).reshape(whole.shape) <= kept * whole.sum())
        assert any(o.is_ignored for o in task.without(sample, {"left": part}).objects) == is_ignored


def coco_detection(category_id: int, box_px: tuple[float, float, float, float]) -> Detection:
    return Detection(category_id=category_id, box_px=box_px, score=0.9)


def test_ignored_boxes_move_with_the_picture() -> None:
    task = Detect2dTask(Detect2dConfig(width_px=667, height_px=400))
    sample = task.ground_truth(*synthetic_frame(task.rig(), [car(12.0), board(14.0, -2.0)]))
    patch = rle.decode(sample.surfaces[0].mask_rle, 400, 667)
    silent = task.without(sample, {"left": patch})
    assert flip(silent).ignored_px == task.without(sample, {"left": patch[:, ::-1]}).ignored_px
    (region,) = shrunk(silent, 0.5).ignored_px
    assert region == pytest.approx([side / 2 for side in silent.ignored_px[0]], abs=0.6)
