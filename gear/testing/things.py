"""Objects of synthetic frames, made of boxes, and a street with several of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gear.values.geometry import RigidTransform
from gear.values.rng import derive_rng
from gear.values.scene import Role, Vec3


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One box of a synthetic object, in the object's frame.

    Attributes:
        label: name of a gear label.
        centre_m, size_m: centre (x, y, z), and length (x), width (y), height (z).
        surface: number of the patch surface on this box, or -1.
    """

    label: str
    centre_m: Vec3
    size_m: Vec3
    surface: int = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A synthetic object: boxes that move together.

    Attributes:
        parts: its boxes; the first one has the object's main label.
        position_m, yaw_rad: pose of the object's frame in the world.
        object_id: id of the instance, as in `GeomTable.object_id`; -1 for objects that are no instances.
        role: role of the actor; None for a fixed part of the town.
        key_points: named points in the object's frame, metres.
    """

    parts: tuple[Part, ...]
    position_m: Vec3
    yaw_rad: float = 0.0
    object_id: int = -1
    role: Role | None = None
    key_points: Mapping[str, Vec3] = field(default_factory=dict)

    @property
    def world_from_thing(self) -> RigidTransform:
        """The pose of the object in the world."""
        return RigidTransform.from_yaw("world", "object", self.position_m, self.yaw_rad)


def box_part(label: str, length_m: float, width_m: float, height_m: float) -> Part:
    """A box whose bottom face is centred at the origin of the object's frame.

    Args:
        label: class name of the part.
        length_m, width_m, height_m: size along x, y and z.
    """
    return Part(label=label, centre_m=(0.0, 0.0, height_m / 2), size_m=(length_m, width_m, height_m))


CAR = (box_part("car", 4.2, 1.8, 1.5),)
VAN = (box_part("van", 5.0, 2.0, 2.2),)
TRUCK = (box_part("truck", 8.0, 2.5, 3.5),)
PERSON = (box_part("person", 0.5, 0.6, 1.75),)
CYCLIST = (
    box_part("bicycle", 1.8, 0.4, 1.0),
    Part(label="rider", centre_m=(0.0, 0.0, 1.4), size_m=(0.5, 0.5, 0.8)),
)
TRAFFIC_LIGHT = (Part(label="traffic_light", centre_m=(0.0, 0.0, 4.0), size_m=(0.4, 0.4, 1.2)),)

SLOTS = (
    (CAR, 9.5, -2.6),
    (CYCLIST, 9.0, 1.0),
    (PERSON, 11.0, -5.2),
    (CAR, 15.0, 3.4),
    (PERSON, 16.0, 5.8),
    (VAN, 20.0, 3.2),
    (TRUCK, 24.0, -2.8),
    (CAR, 30.0, 0.4),
    (CAR, 37.0, -1.0),
    (PERSON, 42.0, 7.5),
)
"""Objects of `street`: kind, distance ahead and to the left in metres; far enough apart never to overlap."""


def board(distance_m: float, left_m: float = 0.0, *, surface: int = 0, bottom_m: float = 0.15) -> Thing:
    """A billboard in front of an ego car at the origin, facing the car: a 7.4 m x 3.7 m surface on a thicker board.

    Args:
        distance_m: distance ahead of the origin.
        left_m: distance to the left.
        surface: number of the patch surface.
        bottom_m: height of the surface's lower edge.
    """
    middle = bottom_m + 1.85
    face = Part(label="billboard", centre_m=(0.005, 0.0, middle), size_m=(0.01, 7.4, 3.7), surface=surface)
    back = Part(label="billboard", centre_m=(0.16, 0.0, middle), size_m=(0.3, 7.8, 4.1))
    return Thing(parts=(back, face), position_m=(distance_m, left_m, 0.0))


def street(seed: int = 0, index: int = 0) -> tuple[Thing, ...]:
    """A street ahead of the origin: billboard, building, cars, van, truck, people, cyclist, traffic light.

    Args:
        seed, index: seed of the street and number of the sample, from which the positions of vehicles and people are
            drawn.
    """
    rng = derive_rng(seed, "synthetic", index)
    things = [
        board(24.0, 6.0),
        Thing(parts=(box_part("building", 2.0, 60.0, 14.0),), position_m=(60.0, 0.0, 0.0)),
        Thing(parts=(box_part("pole", 0.12, 0.12, 5.0),), position_m=(12.0, -5.5, 0.0)),
        Thing(parts=(box_part("vegetation", 3.0, 3.0, 5.0),), position_m=(30.0, -12.0, 0.0)),
        Thing(parts=TRAFFIC_LIGHT, position_m=(18.0, -6.0, 0.0), object_id=1000),
    ]
    for number, (parts, ahead_m, left_m) in enumerate(SLOTS):
        position = (ahead_m + rng.uniform(-0.4, 0.4), left_m + rng.uniform(-0.4, 0.4), 0.0)
        role: Role = "pedestrian" if parts is PERSON else "npc"
        yaw = float(rng.normal(0.0, 0.15)) + math.pi * int(rng.integers(2))
        things.append(Thing(parts=parts, position_m=position, yaw_rad=yaw, object_id=number + 2, role=role))
    return tuple(things)
