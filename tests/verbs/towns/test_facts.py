"""The facts of a town are those of its files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import ConfigError, TownError, UnknownNameError
from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer, town_map
from gear.verbs.towns.facts import Town, read_town
from gear.world.roads.lanes import LaneGraph

from .conftest import edited_town


def test_facts_are_those_of_the_file(tiny: Town) -> None:
    numerics = {
        n.get("name", ""): np.array(n.get("data", "").split(), float) for n in ET.parse(TINY_TOWN).iter("numeric")
    }
    lanes = {name: values[2:].reshape(-1, 3)[:, :2] for name, values in numerics.items() if name.startswith("lane.")}
    km = sum(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()) for line in lanes.values()) / 1000
    assert (tiny.name, tiny.size_m, len(tiny.lanes.lanes)) == ("tiny", (160.0, 120.0), len(lanes))
    assert tiny.lane_km == pytest.approx(km)
    assert tiny.scenes is not None and list(tiny.scenes.scenes) == ["board", "double", "truck", "no_billboard"]


def test_lanes_read_alone_are_those_of_the_compiled_town(tiny: Town) -> None:
    compiled = LaneGraph.from_model(mujoco.MjModel.from_xml_path(str(TINY_TOWN)), TINY_TOWN)
    assert compiled.lanes.keys() == tiny.lanes.lanes.keys() and compiled.bays == tiny.lanes.bays
    for name, lane in compiled.lanes.items():
        other = tiny.lanes.lanes[name]
        assert (lane.next, lane.width_m, lane.speed_mps) == (other.next, other.width_m, other.speed_mps)
        assert np.array_equal(lane.line.points_m, other.line.points_m)


def test_town10_is_listed_with_its_scenes() -> None:
    town = read_town("town10")
    assert town.size_m == (440.0, 440.0)
    assert town.scenes is not None and {f"billboard0{n}" for n in range(1, 10)} < set(town.scenes.scenes)


def test_unknown_arguments_are_errors(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean town10"):
        read_town("town1O")
    with pytest.raises(UnknownNameError, match=r"nowhere\.yml"):
        read_town(TINY_TOWN, tmp_path / "nowhere.yml")
    with pytest.raises(ConfigError, match="stand in tiny, not in town10"):
        read_town("town10", TINY_SCENES)
    with pytest.raises(TownError, match=r"town\.bounds must be"):
        read_town(edited_town(tmp_path, 'name="town.bounds"', 'name="town.bonds"'))
    (tmp_path / "no.xml").write_text("<mujoco><worldbody><", encoding="utf-8")
    with pytest.raises(TownError, match=r"no.xml: cannot be read as MJCF: unclosed token"):
        read_town(tmp_path / "no.xml")


@pytest.mark.parametrize(("file", "said"), [("tiny.xml", "tiny"), ("tiny", "tiny"), ("tiny.mjcf", "tiny.mjcf")])
def test_a_town_is_read_by_every_spelling_that_collections_take(
    file: str, said: str, tmp_path: Path, tiny: Town, tiny_map: UInt8Image
) -> None:
    path = edited_town(tmp_path, "</custom>", "</custom><include file='more.xml'/>")
    (path.parent / "more.xml").write_text("<mujoco><worldbody/></mujoco>", encoding="utf-8")
    path = path.rename(path.with_name(file))
    town = read_town(path.with_name(said), TINY_SCENES)
    assert town.library.town == path.resolve() and town.to_json() | {"path": ""} == tiny.to_json() | {"path": ""}
    assert np.array_equal(town_map.draw_map(town, ground_layer.TownGeometry.of(path)), tiny_map)
