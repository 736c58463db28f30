import json
from dataclasses import replace

import numpy as np
import pytest
from pycocotools import mask as coco_mask

from gear.formats.coco import (
    CATEGORIES,
    CATEGORY_NAMES,
    Annotation,
    DatasetWriter,
    Detection,
    Picture,
    dataset_json,
    results_json,
)
from gear.formats.jsontext import dump
from gear.values.labels import LABELS

MASK = np.zeros((8, 9), np.uint8)
MASK[2:5, 1:6] = 1
RLE = coco_mask.encode(np.asfortranarray(MASK))["counts"].decode()
RUNS = [10, 3, 5, 3, 5, 3, 5, 3, 5, 3, 27]
"""Lengths of the runs of zeros and ones, column by column."""


def test_all_eighty_categories() -> None:
    assert len(CATEGORIES) == len(CATEGORY_NAMES) == 80
    unused = {12, 26, 29, 30, 45, 66, 68, 69, 71, 83}
    assert set(CATEGORY_NAMES) == set(range(1, 91)) - unused
    assert (CATEGORY_NAMES[1], CATEGORY_NAMES[10], CATEGORY_NAMES[13], CATEGORY_NAMES[90]) == (
        "person", "traffic light", "stop sign", "toothbrush")  # fmt: skip
    supercategories = {category["id"]: category["supercategory"] for category in CATEGORIES}
    assert (supercategories[9], supercategories[10], supercategories[44]) == ("vehicle", "outdoor", "kitchen")


def test_gears_labels_point_at_categories() -> None:
    for label in LABELS:
        if label.coco_id is not None:
            assert label.coco_id in CATEGORY_NAMES


def test_annotations_are_numbered_from_one_through_all_pictures() -> None:
    item = Annotation(category_id=3, box_xywh=(0, 0, 2, 2), area_px=4, rle="", is_crowd=False, extras={})
    pictures = [Picture(id=i, file_name=f"{i}.png", height_px=4, width_px=6, annotations=(item,) * 2) for i in range(3)]
    content = dataset_json(pictures, description="", created="2022-01-01")
    assert [a["id"] for a in content["annotations"]] == [1, 2, 3, 4, 5, 6]
    assert [a["image_id"] for a in content["annotations"]] == [0, 0, 1, 1, 2, 2]
    assert content["info"]["year"] == 2022
    assert [(one["id"], one["height"], one["width"]) for one in content["images"]] == [(0, 4, 6), (1, 4, 6), (2, 4, 6)]
    assert all(one["segmentation"]["size"] == [4, 6] for one in content["annotations"])


def test_crowds_are_marked_and_boxes_are_corner_and_size() -> None:
    item = Annotation(category_id=3, box_xywh=(1, 2, 5, 3), area_px=15, rle=RLE, is_crowd=True, extras={"k": 1})
    shown = Picture(id=7, file_name="a.png", height_px=8, width_px=9, annotations=(item, replace(item, is_crowd=False)))
    crowd, single = dataset_json([shown], description="", created="2022-01-01")["annotations"]
    assert crowd == {
        "id": 1, "image_id": 7, "category_id": 3, "bbox": [1, 2, 5, 3], "area": 15, "iscrowd": 1, "gear": {"k": 1},
        "segmentation": {"size": [8, 9], "counts": RUNS},
    }  # fmt: skip
    assert single["iscrowd"] == 0 and single["segmentation"]["counts"] == RLE
    assert coco_mask.frPyObjects(crowd["segmentation"], 8, 9)["counts"].decode() == RLE  # as DETR's processor does
    (line,) = results_json(7, [Detection(category_id=3, box_px=(1.0, 2.0, 6.0, 5.0), score=0.5)])
    assert line == {"image_id": 7, "category_id": 3, "bbox": [1, 2, 5, 3], "score": 0.5}


def test_single_objects_have_polygons_and_crowds_run_lengths() -> None:
    one = Annotation(category_id=3, box_xywh=(1, 2, 2, 1), area_px=2, rle=RLE, is_crowd=False, extras={},
                     polygons=[[1, 2, 3, 2, 3, 3, 1, 3]])  # fmt: skip
    shown = Picture(id=1, file_name="a.png", height_px=8, width_px=9, annotations=(one, replace(one, is_crowd=True)))
    single, crowd = dataset_json([shown], description="", created="2022-01-01")["annotations"]
    assert single["segmentation"] == [[1, 2, 3, 2, 3, 3, 1, 3]]
    assert crowd["segmentation"] == {"size": [8, 9], "counts": RUNS}


def test_json_text_is_steady() -> None:
    assert dump({"b": 1, "a": [1.5, None]}) == b'{"b":1,"a":[1.5,null]}\n'
    assert json.loads(dump({"a": "ä"})) == {"a": "ä"}
    with pytest.raises(ValueError, match="JSON"):
        dump({"a": float("nan")})


def test_a_file_written_picture_by_picture_has_the_same_bytes() -> None:
    thing = Annotation(
        category_id=1, box_xywh=(1.0, 2.0, 3.5, 4.0), area_px=9, rle="0n4", is_crowd=True, extras={"ü": 1}
    )
    shown = [
        Picture(id=1, file_name="a.png", height_px=4, width_px=6, annotations=(thing, thing)),
        Picture(id=2, file_name="b.png", height_px=4, width_px=6, annotations=()),
        Picture(id=3, file_name="c.png", height_px=4, width_px=6, annotations=(thing,)),
    ]
    for pictures in (shown, shown[1:2], []):
        writer = DatasetWriter(description="é", created="2022-01-01")
        for picture in pictures:
            writer.add(picture)
        assert writer.data() == dump(dataset_json(pictures, description="é", created="2022-01-01"))
