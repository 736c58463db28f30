"""Traffic: stops for what is ahead, gives way, walks."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import TINY_TOWN
from gear.world.roads.junctions import Junctions
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route
from gear.world.traffic.simulation import MovingPedestrian, MovingVehicle, TrafficSimulation, vehicle_discs

GRAPH = LaneGraph.from_model(mujoco.MjModel.from_xml_path(str(TINY_TOWN)), Path(TINY_TOWN))
EAST = Route.along(GRAPH, ("lane.main_east_a", "lane.x_east", "lane.main_east_b"))
NORTH = Route.along(GRAPH, ("lane.cross_south_n", "lane.x_north", "lane.cross_north_n"))
TURN = Route.along(GRAPH, ("lane.main_east_a", "lane.x_east_to_south", "lane.cross_south_s"))


def vehicle(route: Route, s_m: float, speed_mps: float, cruise_mps: float | None = None) -> MovingVehicle:
    return MovingVehicle(
        route=route,
        s_m=s_m,
        lateral_m=0.0,
        speed_mps=speed_mps,
        cruise_mps=speed_mps if cruise_mps is None else cruise_mps,
        front_m=2.25,
        rear_m=2.25,
        half_width_m=0.9,
    )


def drive(traffic: TrafficSimulation, seconds: float) -> None:
    for _ in range(round(seconds * 10)):
        traffic.advance(0.1)


def test_a_free_road_is_driven_at_cruising_speed() -> None:
    traffic = TrafficSimulation([vehicle(EAST, 5.0, 8.0)], [], [], Junctions(GRAPH))
    drive(traffic, 5)
    assert traffic.vehicles[0].speed_mps == pytest.approx(8, abs=0.2)
    assert traffic.vehicles[0].s_m == pytest.approx(45, abs=0.5)


def test_a_driver_stops_behind_what_stands() -> None:
    parked = vehicle_discs(np.array([0.0, -1.75, 0.0]), 0.0, 2.25, 2.25, 0.9)
    traffic = TrafficSimulation([vehicle(EAST, 5.0, 10.0)], [], parked, Junctions(GRAPH))
    drive(traffic, 25)
    gap_m = 78.0 - 2.25 - (traffic.vehicles[0].s_m + 2.25)
    assert traffic.vehicles[0].speed_mps < 0.05
    assert 0.5 < gap_m < 5


def test_objects_beside_the_lane_stop_no_vehicle() -> None:
    parked = vehicle_discs(np.array([0.0, 1.75, 0.0]), 0.0, 2.25, 2.25, 0.9)
    traffic = TrafficSimulation([vehicle(EAST, 5.0, 10.0)], [], parked, Junctions(GRAPH))
    drive(traffic, 10)
    assert traffic.vehicles[0].s_m > 95


def test_a_follower_keeps_its_distance_to_a_slower_car() -> None:
    traffic = TrafficSimulation([vehicle(EAST, 30.0, 4.0), vehicle(EAST, 5.0, 11.0)], [], [], Junctions(GRAPH))
    for _ in range(200):
        traffic.advance(0.1)
        ahead, behind = traffic.vehicles
        assert ahead.s_m - behind.s_m > 4.5 + 0.5
    assert traffic.vehicles[1].speed_mps == pytest.approx(4, abs=0.5)


def test_one_of_two_gives_way_where_lanes_cross() -> None:
    traffic = TrafficSimulation([vehicle(EAST, 78.0, 9.0), vehicle(NORTH, 28.0, 8.0)], [], [], Junctions(GRAPH))
    inside = 0
    for _ in range(150):
        traffic.advance(0.1)
        places = [d.route.line.at(d.s_m)[0][:2] for d in traffic.vehicles]
        assert np.linalg.norm(places[0] - places[1]) > 3.2
        inside += sum(np.abs(place - (30, 0)).max() < 4 for place in places) == 2
    assert inside == 0, "never both in the junction"
    assert all(d.s_m > 90 for d in traffic.vehicles[:1]), "and both get through"
    assert traffic.vehicles[1].s_m > 65


def test_a_turn_is_taken_slowly() -> None:
    traffic = TrafficSimulation([vehicle(TURN, 40.0, 11.0)], [], [], Junctions(GRAPH))
    speeds = []
    for _ in range(120):
        traffic.advance(0.1)
        if traffic.vehicles[0].route.lane_at(traffic.vehicles[0].s_m) == 1:
            speeds.append(traffic.vehicles[0].speed_mps)
    assert speeds
    assert max(speeds) < 6.5


def test_a_road_that_ends_is_not_driven_past() -> None:
    traffic = TrafficSimulation([vehicle(EAST, 120.0, 11.0)], [], [], Junctions(GRAPH))
    drive(traffic, 20)
    assert traffic.vehicles[0].s_m + 2.25 < EAST.line.length_m


def person(name: str, s_m: float, direction: int, beyond_m: float = -1.0) -> MovingPedestrian:
    line = GRAPH.walks[name].line
    return MovingPedestrian(
        line=line, s_m=s_m, lateral_m=0.0, direction=direction, pace_mps=1.4, speed_mps=1.4, beyond_m=beyond_m
    )


def test_people_walk_and_stop_at_the_end() -> None:
    traffic = TrafficSimulation([], [person("sidewalk.south_west", 50.0, -1)], [], Junctions(GRAPH))
    drive(traffic, 10)
    assert traffic.people[0].s_m == pytest.approx(36, abs=0.01)
    drive(traffic, 40)
    assert traffic.people[0].s_m == pytest.approx(1.0, abs=0.1)
    assert traffic.people[0].speed_mps == 0


def test_a_driver_lets_people_cross() -> None:
    traffic = TrafficSimulation(
        [vehicle(EAST, 70.0, 9.0)], [person("crosswalk.main", 0.5, 1, 1.2)], [], Junctions(GRAPH)
    )
    nearest_m = np.inf
    for _ in range(200):
        traffic.advance(0.1)
        someone = traffic.people[0].place()[0][:2]
        car = traffic.vehicles[0].route.line.at(traffic.vehicles[0].s_m)[0][:2]
        if abs(someone[1] + 1.75) < 0.9 + 0.3:
            nearest_m = min(nearest_m, abs(someone[0] - car[0]) - 2.25)
    assert nearest_m > 0.3
    assert traffic.people[0].s_m > 7, "across"
    assert traffic.vehicles[0].s_m > 110, "and then the car drives on"


def test_nothing_is_random() -> None:
    ends = []
    for _ in range(2):
        traffic = TrafficSimulation([vehicle(EAST, 78.0, 9.0), vehicle(NORTH, 28.0, 8.0)], [], [], Junctions(GRAPH))
        drive(traffic, 6)
        ends.append([d.s_m for d in traffic.vehicles])
    assert ends[0] == ends[1]
