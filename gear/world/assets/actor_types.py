"""Measures compiled assets: shapes and sizes of actors, and the countable objects of a town."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.errors import TownError
from gear.values.frames import STATIC_OBJECT_BASE, SceneObject, Shape
from gear.values.geometry import RigidTransform
from gear.values.labels import LABELS, Label, VehicleKind
from gear.world.assets.geom_classes import HIDDEN_CODE, GeomClasses
from gear.world.assets.geom_triangles import body_shape
from gear.world.assets.library import ActorFacts
from gear.world.compilation.actor_pool import Slot
from gear.world.compilation.model_compilation import PlacementBody

PERSON_MASS_KG = 75.0
"""Mass of every person in the placement model, kg."""

ACTOR_SIDE_M = (0.1, 100.0)
"""Smallest and largest length in metres of an actor's longest side. The file of an actor outside this range probably
uses another unit.
"""

COUNTABLE = frozenset(label.code for label in LABELS if label.coco_id is not None and not label.is_instance)
"""Codes of the labels whose objects in a town are counted one by one, such as traffic lights. Each such object needs a
body of its own in the MJCF.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ActorType:
    """One vehicle or person asset with its measured shape; several actors may be instances of the asset.

    Attributes:
        facts: metadata in its MJCF file, such as kind and weight.
        shape: its visible triangles in the actor frame (x to the front, y to the left, z up, origin on the ground).
        half_length_m, half_width_m: half the sides of its footprint, the smallest rectangle centred on the origin that
            contains it.
    """

    facts: ActorFacts
    shape: Shape
    half_length_m: float
    half_width_m: float

    @property
    def vehicle(self) -> VehicleKind | None:
        """The kind of the vehicle; None for people."""
        return self.facts.vehicle

    @property
    def is_person(self) -> bool:
        """Whether the asset is a person on foot."""
        return self.facts.vehicle is None

    @property
    def label(self) -> Label:
        """The semantic label of the asset."""
        return self.facts.label

    @property
    def front_m(self) -> float:
        """Distance from the asset's origin to its front, metres."""
        return float(self.shape.box_centre_m[0] + self.shape.box_size_m[0] / 2)

    @property
    def rear_m(self) -> float:
        """Distance from the asset's origin to its rear, metres."""
        return float(self.shape.box_size_m[0] / 2 - self.shape.box_centre_m[0])

    @property
    def placement_body(self) -> PlacementBody:
        """The simplified body of the asset in the placement model, a box on four feet.

        The feet are near the wheels: inside the footprint by a fifth of its half sides.
        """
        return PlacementBody(
            half_length_m=0.8 * self.half_length_m,
            half_width_m=0.8 * self.half_width_m,
            height_m=float(self.shape.box_centre_m[2] + self.shape.box_size_m[2] / 2),
            mass_kg=PERSON_MASS_KG if self.vehicle is None else self.vehicle.mass_kg,
        )


def body_tree(model: mujoco.MjModel, body_id: int) -> list[int]:
    """The ids of a body and of all its descendants. The ids are consecutive, because MuJoCo numbers bodies depth
    first.

    Args:
        model: the compiled model.
        body_id: id of the body.

    Returns:
        The ids in increasing order, `body_id` first.
    """
    outside = np.flatnonzero(model.body_parentid[body_id + 1 :] < body_id)
    return list(range(body_id, body_id + 1 + int(outside[0]) if len(outside) else model.nbody))


def visible_geoms(model: mujoco.MjModel, body_id: int, label_code: npt.NDArray[np.uint8]) -> list[int]:
    """The ids of the visible geoms of a body and of its descendants.

    Args:
        model: the compiled model.
        body_id: id of the body.
        label_code: (ngeom,) uint8 label code of each geom; geoms with `HIDDEN_CODE` are left out.
    """
    owners = np.isin(model.geom_bodyid, body_tree(model, body_id))
    return [int(geom) for geom in np.flatnonzero(owners & (label_code != HIDDEN_CODE))]


def actor_types(
    model: mujoco.MjModel, data: mujoco.MjData, classes: GeomClasses, slots: Sequence[Slot]
) -> dict[str, ActorType]:
    """Measures every asset in the pool of actors, on the first instance of the asset.

    Args:
        model: the render model.
        data: MuJoCo data of the model with kinematics up to date.
        classes: labels of the geoms.
        slots: the pool of actors.

    Returns:
        The measured assets by name.

    Raises:
        TownError: an asset has no visible geom or an infinite geom, is too small or too large for a road user, or does
            not stand on the ground at its origin.
    """
    types: dict[str, ActorType] = {}
    for slot in slots:
        facts = slot.actor
        if facts.name in types:
            continue
        body_id = model.body(slot.body).id
        geoms = visible_geoms(model, body_id, classes.label_code)
        if not geoms:
            raise TownError(facts.path, "has no visible geom")
        shape = _shape(model, data, body_id, geoms, classes, facts.path)
        longest_m = float(shape.box_size_m.max())
        if not ACTOR_SIDE_M[0] <= longest_m <= ACTOR_SIDE_M[1]:
            raise TownError(facts.path, f"its longest side is {longest_m:.3g} m; MJCF is in metres, and so is gear")
        extent_m = np.abs(shape.box_centre_m) + shape.box_size_m / 2
        bottom_m = float(shape.box_centre_m[2] - shape.box_size_m[2] / 2)
        if abs(bottom_m) > 0.1:
            raise TownError(facts.path, f"its lowest point must be at z = 0, the ground, but is at {bottom_m:.2f} m")
        types[facts.name] = ActorType(
            facts=facts, shape=shape, half_length_m=float(extent_m[0]), half_width_m=float(extent_m[1])
        )
    return types


def _shape(
    model: mujoco.MjModel, data: mujoco.MjData, body_id: int, geoms: Sequence[int], classes: GeomClasses, path: Path
) -> Shape:
    try:
        return body_shape(model, data, body_id, geoms, classes.label_code)
    except ValueError as error:
        raise TownError(path, f"{error}; make it of meshes, boxes, cylinders, capsules or ellipsoids") from error


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StaticObjects:
    """The countable objects of a town, such as traffic lights.

    Attributes:
        objects: the objects by object id.
        object_id: (ngeom,) int32: id of the object to which each geom belongs; -1 for no object.
    """

    objects: Mapping[int, SceneObject]
    object_id: npt.NDArray[np.int32]


def static_objects(
    model: mujoco.MjModel, data: mujoco.MjData, classes: GeomClasses, slots: Sequence[Slot], path: Path
) -> StaticObjects:
    """Finds the countable objects of a town: one object for each body with geoms of a label in `COUNTABLE`.

    Args:
        model: the render model.
        data: MuJoCo data of the model with kinematics up to date.
        classes: labels of the geoms.
        slots: the pool of actors; their bodies are not objects of the town.
        path: the town's file, for error messages.

    Returns:
        The objects, and the object id of each geom.

    Raises:
        TownError: a geom with such a label has no body of its own, or is infinite.
    """
    actor_bodies = {body for slot in slots for body in body_tree(model, model.body(slot.body).id)}
    object_id = np.full(model.ngeom, -1, np.int32)
    by_body: dict[tuple[int, int], list[int]] = {}
    for geom_id in np.flatnonzero(np.isin(classes.label_code, list(COUNTABLE))):
        body_id = int(model.geom_bodyid[geom_id])
        if body_id in actor_bodies:
            continue
        if body_id == 0:
            label = LABELS[classes.label_code[geom_id]].name
            raise TownError(path, f"geom {model.geom(geom_id).name!r} is a {label} and needs a body of its own")
        by_body.setdefault((body_id, int(classes.label_code[geom_id])), []).append(int(geom_id))
    objects: dict[int, SceneObject] = {}
    for number, ((body_id, label_code), geoms) in enumerate(sorted(by_body.items())):
        name = model.body(body_id).name
        thing = SceneObject(
            id=STATIC_OBJECT_BASE + number,
            asset=name,
            label_code=label_code,
            kitti_type=None,
            is_ego=False,
            world_from_object=RigidTransform.from_parts(
                "world", "object", data.xmat[body_id].reshape(3, 3), data.xpos[body_id]
            ),
            shape=_shape(model, data, body_id, geoms, classes, path),
        )
        objects[thing.id] = thing
        object_id[geoms] = thing.id
    object_id.setflags(write=False)
    return StaticObjects(objects=objects, object_id=object_id)
