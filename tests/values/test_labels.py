"""Gear's labels against the names of the formats that they are written in."""

from __future__ import annotations

from gear.formats.cityscapes import LABELS as CITYSCAPES
from gear.formats.coco import CATEGORY_NAMES
from gear.values.labels import GROUND_CODES, LABELS, OPEN_GROUND_CODES

TO_CITYSCAPES = {
    "road_marking": "road",
    "stop_sign": "traffic sign",
    "traffic_sign_back": "static",
    "billboard": "static",
    "bench": "static",
    "fire_hydrant": "static",
    "parking_meter": "static",
    "van": "car",
}
"""What Cityscapes has no name for, and what its annotators take it for."""

TO_COCO = {"rider": "person", "van": "car"}
TO_KITTI = {
    "person": "Pedestrian",
    "rider": "Cyclist",
    "bicycle": "Cyclist",
    "car": "Car",
    "van": "Van",
    "truck": "Truck",
    "bus": "Misc",
    "motorcycle": "Misc",
    "caravan": "Misc",
    "trailer": "Misc",
}


def test_a_labels_code_is_its_place() -> None:
    """Label maps of the renderer index the table."""
    assert [label.code for label in LABELS] == list(range(len(LABELS)))


def test_cityscapes_ids_have_the_labels_names() -> None:
    for label in LABELS:
        assert CITYSCAPES[label.cityscapes_id].name == TO_CITYSCAPES.get(label.name, label.name.replace("_", " "))


def test_coco_categories_have_the_labels_names() -> None:
    by_name = {name: number for number, name in CATEGORY_NAMES.items()}
    for label in LABELS:
        assert label.coco_id == by_name.get(TO_COCO.get(label.name, label.name.replace("_", " "))), label.name


def test_kitti_types_are_those_of_road_users() -> None:
    assert {label.name: label.kitti_type for label in LABELS if label.kitti_type} == TO_KITTI


def test_what_road_users_stand_on_is_ground() -> None:
    assert [LABELS[code].name for code in OPEN_GROUND_CODES] == ["road", "road_marking", "parking", "ground"]
    assert set(GROUND_CODES) - set(OPEN_GROUND_CODES) == {
        label.code for label in LABELS if label.name in ("sidewalk", "terrain")
    }
