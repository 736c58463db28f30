"""What a thing is.

Gear's labels and their names in Cityscapes, COCO and KITTI. `docs/reference/mjcf.md` is this table in words.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

KittiType = Literal["Car", "Van", "Truck", "Pedestrian", "Cyclist", "Misc"]


@dataclass(frozen=True, slots=True)
class Label:
    """One kind of thing.

    Attributes:
        code: small number of the label inside gear's label maps; 0 is the sky.
        name: what a default class in the MJCF starts with.
        cityscapes_id: Cityscapes label id (0..33).
        coco_id: COCO category id (1..90), or None where COCO has no such category.
        kitti_type: type of an actor made of it, or None.
        is_instance: whether Cityscapes tells single instances apart.
    """

    code: int
    name: str
    cityscapes_id: int
    coco_id: int | None = None
    kitti_type: KittiType | None = None
    is_instance: bool = False


LABELS: tuple[Label, ...] = (
    Label(0, "sky", 23),
    Label(1, "road", 7),
    Label(2, "road_marking", 7),
    Label(3, "sidewalk", 8),
    Label(4, "parking", 9),
    Label(5, "ground", 6),
    Label(6, "terrain", 22),
    Label(7, "building", 11),
    Label(8, "wall", 12),
    Label(9, "fence", 13),
    Label(10, "guard_rail", 14),
    Label(11, "bridge", 15),
    Label(12, "pole", 17),
    Label(13, "traffic_light", 19, coco_id=10),
    Label(14, "traffic_sign", 20),
    Label(15, "stop_sign", 20, coco_id=13),
    Label(16, "vegetation", 21),
    Label(17, "static", 4),
    Label(18, "billboard", 4),
    Label(19, "bench", 4, coco_id=15),
    Label(20, "fire_hydrant", 4, coco_id=11),
    Label(21, "parking_meter", 4, coco_id=14),
    Label(22, "dynamic", 5),
    Label(23, "person", 24, coco_id=1, kitti_type="Pedestrian", is_instance=True),
    Label(24, "rider", 25, coco_id=1, kitti_type="Cyclist", is_instance=True),
    Label(25, "car", 26, coco_id=3, kitti_type="Car", is_instance=True),
    Label(26, "van", 26, coco_id=3, kitti_type="Van", is_instance=True),
    Label(27, "truck", 27, coco_id=8, kitti_type="Truck", is_instance=True),
    Label(28, "bus", 28, coco_id=6, kitti_type="Misc", is_instance=True),
    Label(29, "motorcycle", 32, coco_id=4, kitti_type="Misc", is_instance=True),
    Label(30, "bicycle", 33, coco_id=2, kitti_type="Cyclist", is_instance=True),
    Label(31, "caravan", 29, kitti_type="Misc", is_instance=True),
    Label(32, "trailer", 30, kitti_type="Misc", is_instance=True),
    Label(33, "traffic_sign_back", 4),
)
"""All labels, in the order of their codes."""

LABEL_BY_NAME: dict[str, Label] = {label.name: label for label in LABELS}
"""Labels by the name that MJCF default classes start with."""

OPEN_GROUND_CODES = tuple(LABEL_BY_NAME[name].code for name in ("road", "road_marking", "parking", "ground"))
"""Level ground under the sky: it gets wet, and water stands on it."""

GROUND_CODES = (*OPEN_GROUND_CODES, *(LABEL_BY_NAME[name].code for name in ("sidewalk", "terrain")))
"""What road users stand on."""
