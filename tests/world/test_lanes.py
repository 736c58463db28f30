from __future__ import annotations

import itertools
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.testing.tiny_town import TINY_TOWN
from gear.values.errors import TownError
from gear.world.junctions import Junctions
from gear.world.lanes import LaneGraph
from gear.world.polyline import Polyline
from gear.world.routes import Route, back_up, drive_on, vehicle_pose

GRAPH = LaneGraph.from_model(mujoco.MjModel.from_xml_path(str(TINY_TOWN)), TINY_TOWN)


def graph_of(custom: str) -> LaneGraph:
    xml = f'<mujoco><custom><numeric name="town.bounds" data="0 0 9 9"/>{custom}</custom></mujoco>'
    return LaneGraph.from_model(mujoco.MjModel.from_xml_string(xml), Path("town.xml"))


GOOD = '<numeric name="lane.a" data="3 10  0 0 0  9 0 0"/>'
GAP = '<numeric name="lane.b" data="3 10  9 5 0  9 9 0"/><text name="lane.a" data="next=lane.b"/>'


def test_the_tiny_town_reads() -> None:
    lane = GRAPH.lanes["lane.main_east_a"]
    assert (lane.width_m, lane.speed_mps, lane.is_junction) == (3.5, 11.0, False)
    assert lane.next == ("lane.x_east", "lane.x_east_to_south")
    assert lane.line.length_m == pytest.approx(104.5)
    assert GRAPH.lanes["lane.x_east"].is_junction
    assert GRAPH.previous["lane.cross_south_s"] == ("lane.x_east_to_south", "lane.x_south")
    assert {walk.name for walk in GRAPH.walks.values() if walk.is_crossing} == {"crosswalk.main"}
    assert [bay.position_m[0] for bay in GRAPH.bays] == [-17, -11, -5]
    assert GRAPH.bounds_m == (-80, -60, 80, 60)


@pytest.mark.parametrize(
    ("custom", "told"),
    [
        ("", "has no lanes"),
        ('<numeric name="lane.a" data="3 10  0 0 0"/>', "lane.a needs at least two points"),
        ('<numeric name="lane.a" data="3 10  0 0 0  9 0"/>', "lane.a needs at least two points of three numbers"),
        ('<numeric name="lane.a" data="3 0  0 0 0  9 0 0"/>', "lane.a must have a width and a speed above 0"),
        ('<numeric name="lane.a" data="3 10  0 0 0  0 0 1"/>', "lane.a has two points in one place"),
        ('<numeric name="lane.a" data="3 10  0 nan 0  9 0 0"/>', "lane.a holds something that is no number"),
        (GOOD + '<numeric name="sidewalk.a" data="3  0 0 0  inf 0 0"/>', "sidewalk.a holds something that is no"),
        (GOOD + '<text name="lane.a" data="next=lane.b"/>', "lane.a: next names lane.b, which is not there"),
        (GOOD + '<text name="lane.a" data="next lane.b"/>', "lane.a: cannot read 'next'"),
        (GOOD + '<text name="lane.a" data="kind=bend"/>', "lane.a: kind must be junction"),
        (
            GOOD + '<numeric name="lane.b" data="3 10  9 5 0  9 9 0"/><text name="lane.a" data="next=lane.b"/>',
            "5.0 m from",
        ),
        (GOOD + '<numeric name="parking.p" data="5 2  1 1 0"/>', "parking.p must be length and width"),
    ],
)
def test_errors_name_the_lane(custom: str, told: str) -> None:
    with pytest.raises(TownError, match=told):
        graph_of(custom)


def test_bounds_are_needed() -> None:
    with pytest.raises(TownError, match=r"town\.bounds"):
        LaneGraph.from_model(
            mujoco.MjModel.from_xml_string(f"<mujoco><custom>{GOOD}</custom></mujoco>"), Path("town.xml")
        )


NAMES = sorted(GRAPH.lanes)


@given(st.sampled_from(NAMES), st.floats(0, 1), st.floats(-1.5, 1.5))
def test_projection_inverts_sampling(name: str, share: float, lateral_m: float) -> None:
    line = GRAPH.lanes["lane.main_west_a" if name.startswith("lane.x_") else name].line
    s_m = share * line.length_m
    found_s_m, found_lateral_m, _ = line.project(line.at(s_m, lateral_m)[0])
    assert found_s_m == pytest.approx(s_m, abs=0.16)
    assert found_lateral_m == pytest.approx(lateral_m, abs=0.02)


def test_the_left_is_the_left() -> None:
    line = Polyline.through(np.array([[0.0, 0, 0], [10, 0, 1]]))
    point, heading_rad = line.at(5.0, 2.0)
    assert point == pytest.approx([5, 2, 0.5])
    assert heading_rad == 0
    north = Polyline.through(np.array([[0.0, 0, 0], [0, 10, 0]]))
    assert north.at(5.0, 2.0)[0] == pytest.approx([-2, 5, 0])
    assert north.at(5.0)[1] == pytest.approx(math.pi / 2)


@given(st.floats(-5, 60), st.floats(-1, 1))
def test_many_points_are_each_point(s_m: float, lateral_m: float) -> None:
    line = GRAPH.lanes["lane.cross_north_n"].line
    points, headings = line.sample(np.array([s_m, s_m + 1]), lateral_m)
    for k in range(2):
        point, heading_rad = line.at(s_m + k, lateral_m)
        assert points[k] == pytest.approx(point)
        assert headings[k] == pytest.approx(heading_rad)


def test_the_nearest_lane_is_found_on_its_own_side() -> None:
    assert GRAPH.project(np.array([0.0, -1.0, 0.0])).lane == "lane.main_east_a"
    assert GRAPH.project(np.array([0.0, 1.0, 0.0])).lane == "lane.main_west_b"
    found = GRAPH.project(np.array([0.0, -2.0, 0.0]))
    assert (found.s_m, found.lateral_m) == pytest.approx((78.0, -0.25))


@given(st.sampled_from(NAMES), st.floats(0, 1), st.floats(0, 50), st.integers(0, 1000))
def test_backing_up_and_driving_on_meet(name: str, share: float, distance_m: float, seed: int) -> None:
    start_s_m = share * GRAPH.lanes[name].line.length_m
    way = back_up(GRAPH, name, start_s_m, distance_m, np.random.default_rng(seed))
    if way is None:
        return
    lanes, s_m = way
    route = Route.along(GRAPH, lanes)
    assert lanes[-1] == name
    assert s_m + distance_m == pytest.approx(route.starts_m[-1] + start_s_m, abs=0.02)
    assert all(after in GRAPH.lanes[before].next for before, after in itertools.pairwise(lanes))
    assert route.lane_at(max(0.0, s_m - 1e-6)) == 0


@given(st.sampled_from(NAMES), st.floats(1, 300), st.integers(0, 1000))
def test_driving_on_follows_next(name: str, length_m: float, seed: int) -> None:
    lanes = drive_on(GRAPH, name, length_m, np.random.default_rng(seed))
    assert lanes[0] == name
    assert all(after in GRAPH.lanes[before].next for before, after in itertools.pairwise(lanes))
    total_m = sum(GRAPH.lanes[lane].line.length_m for lane in lanes)
    assert total_m >= length_m or not GRAPH.lanes[lanes[-1]].next


def test_crossing_lanes_conflict_and_opposite_ones_do_not() -> None:
    junctions = Junctions(GRAPH)
    assert junctions.conflict("lane.x_east", "lane.x_north")
    assert junctions.conflict("lane.x_north", "lane.x_east")
    assert not junctions.conflict("lane.x_east", "lane.x_west")
    assert not junctions.conflict("lane.x_east", "lane.x_east_to_south"), "they part from one lane"


def test_a_turning_vehicle_points_from_axle_to_axle() -> None:
    corner = Polyline.through(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]))
    assert vehicle_pose(corner, 10.0, 2.0)[1] == pytest.approx(math.pi / 4)
    assert vehicle_pose(corner, 5.0, 2.0)[1] == 0
