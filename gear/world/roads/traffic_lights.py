"""The traffic lights of a town: where they stand, what they show, and at the end of which lanes drivers must stop.

Lights of a town do not change. The body of a light faces the drivers with its -y axis; a geom or a mesh of the body has
its colour as a word in its name, such as `light_red_0_lenses`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from gear.values.geometry import Array
from gear.values.labels import LABELS
from gear.world.assets.actor_types import StaticObjects
from gear.world.roads.lanes import Lane, LaneGraph

COLOURS = ("red", "amber", "green")
TURNED_RAD = math.radians(30.0)
"""Largest angle between a lane and the direction of the drivers for whom a light stands."""

BEFORE_M, BEYOND_M, ASIDE_M = 5.0, 25.0, 10.0
"""A light belongs to a lane if it stands at most this far before the lane's end, beyond it, and beside it, metres."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrafficLight:
    """One head of a traffic light.

    Attributes:
        position_m: (3,) its foot in world coordinates.
        heading_rad: direction of the drivers for whom it stands, counter-clockwise from east.
        colour: `red`, `amber` or `green`.
    """

    position_m: Array
    heading_rad: float
    colour: str


def traffic_lights(model: mujoco.MjModel, statics: StaticObjects) -> tuple[TrafficLight, ...]:
    """Reads the traffic lights of a town; lights whose names have no colour are left out.

    Args:
        model: the render model.
        statics: the countable objects of the town.
    """
    found = []
    for thing in statics.objects.values():
        if LABELS[thing.label_code].name != "traffic_light":
            continue
        colour = _colour(model, [int(geom) for geom in np.flatnonzero(statics.object_id == thing.id)])
        if colour:
            ahead = thing.world_from_object.rotation[:, 1]
            heading_rad = math.atan2(ahead[1], ahead[0])
            found.append(
                TrafficLight(position_m=thing.world_from_object.translation_m, heading_rad=heading_rad, colour=colour)
            )
    return tuple(found)


def red_lanes(lanes: LaneGraph, lights: Sequence[TrafficLight]) -> frozenset[str]:
    """Names of the lanes that lead into a junction and at whose end all lights are red; the end is the stop line.

    Args:
        lanes: the lanes of the town.
        lights: its traffic lights.
    """
    found = set()
    for lane in lanes.lanes.values():
        if lane.is_junction or not any(lanes.lanes[name].is_junction for name in lane.next):
            continue
        colours = {light.colour for light in lights if _belongs(light, lane)}
        if colours == {"red"}:
            found.add(lane.name)
    return frozenset(found)


def _belongs(light: TrafficLight, lane: Lane) -> bool:
    end_m, yaw_rad = lane.line.at(lane.line.length_m)
    if abs(math.remainder(light.heading_rad - yaw_rad, 2 * math.pi)) > TURNED_RAD:
        return False
    x_m, y_m, z_m = light.position_m - end_m
    beyond_m = x_m * math.cos(yaw_rad) + y_m * math.sin(yaw_rad)
    left_m = y_m * math.cos(yaw_rad) - x_m * math.sin(yaw_rad)
    return bool(-BEFORE_M <= beyond_m <= BEYOND_M and abs(left_m) <= ASIDE_M and abs(z_m) <= ASIDE_M)


def _colour(model: mujoco.MjModel, geoms: Sequence[int]) -> str:
    """The colour that the names of geoms or of their meshes contain; "" for none."""
    words: set[str] = set()
    for geom in geoms:
        names = [model.geom(geom).name]
        if model.geom_dataid[geom] >= 0 and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            names.append(model.mesh(int(model.geom_dataid[geom])).name)
        words.update(word for name in names for word in re.split(r"[^a-z]+", name.lower()))
    return next((colour for colour in COLOURS if colour in words), "")
