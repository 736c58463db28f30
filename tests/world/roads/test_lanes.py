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
from gear.values.geometry import wrap_angle_rad
from gear.world.roads.junctions import Junctions
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.polyline import Polyline
from gear.world.roads.routes import Route, extend_route, moving_pose, trace_back, vehicle_pose
from gear.world.traffic.simulation import MovingPedestrian

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
        (
            '<numeric name="lane.a" data="3 10  0 0 0  1e9 0 0"/>',
            r"lane.a reaches 1e\+09 m.* 10000 m .*are those metres",
        ),
        (GOOD + '<numeric name="sidewalk.a" data="3  0 -5e6 0  9 0 0"/>', r"sidewalk.a reaches -5e\+06 m"),
        (GOOD + '<numeric name="parking.p" data="5 2  1 2e4 0 90"/>', "parking.p reaches 20000 m"),
        (GOOD + '<text name="lane.A" data="next=lane.a"/>', "a text for lane.A, but no numeric of that name"),
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


@pytest.mark.parametrize(("bounds", "told"), [("0 0 1e-9 9", "at least 1 m wide"), ("0 0 9 1e9", "reaches 1e")])
def test_bounds_are_those_of_a_town(bounds: str, told: str) -> None:
    """A map of it would take all memory."""
    custom = f'{GOOD}<numeric name="town.bounds" data="{bounds}"/>'
    with pytest.raises(TownError, match=rf"town\.bounds.*{told}"):
        LaneGraph.from_model(
            mujoco.MjModel.from_xml_string(f"<mujoco><custom>{custom}</custom></mujoco>"), Path("town.xml")
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
    way = trace_back(GRAPH, name, start_s_m, distance_m, np.random.default_rng(seed))
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
    lanes = extend_route(GRAPH, name, length_m, np.random.default_rng(seed))
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


@pytest.mark.parametrize(("turn_deg", "lateral_m"), [(12, -0.96), (-12, -0.96), (90, 0.9), (90, -0.9), (-136, -1.2)])
def test_people_do_not_jump_where_a_line_turns(turn_deg: float, lateral_m: float) -> None:
    turn = math.radians(turn_deg)
    line = Polyline.through(
        np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [20 + 20 * math.cos(turn), 20 * math.sin(turn), 0.0]])
    )
    places = [
        MovingPedestrian(
            line=line, s_m=s_m, lateral_m=lateral_m, direction=1, pace_mps=1.0, speed_mps=1.0, beyond_m=0.0
        ).place()
        for s_m in np.arange(10.0, 30.0, 0.05)
    ]
    for (before, was_rad), (after, is_rad) in itertools.pairwise(places):
        step_m = (after - before)[:2] @ (math.cos(is_rad), math.sin(is_rad))
        assert np.linalg.norm(after - before) < 0.1 and abs(wrap_angle_rad(is_rad - was_rad)) < 0.05
        assert step_m > 0 or abs(turn_deg) > 90, "nobody steps back at a right angle"
    assert wrap_angle_rad(places[-1][1] - places[0][1]) == pytest.approx(turn)
    for point, heading_rad in (places[0], places[-1]):  # far from the corner, as for a single picture
        s_m, beside_m, _ = line.project(point)
        assert beside_m == pytest.approx(lateral_m) and heading_rad == pytest.approx(line.at(s_m)[1])


def test_vehicles_beside_the_middle_do_not_jump_where_pieces_of_a_lane_meet() -> None:
    turns_rad = np.cumsum([0.0, *(0.15,) * 6, *(-0.1,) * 8])  # a junction's arc, left and then right again
    points_m = np.concatenate(
        [[[0.0, 0.0]], np.cumsum(2 * np.stack([np.cos(turns_rad), np.sin(turns_rad)], 1), axis=0)]
    )
    line = Polyline.through(np.column_stack([points_m, np.zeros(len(points_m))]))
    for lateral_m in (-0.96, 0.96):
        places = [moving_pose(line, s_m, 0.9, lateral_m) for s_m in np.arange(2.0, line.length_m - 2.0, 0.05)]
        for (before, _, _), (after, yaw_rad, pace) in itertools.pairwise(places):
            assert (after - before)[:2] @ (math.cos(yaw_rad), math.sin(yaw_rad)) > 0
            assert np.linalg.norm(after - before) == pytest.approx(0.05 * pace, abs=0.01)
        paces = [pace for _, _, pace in places]
        assert min(paces) < 0.95 and max(paces) > 1.05, "inside a turn the way is shorter"
