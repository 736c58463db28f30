from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes, tiny_world
from gear.values.geometry import RigidTransform
from gear.world.placement import PlacementSpace
from gear.world.traffic.footprints import Footprint
from gear.world.world import World

WORLD = tiny_world("no_billboard")
SPACE = PlacementSpace(WORLD.placement_model, {slot.body: WORLD.types[slot.actor.name] for slot in WORLD.slots})
CAR = WORLD.types["car_saloon"]


def flat(x_m: float, y_m: float, z_m: float = 0.0, yaw_rad: float = 0.0) -> RigidTransform:
    return RigidTransform.from_yaw("world", "actor", (x_m, y_m, z_m), yaw_rad)


def test_the_ground_is_where_the_town_says() -> None:
    assert SPACE.ground_m(0, 0, 0) == pytest.approx(0)
    assert SPACE.ground_m(0, -5, 0.15) == pytest.approx(0.15)
    assert SPACE.ground_m(30, 40, 2) == pytest.approx(2, abs=2e-3)
    assert SPACE.ground_m(50, 50, 0) == pytest.approx(-0.05)
    assert SPACE.ground_m(500, 0, 0) is None
    assert SPACE.ground_m(0, 0, 20) is None, "ground far below is another level"


def test_overlaps_are_detected_and_near_misses_are_not() -> None:
    assert SPACE.overlaps({"car_saloon_0": flat(0, 0), "van_small_0": flat(4.6, 0)}) == [
        ("van_small_0", "car_saloon_0")
    ]
    assert SPACE.overlaps({"car_saloon_0": flat(0, 0), "van_small_0": flat(4.8, 0)}) == []
    assert SPACE.overlaps({"car_saloon_0": flat(-20, 10.5)}) == [("car_saloon_0", "")], "a house"
    assert SPACE.overlaps({"car_saloon_0": flat(-30, -6.9)}) == [("car_saloon_0", "")], "a lamp post"
    assert SPACE.overlaps({"car_saloon_0": flat(0, -5, 0.15)}) == [], "standing on a kerb is no overlap"


@pytest.mark.parametrize(
    "option",
    ['<option><flag contact="disable"/></option>', '<option gravity="0 0 0"><flag constraint="disable"/></option>'],
)
def test_options_of_a_town_do_not_change_collisions(tmp_path: Path, option: str) -> None:
    """A town that stands still for its viewer has contacts and gravity turned off."""
    town = tmp_path / "towns" / "tiny.xml"
    town.parent.mkdir()
    compiler = '<compiler angle="degree"/>'
    text = TINY_TOWN.read_text()
    assert compiler in text
    town.write_text(text.replace(compiler, compiler + option))
    for actor_type in ("vehicles", "pedestrians", "surfaces"):
        (tmp_path / actor_type).symlink_to(TINY_TOWN.parents[1] / actor_type)
    world = World.build(town=town, scene_name="no_billboard", scene=tiny_scenes().scenes["no_billboard"], weather=CLEAR)
    space = PlacementSpace(world.placement_model, {slot.body: world.types[slot.actor.name] for slot in world.slots})
    apart, within = flat(0, 0), flat(1, 0)
    assert space.overlaps({"car_saloon_0": apart, "van_small_0": within}) == [("van_small_0", "car_saloon_0")]
    standing = space.ground_pose(CAR, 0, -3.0, 0, 0.3)
    assert standing is not None
    settled, expected = (
        one.settle({"car_saloon_0": standing.world_from_actor})["car_saloon_0"] for one in (space, SPACE)
    )
    np.testing.assert_array_equal(settled.matrix, expected.matrix)


def test_a_car_on_the_hill_is_even() -> None:
    standing = SPACE.ground_pose(CAR, 30, 40, 2, np.pi / 2)
    assert standing is not None
    assert standing.is_even
    assert standing.world_from_actor.rotation[2, 0] == pytest.approx(0.0995, abs=1e-3)


def test_a_car_half_on_the_kerb_comes_to_rest_on_its_wheels() -> None:
    standing = SPACE.ground_pose(CAR, 0, -3.0, 0, 0.3)
    assert standing is not None
    assert not standing.is_even
    settled = SPACE.settle({"car_saloon_0": standing.world_from_actor})["car_saloon_0"]
    assert np.linalg.norm(settled.translation_m[:2] - (0, -3.0)) < 0.1
    assert settled.rotation[2, 2] > 0.98
    placement_body = CAR.placement_body
    heights_m = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot = settled.apply([sx * placement_body.half_length_m, sy * placement_body.half_width_m, 0.0])
            ground_m = SPACE.ground_m(foot[0], foot[1], 0)
            assert ground_m is not None
            heights_m.append(foot[2] - ground_m)
    assert min(heights_m) > -0.02, "no wheel sinks in"
    assert sorted(heights_m)[2] < 0.03, "three wheels stand"
    again = SPACE.settle({"car_saloon_0": standing.world_from_actor})["car_saloon_0"]
    assert np.array_equal(again.matrix, settled.matrix), "from a reset state, always the same"


def test_lines_of_sight() -> None:
    eye = np.array([-40.0, 18.0, 2.0])
    seen = SPACE.visible(eye, np.array([[-40.0, 40.0, 2.0], [10.0, 18.0, 2.0], [-39.0, 18.0, 2.0]]))
    assert list(seen) == [True, False, True], "a house stands between"
    poses = {"van_small_0": flat(-45, 18)}
    occluders = SPACE.occluders(eye, np.array([[-60.0, 18.0, 1.0], [-60.0, 40.0, 1.0]]), poses)
    assert occluders == ["van_small_0", None]


@pytest.mark.parametrize(
    ("other", "overlaps"),
    [
        (Footprint(4.1, 0, 0, 0, 2, 1), False),
        (Footprint(3.9, 0, 0, 0, 2, 1), True),
        (Footprint(0, 2.9, 0, np.pi / 2, 2, 1), True),
        (Footprint(0, 3.1, 0, np.pi / 2, 2, 1), False),
        (Footprint(3.2, 2.2, 0, np.pi / 4, 1, 1), False),
        (Footprint(2.6, 1.6, 0, np.pi / 4, 1, 1), True),
        (Footprint(0, 0, 5, 0, 2, 1), False),
    ],
)
def test_rectangles(other: Footprint, overlaps: bool) -> None:
    here = Footprint(0, 0, 0, 0, 2, 1)
    assert here.overlaps(other) is overlaps
    assert other.overlaps(here) is overlaps
