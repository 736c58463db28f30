"""Checks of a town's lanes, walks and parking bays, on the tiny town."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.testing.town_clear import blocked_lanes, blocked_walks
from gear.testing.town_facts import TownUnderTest, town_under_test
from gear.testing.town_streets import (
    bad_bays,
    dead_ends,
    idle_crosswalks,
    kinks,
    lanes_off_the_road,
    lost_neighbours,
    odd_sizes,
    out_of_bounds,
    walks_off_the_ground,
)
from gear.world.roads.polyline import Polyline


@pytest.fixture(scope="module")
def town() -> TownUnderTest:
    return town_under_test(str(TINY_TOWN), str(TINY_SCENES))


def test_a_sound_town_has_no_findings(town: TownUnderTest) -> None:
    graph = town.graph
    assert kinks(graph, 30.0) == []
    assert odd_sizes(graph, (2.0, 6.0), (2.0, 30.0)) == []
    assert lost_neighbours(graph) == []
    assert lanes_off_the_road(town, 0.1, 0.8) == []
    assert walks_off_the_ground(town, 0.1) == []
    assert idle_crosswalks(graph) == []
    assert bad_bays(town, 0.1) == []
    assert out_of_bounds(graph) == []
    assert blocked_lanes(town) == []
    assert blocked_walks(town) == []


def test_limits_that_a_town_misses_name_its_lanes(town: TownUnderTest) -> None:
    graph = town.graph
    lanes = len(graph.lanes)
    assert len(odd_sizes(graph, (9.0, 10.0), (2.0, 30.0))) >= lanes
    assert len(odd_sizes(graph, (2.0, 6.0), (90.0, 100.0))) == lanes
    ends = {name for name, lane in graph.lanes.items() if not lane.next}
    found = dead_ends(graph, frozenset(), 0.5)
    assert all(any(name in line for line in found) for name in ends)
    assert dead_ends(graph, frozenset(ends), 0.5) == []


def test_broken_lanes_are_found(town: TownUnderTest) -> None:
    graph = town.graph
    name, lane = next((name, lane) for name, lane in graph.lanes.items() if lane.line.length_m > 10)
    start, end = lane.line.points_m[0], lane.line.points_m[-1]
    along = (end - start) / np.linalg.norm(end - start)
    corner = (start + end) / 2 + lane.line.length_m / 2 * np.array([-along[1], along[0], 0.0])
    bent = replace(lane, line=Polyline.through(np.array([start, corner, end])))
    assert any(name in line for line in kinks(replace(graph, lanes={**graph.lanes, name: bent}), 20.0))
    small = (start[0] - 1, start[1] - 1, start[0] + 1, start[1] + 1)
    assert any(name in line for line in out_of_bounds(replace(graph, bounds_m=small)))
    wrong = replace(graph, lanes={**graph.lanes, name: replace(lane, left=name)})
    assert any(name in line for line in lost_neighbours(wrong))
