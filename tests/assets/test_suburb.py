"""The suburb as its file says it: size, lanes, houses apart from roads, boards that drivers see."""

from __future__ import annotations

import filecmp
import importlib
from itertools import pairwise
from pathlib import Path
from typing import ClassVar

import mujoco
import numpy as np
import pytest
import yaml

from gear.testing.town_contract import STREET, TownContract
from tests.assets.test_town10 import COLLISION, cast, is_seen, lanes, numerics

ROOT = Path(__file__).parents[2]
TOWN = ROOT / "mjcf" / "towns" / "suburb.xml"
SCENES = ROOT / "configs" / "scenes" / "suburb.yml"
BOARDS = [f"billboard0{index}" for index in range(1, 7)]


@pytest.fixture(scope="module")
def spec() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_file(str(TOWN))


@pytest.fixture(scope="module")
def model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    return spec.compile()


@pytest.fixture(scope="module")
def data(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def scenes() -> dict[str, dict[str, list[dict[str, list[float]]]]]:
    loaded = yaml.safe_load(SCENES.read_text(encoding="utf-8"))
    assert loaded["town"] == "suburb"
    found: dict[str, dict[str, list[dict[str, list[float]]]]] = loaded["scenes"]
    return found


@pytest.mark.slow
class TestSuburb(TownContract):
    town = "suburb"
    expected: ClassVar = STREET | {"fence", "wall", "parking", "static", "stop_sign", "bench", "fire_hydrant"}
    samples = 10


def test_size_is_what_a_cpu_can_draw(model: mujoco.MjModel) -> None:
    assert (model.geom_group < 3).sum() <= 700
    assert model.nmeshface <= 500_000


def test_it_covers_a_suburb(model: mujoco.MjModel) -> None:
    xmin, ymin, xmax, ymax = model.numeric("town.bounds").data
    assert xmax - xmin >= 300 and ymax - ymin >= 300
    assert sum(model.geom(index).name.startswith("house_") for index in range(model.ngeom)) > 100
    assert sum((len(values) - 2) // 4 for values in numerics(model, "parking.").values()) > 60


def test_lanes_go_on_for_ever_and_circle_the_green_to_the_right(model: mujoco.MjModel) -> None:
    graph = lanes(model)
    assert len(graph) > 100
    assert all(links["next"] for _, _, links in graph.values())
    _, points, _ = graph["lane.circus_ne_f0"]
    (x0, y0), (x1, y1) = points[0, :2], points[-1, :2]
    assert x0 * y1 - y0 * x1 > 0, "traffic must keep to the right, so it circles counter-clockwise"


def test_the_horizon_is_never_empty(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    eye = np.array([0.0, -60.0, 1.65])
    visible = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    for angle in np.radians(np.arange(0, 360, 5)):
        level = np.array([np.cos(angle), np.sin(angle), 0.02])
        distance, _ = cast(model, data, eye, level / np.linalg.norm(level), visible)
        assert 0 < distance < 1300, f"nothing stands {np.degrees(angle):.0f} degrees from east"


def test_houses_stand_back_from_every_lane(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    for name, (width, points, _) in lanes(model).items():
        for point in points[:: max(1, len(points) // 6)]:
            above = point + np.array([0.0, 0.0, 30.0])
            distance, geom = cast(model, data, above, np.array([0.0, 0.0, -1.0]), COLLISION)
            assert geom.startswith("ground.") and distance == pytest.approx(30.0, abs=0.03), (name, width, geom)


def test_the_scene_library_is_complete() -> None:
    assert set(scenes()) == {*BOARDS, "truck", "no_billboard"}
    assert sum(len(scene.get("boards", [])) == 2 for scene in scenes().values()) >= 2


@pytest.mark.parametrize("name", BOARDS)
def test_drivers_see_the_boards_from_near(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
    boards = scenes()[name]["boards"]
    seen = 0
    for board in boards:
        x, y, z = board["position_m"]
        distance, geom = cast(model, data, np.array([x, y, 1.0]), np.array([0.0, 0.0, -1.0]), COLLISION)
        assert geom.startswith("ground.") and 1.0 - distance == pytest.approx(z, abs=0.03)
    origin = np.array(boards[0]["position_m"])
    for _, points, _ in lanes(model).values():
        for start, end in pairwise(points):
            heading = (end - start) / np.linalg.norm(end - start)
            for step in np.arange(0, np.linalg.norm(end - start), 2.0):
                place = start + heading * step
                if 15 <= np.linalg.norm(origin - place) <= 46:
                    seen += all(is_seen(model, data, place, heading, board) for board in boards)
    assert seen >= 4


@pytest.mark.slow
def test_regenerating_gives_the_same_bytes(tmp_path: Path) -> None:
    authoring = importlib.import_module("authoring.towns.suburb_build")
    for package in ("shapely", "mapbox_earcut"):
        importlib.import_module(package)
    authoring.write_suburb(tmp_path)
    committed = sorted(path.name for path in (TOWN.parent / "suburb").iterdir())
    assert sorted(path.name for path in (tmp_path / "suburb").iterdir()) == committed
    assert (tmp_path / "suburb.xml").read_bytes() == TOWN.read_bytes()
    _, different, errors = filecmp.cmpfiles(tmp_path / "suburb", TOWN.parent / "suburb", committed, shallow=False)
    assert not different and not errors


def test_the_lane_graph_has_no_faults() -> None:
    build = importlib.import_module("authoring.towns.suburb_build")
    graph = importlib.import_module("authoring.towns.lanes")
    assert graph.problems(build.suburb_lanes()) == []
