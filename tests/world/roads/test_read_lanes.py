"""Lanes are read from a town's file without compiling the town."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.testing.tiny_town import TINY_TOWN
from gear.values.errors import TownError
from gear.world.roads.read_lanes import read_lanes


def test_lanes_and_walks_are_read_without_meshes() -> None:
    graph = read_lanes(TINY_TOWN)
    assert graph.lanes and all(name.startswith("lane.") for name in graph.lanes)
    assert all(len(lane.line.points_m) >= 2 for lane in graph.lanes.values())


def test_a_file_without_lanes_is_one_line(tmp_path: Path) -> None:
    town = tmp_path / "town.xml"
    town.write_text("<mujoco/>")
    with pytest.raises(TownError, match="has no lanes"):
        read_lanes(town)
    town.write_text("<mujoco>")
    with pytest.raises(TownError, match="cannot be read as MJCF"):
        read_lanes(town)
