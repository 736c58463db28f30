import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from matplotlib.path import Path as Outline

from gear.formats.coco import CATEGORY_NAMES
from gear.formats.exports.yolo import YoloOptions, yolo_tree
from gear.formats.rle import decode
from gear.plugins.datasets import open_dataset
from gear.testing.task_contract import INFO
from gear.values.errors import DatasetError
from gear.verbs.export import export
from tests.formats.exports.trees import dataset, split_of


def filled(corners: np.ndarray, height: int, width: int) -> np.ndarray:
    """(height, width) which pixels have their centre in a polygon."""
    rows, columns = np.mgrid[:height, :width] + 0.5
    centres = np.column_stack([columns.reshape(-1), rows.reshape(-1)])
    return Outline(corners, closed=False).contains_points(centres).reshape(height, width)


@pytest.mark.parametrize("masks", ["polygons", "rle"])
def test_boxes_and_polygons_are_those_of_the_dataset(tmp_path: Path, masks: str) -> None:
    data = dataset(tmp_path / "data", "detect2d", ("val", "test"), masks=masks)
    export(data, layout="yolo", out=tmp_path / "boxes")
    export(data, layout="yolo", out=tmp_path / "polygons", settings=["labels=polygons"])
    described = yaml.safe_load((tmp_path / "boxes/data.yaml").read_text())
    assert {key: described[key] for key in ("train", "val", "test")} == {
        "train": "images/test", "val": "images/val", "test": "images/test",
    }  # fmt: skip
    names = described["names"]
    assert len(names) == 80 and (names[0], names[2], names[7], names[79]) == ("person", "car", "truck", "toothbrush")
    ignored = 0
    for sample in open_dataset(data, "val"):
        height, width = sample.images["left"].shape[:2]
        name = f"val/rgb_{sample.record.index:04d}"
        picture = (data / f"images/{name}.png").read_bytes()
        assert (tmp_path / f"boxes/images/{name}.png").read_bytes() == picture
        wanted = [thing for thing in sample.objects if not thing.is_ignored]
        ignored += len(sample.objects) - len(wanted)
        boxes = (tmp_path / f"boxes/labels/{name}.txt").read_text().splitlines()
        polygons = (tmp_path / f"polygons/labels/{name}.txt").read_text().splitlines()
        for thing, box, polygon in zip(wanted, boxes, polygons, strict=True):
            label, x, y, w, h = (float(number) for number in box.split())
            assert names[int(label)] == CATEGORY_NAMES[thing.category_id] == names[int(polygon.split()[0])]
            edges = [(x - w / 2) * width, (y - h / 2) * height, (x + w / 2) * width, (y + h / 2) * height]
            assert edges == pytest.approx(thing.box_px, abs=1e-3)
            corners = np.array(polygon.split()[1:], dtype=float).reshape(-1, 2) * (width, height)
            assert np.array_equal(filled(corners.round(), height, width), decode(thing.rle, height, width))
    assert ignored > 0, "the picture has a crowd, which the format cannot say"


def test_an_annotation_of_no_picture_is_one_line(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "detect2d")
    path = "annotations/instances_val.json"
    content = json.loads((data / path).read_text())
    content["annotations"][0] |= {"image_id": 77, "iscrowd": 0}
    split = split_of(replace(INFO, split="val"), "detect2d")
    with pytest.raises(DatasetError, match=f"{path}: has an annotation of picture 77, which is not in its list"):
        list(yolo_tree([split], lambda _: json.dumps(content).encode(), YoloOptions()))


def test_a_dataset_without_train_names_another_split_there(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "detect2d", ("debug",))
    export(data, layout="yolo", out=tmp_path / "yolo")
    described = yaml.safe_load((tmp_path / "yolo/data.yaml").read_text())
    assert described["train"] == described["val"] == described["debug"] == "images/debug"


def test_ultralytics_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("YOLO_CONFIG_DIR", str(tmp_path))
    reader = pytest.importorskip("ultralytics.data.dataset", reason="Ultralytics is no dependency: its licence is AGPL")
    utilities = pytest.importorskip("ultralytics.data.utils")
    data = dataset(tmp_path / "data", "detect2d", ("train", "val"))
    for labels, task in (("boxes", "detect"), ("polygons", "segment")):
        root = tmp_path / labels
        export(data, layout="yolo", out=root, settings=[f"labels={labels}"])
        described = utilities.check_det_dataset(str(root / "data.yaml"), autodownload=False)
        read = reader.YOLODataset(img_path=described["val"], data=described, task=task, augment=False)
        for label, sample in zip(read.labels, open_dataset(data, "val"), strict=True):
            wanted = [thing for thing in sample.objects if not thing.is_ignored]
            assert [described["names"][int(number)] for number in label["cls"][:, 0]] == [
                CATEGORY_NAMES[thing.category_id] for thing in wanted
            ]
            assert len(label["segments"]) == (len(wanted) if task == "segment" else 0)
            height, width = sample.images["left"].shape[:2]
            middles = label["bboxes"][:, :2] * (width, height)
            boxes = np.array([thing.box_px for thing in wanted])
            assert middles == pytest.approx((boxes[:, :2] + boxes[:, 2:]) / 2, abs=1e-3)
