"""The semantic labels of gear, and their names in Cityscapes, COCO and KITTI.

`docs/reference/mjcf.md` describes this table in words. A kind of vehicle is one entry of the table, a `VehicleKind`;
every property that differs between kinds of vehicles is read from this entry.

The colours of the classes are Cityscapes' own, in `gear/formats/cityscapes.py`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

KittiType = Literal["Car", "Van", "Truck", "Pedestrian", "Cyclist", "Tram", "Misc"]


@dataclass(frozen=True, slots=True)
class Label:
    """One semantic class.

    Attributes:
        code: small number of the label inside gear's label maps; 0 is the sky.
        name: the first word in the name of a geom's default class in MJCF.
        cityscapes_id: Cityscapes label id (0..33).
        coco_id: COCO category id (1..90), or None where COCO has no such category.
        kitti_type: KITTI type of an actor of this class, or None.
        is_instance: whether Cityscapes separates the instances of the class.
    """

    code: int
    name: str
    cityscapes_id: int
    coco_id: int | None = None
    kitti_type: KittiType | None = None
    is_instance: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleKind(Label):
    """The label of a kind of vehicle, with the properties that traffic and light need.

    Attributes:
        weight: how often one asset of the kind is drawn, relative to one car; the asset's own `actor.weight` multiplies
            it.
        mass_kg: mass of its body in the placement model. Only the shape of the inertia matters for how it settles.
        headlamps: number of headlamps, 0 to 2; two stand apart, one stands in the middle.
        is_two_wheeler: whether the vehicle rides at the right edge of its lane and is never parked in a bay.
        max_speed_mps: the highest speed that is drawn for it. A kind slower than traffic on motorways keeps off them.
        cruise_mps: the highest speed at which it drives through a sequence.
        has_lit_interior: whether its windows show a lit interior at night.
    """

    weight: float
    mass_kg: float = 1500.0
    headlamps: int = 2
    is_two_wheeler: bool = False
    max_speed_mps: float = math.inf
    cruise_mps: float = math.inf
    has_lit_interior: bool = False


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
    VehicleKind(25, "car", 26, coco_id=3, kitti_type="Car", is_instance=True, weight=1.0),
    VehicleKind(26, "van", 26, coco_id=3, kitti_type="Van", is_instance=True, weight=0.7),
    VehicleKind(27, "truck", 27, coco_id=8, kitti_type="Truck", is_instance=True, weight=0.4),
    VehicleKind(28, "bus", 28, coco_id=6, kitti_type="Misc", is_instance=True, weight=0.8, has_lit_interior=True),
    VehicleKind(
        29, "motorcycle", 32, coco_id=4, kitti_type="Misc", is_instance=True,
        weight=1.2, mass_kg=300.0, headlamps=1, is_two_wheeler=True,
    ),
    VehicleKind(
        30, "bicycle", 33, coco_id=2, kitti_type="Cyclist", is_instance=True,
        weight=1.5, mass_kg=95.0, headlamps=0, is_two_wheeler=True, max_speed_mps=6.0, cruise_mps=5.5,
    ),
    Label(31, "caravan", 29, kitti_type="Misc", is_instance=True),
    Label(32, "trailer", 30, kitti_type="Misc", is_instance=True),
    Label(33, "traffic_sign_back", 4),
)  # fmt: skip
"""All labels, in the order of their codes."""

VEHICLES: dict[str, VehicleKind] = {label.name: label for label in LABELS if isinstance(label, VehicleKind)}
"""Vehicle labels (`VehicleKind`) by name, in the order of their codes."""

LABEL_BY_NAME: dict[str, Label] = {label.name: label for label in LABELS}
"""Labels by name. In MJCF, the name of a geom's default class starts with this name."""

OPEN_GROUND_CODES = tuple(LABEL_BY_NAME[name].code for name in ("road", "road_marking", "parking", "ground"))
"""Label codes of level ground in the open, which gets wet in rain and on which puddles form."""

GROUND_CODES = (*OPEN_GROUND_CODES, *(LABEL_BY_NAME[name].code for name in ("sidewalk", "terrain")))
"""Label codes of the ground on which road users stand."""
