"""The lights of a town: which lanes end at a red one."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import tiny_world
from gear.values.geometry import RigidTransform
from gear.values.labels import LABEL_BY_NAME
from gear.world.roads.traffic_lights import TrafficLight, red_lanes, traffic_lights

LANES = tiny_world().lanes


def light(x_m: float = 26.0, y_m: float = -5.0, heading_deg: float = 0.0, colour: str = "red") -> TrafficLight:
    return TrafficLight(position_m=np.array([x_m, y_m, 0.15]), heading_rad=math.radians(heading_deg), colour=colour)


@pytest.mark.parametrize(
    ("lights", "expected"),
    [
        ([light()], {"lane.main_east_a"}),
        ([light(), light(colour="green")], set()),
        ([light(colour="green")], set()),
        ([light(), light(x_m=35.0, y_m=3.0)], {"lane.main_east_a"}),
        ([light(heading_deg=45.0)], set()),
        ([light(heading_deg=20.0)], {"lane.main_east_a"}),
        ([light(x_m=10.0)], set()),
        ([light(y_m=-15.0)], set()),
        ([light(x_m=34.0, y_m=4.0, heading_deg=180.0)], {"lane.main_west_a"}),
        ([], set()),
    ],
)
def test_a_lane_ends_at_the_red_lights_of_its_direction(lights: list[TrafficLight], expected: set[str]) -> None:
    assert red_lanes(LANES, lights) == expected


def statics(*labels: str) -> Any:
    """Objects with a label and one geom each, turned by 90 degrees to the right: they stand for drivers to the east."""
    pose = RigidTransform.from_yaw("world", "object", (1.0, 2.0, 0.0), -math.pi / 2)
    objects = {
        number: SimpleNamespace(id=number, label_code=LABEL_BY_NAME[label].code, world_from_object=pose)
        for number, label in enumerate(labels)
    }
    return SimpleNamespace(objects=objects, object_id=np.arange(len(labels)))


def test_the_colour_is_a_word_in_the_name_of_a_geom_or_a_mesh() -> None:
    geoms = "".join(f'<geom name="{name}" size="1"/>' for name in ("head_Red", "reduced_1", "light.green", "red_bench"))
    mesh = '<mesh name="mast_amber_0" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset>{mesh}</asset><worldbody>{geoms}<geom type="mesh" mesh="mast_amber_0"/></worldbody></mujoco>'
    )
    kinds = ("traffic_light", "traffic_light", "traffic_light", "bench", "traffic_light")
    found = traffic_lights(model, statics(*kinds))
    assert [one.colour for one in found] == ["red", "green", "amber"], "`reduced` is no colour, and a bench no light"
    assert all(one.heading_rad == pytest.approx(0.0) for one in found)


def test_a_town_without_colours_has_no_red_lane() -> None:
    world = tiny_world()
    assert traffic_lights(world.model, world.statics) == ()
