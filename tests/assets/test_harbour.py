"""Harbour as its file says it: labels, motorway and slips, ground, bounds and where boards stand."""

from __future__ import annotations

import filecmp
import importlib
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest
import yaml

from tests.assets.test_town10 import COLLISION, VISIBLE, cast, headings, is_seen, lanes, numerics

Array = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]
TOWN = ROOT / "mjcf" / "towns" / "harbour.xml"
SCENES = ROOT / "configs" / "scenes" / "harbour.yml"
LABELS = {
    "road", "road_marking", "sidewalk", "parking", "ground", "terrain", "building", "wall", "fence", "guard_rail",
    "bridge", "pole", "traffic_light", "traffic_sign", "traffic_sign_back", "stop_sign", "vegetation", "static",
    "bench", "fire_hydrant", "parking_meter",
}  # fmt: skip
BOARDS = [f"billboard0{index}" for index in range(1, 7)]
DOWN = np.array([0.0, 0.0, -1.0])


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


def scenes() -> dict[str, dict[str, object]]:
    loaded = yaml.safe_load(SCENES.read_text(encoding="utf-8"))
    assert loaded["town"] == "harbour"
    found: dict[str, dict[str, object]] = loaded["scenes"]
    return found


def test_what_is_seen_is_labelled_and_within_the_budget(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    visible = [geom for geom in spec.geoms if geom.classname.name != "collision"]
    assert {geom.classname.name.split(".")[0] for geom in visible} == LABELS
    assert all(geom.contype == 0 and geom.conaffinity == 0 and geom.group <= 2 for geom in visible)
    assert len(visible) <= 700
    assert model.nmeshface <= 450_000


def test_the_motorway_is_fast_and_three_lanes_wide(model: mujoco.MjModel) -> None:
    speeds = {name: values[1] for name, values in numerics(model, "lane.").items()}
    assert speeds["lane.east_0b"] > 30 and speeds["lane.west_0b"] > 30
    assert max(speed for name, speed in speeds.items() if "dock" in name) < 15
    graph = lanes(model)
    for name, side in (("east", -1), ("west", 1)):
        points = [graph[f"lane.{name}_{index}b"][1] for index in range(3)]
        assert np.ptp([line[:, 1].mean() for line in points]) == pytest.approx(7.2, abs=0.01)
        assert all((line[:, 1] * side > 3).all() for line in points)
        assert all(np.sign(line[-1, 0] - line[0, 0]) == -side for line in points)


def test_lanes_go_on_for_ever_and_every_one_is_reached(model: mujoco.MjModel) -> None:
    graph = lanes(model)
    backward: dict[str, list[str]] = {name: [] for name in graph}
    for name, (_, points, links) in graph.items():
        assert links["next"], f"{name} is a dead end"
        assert np.abs(np.diff(headings(points))).max(initial=0) < np.radians(25), name
        for following in links["next"]:
            backward[following].append(name)
            other = graph[following][1]
            np.testing.assert_allclose(other[0], points[-1], atol=0.01, err_msg=f"{name} to {following}")
            turn = headings(other)[0] - headings(points)[-1]
            assert abs((turn + np.pi) % (2 * np.pi) - np.pi) < np.radians(25), (name, following)
    forward = {name: links["next"] for name, (_, _, links) in graph.items()}
    for links_of in (forward, backward):
        seen, queue = set(), ["lane.east_0b"]
        while queue:
            name = queue.pop()
            if name not in seen:
                seen.add(name)
                queue.extend(links_of[name])
        assert seen == set(graph)


def test_lanes_lie_on_the_road_for_rendering_and_collision(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    for name, (_, points, _) in lanes(model).items():
        for point in (points[:-1] + points[1:])[:: max(1, len(points) // 4)] / 2:
            start = point + np.array([0.0, 0.0, 2.0])
            distance, geom = cast(model, data, start, DOWN, COLLISION)
            assert geom.startswith("ground"), (name, point, geom)
            assert distance == pytest.approx(2.0, abs=0.03), (name, point, geom)
            seen, _ = cast(model, data, start, DOWN, VISIBLE)
            assert seen == pytest.approx(2.0, abs=0.03), (name, point)


def test_lorries_pass_under_the_bridge(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    up = np.array([0.0, 0.0, 1.0])
    for name, (_, points, _) in lanes(model).items():
        if name.split(".")[1].startswith(("east", "west")):
            for x in np.arange(points[:, 0].min(), points[:, 0].max(), 1.0):
                y = float(np.interp(x, *points[np.argsort(points[:, 0])][:, :2].T))
                distance, _ = cast(model, data, np.array([x, y, 0.3]), up, VISIBLE)
                assert distance < 0 or distance > 4.1, (name, x)
    assert lanes(model)["lane.bridge_f0"][1][:, 2].max() == pytest.approx(5.9, abs=0.01)


def test_sidewalks_are_as_high_as_a_kerb_for_rendering_and_collision(
    model: mujoco.MjModel, data: mujoco.MjData
) -> None:
    walks = numerics(model, "sidewalk.")
    assert len(walks) > 15 and len(numerics(model, "crosswalk.")) > 15
    for name, values in walks.items():
        points = values[1:].reshape(-1, 3)
        for point in (points[:-1] + points[1:])[:: max(1, len(points) // 6)] / 2:
            start = point + np.array([0.0, 0.0, 0.6])
            distance, geom = cast(model, data, start, DOWN, COLLISION)
            if geom.startswith("ground"):
                assert distance == pytest.approx(0.6, abs=0.03), (name, point, geom)
            seen, _ = cast(model, data, start, DOWN, VISIBLE)
            assert 0 < seen <= 0.63, (name, point)


def test_everything_lies_within_the_bounds(model: mujoco.MjModel) -> None:
    x0, y0, x1, y1 = model.numeric("town.bounds").data
    assert x1 - x0 >= 400 and y1 - y0 >= 300
    for prefix, head in (("lane.", 2), ("sidewalk.", 1), ("crosswalk.", 1)):
        for name, values in numerics(model, prefix).items():
            points = values[head:].reshape(-1, 3)
            assert (points[:, :2] >= (x0, y0)).all() and (points[:, :2] <= (x1, y1)).all(), name


def test_the_horizon_is_never_empty(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """From the middle of the motorway, hills or houses stand above eye level in every direction."""
    eye = np.array([-60.0, -8.0, 9.0])
    for angle in np.arange(0, 2 * np.pi, np.pi / 36):
        distance, _ = cast(model, data, eye, np.array([np.cos(angle), np.sin(angle), 0.002]), VISIBLE)
        assert distance > 0, np.degrees(angle)


def test_parking_bays_are_level_and_clear(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    bays = numerics(model, "parking.")
    assert max(values[0] for values in bays.values()) >= 15, "nowhere to park a lorry"
    for name, values in bays.items():
        for x, y, z, _ in values[2:].reshape(-1, 4):
            distance, geom = cast(model, data, np.array([x, y, z + 3.0]), DOWN, COLLISION)
            assert geom.startswith("ground") and distance == pytest.approx(3.0, abs=0.03), (name, x, y, geom)


def test_the_scene_library_has_every_scene() -> None:
    assert set(scenes()) == {*BOARDS, "truck", "no_billboard"}
    doubles = {name for name, scene in scenes().items() if len(scene.get("boards", [])) == 2}  # type: ignore[arg-type]
    assert doubles == {"billboard02", "billboard04", "billboard06"}


@pytest.mark.parametrize("name", BOARDS)
def test_drivers_see_the_boards(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
    scene: dict[str, list[dict[str, list[float]]]] = scenes()[name]  # type: ignore[assignment]
    boards = scene["boards"]
    for board in boards:
        x, y, z = board["position_m"]
        distance, geom = cast(model, data, np.array([x, y, 1.0]), DOWN, COLLISION)
        assert geom.startswith("ground") and 1.0 - distance == pytest.approx(z, abs=0.03), (name, geom)
    origin, yaw = np.array(boards[0]["position_m"]), np.radians(float(boards[0]["facing_deg"]))  # type: ignore[arg-type]
    facing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    ahead, lateral = (scene["ego"][key] for key in ("ahead_m", "lateral_m"))  # type: ignore[call-overload]
    clear = 0
    for _, points, _ in lanes(model).values():
        for start, end in pairwise(points):
            heading = (end - start) / np.linalg.norm(end - start)
            for step in np.arange(0, np.linalg.norm(end - start), 3.0):
                place = start + heading * step
                u, v = (place - origin) @ facing, (place - origin) @ np.array([-facing[1], facing[0], 0.0])
                if ahead[0] <= u <= ahead[1] and lateral[0] <= v <= lateral[1]:
                    clear += all(is_seen(model, data, place, heading, board) for board in boards)
    assert clear >= 5


def test_the_lane_graph_has_no_problems() -> None:
    build, graph = (
        importlib.import_module("authoring.towns.harbour_build"),
        importlib.import_module("authoring.towns.lanes"),
    )
    assert graph.problems(build.harbour_lanes()) == []


@pytest.mark.slow
def test_regenerating_gives_the_same_bytes(tmp_path: Path) -> None:
    for package in ("shapely", "mapbox_earcut"):
        importlib.import_module(package)
    importlib.import_module("authoring.towns.harbour_build").write_harbour(tmp_path)
    committed = sorted(path.name for path in (TOWN.parent / "harbour").iterdir())
    assert sorted(path.name for path in (tmp_path / "harbour").iterdir()) == committed
    assert (tmp_path / "harbour.xml").read_bytes() == TOWN.read_bytes()
    _, different, errors = filecmp.cmpfiles(tmp_path / "harbour", TOWN.parent / "harbour", committed, shallow=False)
    assert not different and not errors
