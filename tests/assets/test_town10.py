"""The town as its file says it: labels, lanes, ground, sidewalks and where boards stand."""

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

Array = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]
TOWN = ROOT / "mjcf" / "towns" / "town10.xml"
SCENES = ROOT / "configs" / "scenes" / "town10.yml"
COLLISION = np.array([0, 0, 0, 1, 0, 0], np.uint8)
VISIBLE = np.array([1, 1, 1, 0, 0, 0], np.uint8)
LABELS = {
    "road", "road_marking", "sidewalk", "parking", "ground", "terrain", "building", "wall", "fence", "guard_rail",
    "bridge", "pole", "traffic_light", "traffic_sign", "traffic_sign_back", "stop_sign", "vegetation", "static",
    "bench", "fire_hydrant", "parking_meter",
}  # fmt: skip
COUNTABLE = {"traffic_light", "stop_sign", "bench", "fire_hydrant", "parking_meter"}
FACE_M = (7.4, 3.7)
FACE_Z_M = 2.6
CAMERA_M = (1.5, 1.65)


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


def numerics(model: mujoco.MjModel, prefix: str) -> dict[str, Array]:
    """The `<custom>` numbers whose names start with a prefix."""
    names = [model.numeric(index).name for index in range(model.nnumeric)]
    return {name: np.array(model.numeric(name).data) for name in names if name.startswith(prefix)}


def lanes(model: mujoco.MjModel) -> dict[str, tuple[float, Array, dict[str, list[str]]]]:
    """Width, points (N, 3) and links of every lane."""
    texts = {}
    for index in range(model.ntext):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXT, index)
        start, size = model.text_adr[index], model.text_size[index]
        texts[name] = bytes(model.text_data[start : start + size]).rstrip(b"\0").decode()
    result = {}
    for name, values in numerics(model, "lane.").items():
        fields = dict(item.split("=", 1) for item in texts[name].split())
        links = {key: [n for n in value.split(",") if n] for key, value in fields.items()}
        result[name] = (float(values[0]), values[2:].reshape(-1, 3), links)
    return result


def cast(
    model: mujoco.MjModel, data: mujoco.MjData, start: Array, direction: Array, groups: npt.NDArray[np.uint8]
) -> tuple[float, str]:
    """Distance to the first geom of the groups and its name; -1 for nothing."""
    geom = np.full(1, -1, np.int32)
    distance = mujoco.mj_ray(model, data, start, direction, groups, 1, -1, geom, None)
    return float(distance), model.geom(int(geom[0])).name if geom[0] >= 0 else ""


def headings(points: Array) -> Array:
    steps = np.diff(points[:, :2], axis=0)
    return np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))


def test_visible_geoms_have_labels_and_no_collision(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    visible = [geom for geom in spec.geoms if geom.classname.name != "collision"]
    labels = {geom.classname.name.split(".")[0] for geom in visible}
    assert labels == LABELS
    assert all(geom.contype == 0 and geom.conaffinity == 0 and geom.group <= 2 for geom in visible)
    assert all(geom.group == 3 for geom in spec.geoms if geom.classname.name == "collision")


def test_countable_things_are_bodies_of_their_own(spec: mujoco.MjSpec) -> None:
    counts = dict.fromkeys(COUNTABLE, 0)
    for body in spec.bodies[1:]:
        labels = {geom.classname.name for geom in body.geoms}
        assert len(labels) == 1
        counts[labels.pop()] += 1
    assert all(count >= 15 for count in counts.values()), counts
    assert not {geom.classname.name for geom in spec.worldbody.geoms} & COUNTABLE


def test_size_is_what_a_cpu_can_draw(model: mujoco.MjModel) -> None:
    assert (model.geom_group < 3).sum() <= 1000
    assert model.nmeshface <= 910_000
    assert model.vis.map.znear * model.stat.extent == pytest.approx(0.1)
    assert model.vis.map.zfar * model.stat.extent >= 1500


def test_sun_and_sky_are_named_for_the_weather_to_find(model: mujoco.MjModel) -> None:
    assert model.nlight == 1
    assert model.light("sun").castshadow
    assert model.tex("sky").type == mujoco.mjtTexture.mjTEXTURE_SKYBOX


def test_lanes_go_on_for_ever_without_gaps_or_kinks(model: mujoco.MjModel) -> None:
    graph = lanes(model)
    assert len(graph) > 150
    for name, (width, points, links) in graph.items():
        assert links["next"], f"{name} is a dead end"
        assert 2 <= len(points) <= 160
        assert 2.8 <= width <= 4.0
        turns = np.abs(np.diff(headings(points)))
        assert turns.max(initial=0) < np.radians(25), name
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        curved = np.maximum(np.append(turns, 0), np.insert(turns, 0, 0)) > np.radians(3)
        assert steps[curved & (steps > 3.0)].size <= 2, f"{name} is drawn too coarsely where it turns"
        for following in links["next"]:
            other = graph[following][1]
            np.testing.assert_allclose(other[0], points[-1], atol=0.01)
            turn = headings(other)[0] - headings(points)[-1]
            assert abs((turn + np.pi) % (2 * np.pi) - np.pi) < np.radians(25), (name, following)


def test_every_lane_is_reached_from_every_other(model: mujoco.MjModel) -> None:
    graph = {name: links["next"] for name, (_, _, links) in lanes(model).items()}
    backward: dict[str, list[str]] = {name: [] for name in graph}
    for name, following in graph.items():
        for other in following:
            backward[other].append(name)
    for links in (graph, backward):
        seen, queue = set(), [next(iter(graph))]
        while queue:
            name = queue.pop()
            if name not in seen:
                seen.add(name)
                queue.extend(links[name])
        assert seen == set(graph)


def test_neighbours_run_side_by_side_on_the_right_side(model: mujoco.MjModel) -> None:
    graph = lanes(model)
    pairs = 0
    for _, (width, points, links) in graph.items():
        for other in links.get("left", []):
            pairs += 1
            along = (points[1] - points[0])[:2]
            offset = (graph[other][1][0] - points[0])[:2]
            assert np.linalg.norm(offset) == pytest.approx(width, abs=0.3)
            assert along[0] * offset[1] - along[1] * offset[0] > 0
    assert pairs > 10


def test_traffic_keeps_to_the_right(model: mujoco.MjModel) -> None:
    graph = lanes(model)
    name = "lane.ring_n1_f0"
    points, oncoming = graph[name][1], graph["lane.ring_n1_b0"][1]
    along, offset = (points[1] - points[0])[:2], (oncoming[-1] - points[0])[:2]
    assert along[0] * offset[1] - along[1] * offset[0] > 2.0


def test_lanes_lie_on_the_road_for_rendering_and_collision(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    down = np.array([0.0, 0.0, -1.0])
    for name, (_, points, _) in lanes(model).items():
        for point in points[:: max(1, len(points) // 4)]:
            start = point + np.array([0.0, 0.0, 2.0])
            distance, geom = cast(model, data, start, down, COLLISION)
            assert geom.startswith("ground."), (name, point, geom)
            assert distance == pytest.approx(2.0, abs=0.03), (name, point, geom)
            seen, _ = cast(model, data, start, down, VISIBLE)
            assert seen == pytest.approx(2.0, abs=0.03), (name, point)


def test_the_horizon_is_never_empty(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """From lanes all over the town something stands above eye level in every direction; over roofs hills are seen."""
    furthest_m = 0.0
    for _, points, _ in list(lanes(model).values())[::25]:
        eye = points[len(points) // 2] + np.array([0.0, 0.0, 1.65])
        for angle in np.arange(0, 2 * np.pi, np.pi / 36):
            level, raised = (
                cast(model, data, eye, np.array([np.cos(angle), np.sin(angle), slope]), VISIBLE)[0]
                for slope in (0.002, 0.08)
            )
            assert level > 0, (eye, np.degrees(angle))
            furthest_m = max(furthest_m, raised)
    assert furthest_m > 1000


def test_bridges_rise_gently(model: mujoco.MjModel) -> None:
    points = lanes(model)["lane.bridge_c_f0"][1]
    slope = np.diff(points[:, 2]) / np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    assert points[:, 2].max() > 0.9
    assert 0.03 < np.abs(slope).max() < 0.09


def test_sidewalks_are_as_high_as_a_kerb_for_rendering_and_collision(
    model: mujoco.MjModel, data: mujoco.MjData
) -> None:
    walks = numerics(model, "sidewalk.")
    assert len(walks) > 40
    down = np.array([0.0, 0.0, -1.0])
    for name, values in walks.items():
        points = values[1:].reshape(-1, 3)
        for point in (points[:-1] + points[1:])[:: max(1, len(points) // 6)] / 2:
            start = point + np.array([0.0, 0.0, 0.6])
            distance, geom = cast(model, data, start, down, COLLISION)
            if geom.startswith("ground."):
                assert distance == pytest.approx(0.6, abs=0.03), (name, point, geom)
            seen, _ = cast(model, data, start, down, VISIBLE)
            assert 0 < seen <= 0.63, (name, point)


def test_crosswalks_lie_across_roads(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    crossings = numerics(model, "crosswalk.")
    assert len(crossings) > 40
    for name, values in crossings.items():
        points = values[1:].reshape(-1, 3)
        for point in (points[0], points.mean(0), points[-1]):
            distance, geom = cast(model, data, point + np.array([0, 0, 0.1]), np.array([0.0, 0.0, -1.0]), COLLISION)
            assert geom == "ground.road" and distance == pytest.approx(0.1, abs=1e-6), (name, point, geom)


def test_parking_bays_are_clear_of_lanes(model: mujoco.MjModel) -> None:
    points = np.concatenate([points for _, points, _ in lanes(model).values()])
    bays = numerics(model, "parking.")
    assert sum((len(values) - 2) // 4 for values in bays.values()) > 60
    for name, values in bays.items():
        for x, y, _, _ in values[2:].reshape(-1, 4):
            assert np.hypot(points[:, 0] - x, points[:, 1] - y).min() > 2.4, name


def scenes() -> dict[str, dict[str, object]]:
    loaded = yaml.safe_load(SCENES.read_text(encoding="utf-8"))
    assert loaded["town"] == "town10"
    found: dict[str, dict[str, object]] = loaded["scenes"]
    return found


def test_the_scene_library_has_every_scene_of_the_paper() -> None:
    names = {f"billboard0{index}" for index in range(1, 10)} | {"truck", "no_billboard"}
    assert set(scenes()) == names
    doubles = {name for name, scene in scenes().items() if len(scene.get("boards", [])) == 2}  # type: ignore[arg-type]
    assert doubles == {"billboard05", "billboard06", "billboard07"}


@pytest.mark.parametrize("name", [f"billboard0{index}" for index in range(1, 10)])
def test_drivers_see_the_boards(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> None:
    scene: dict[str, list[dict[str, list[float]]]] = scenes()[name]  # type: ignore[assignment]
    boards = scene["boards"]
    bounds = model.numeric("town.bounds").data
    for board in boards:
        x, y, z = board["position_m"]
        assert bounds[0] < x < bounds[2] and bounds[1] < y < bounds[3]
        distance, geom = cast(model, data, np.array([x, y, 1.0]), np.array([0.0, 0.0, -1.0]), COLLISION)
        assert geom.startswith("ground.") and 1.0 - distance == pytest.approx(z, abs=0.03)
    origin, facing, left = face_frame(boards[0])
    ahead, lateral = (scene["ego"][key] for key in ("ahead_m", "lateral_m"))  # type: ignore[call-overload]
    clear_m = 0
    for _, points, _ in lanes(model).values():
        for start, end in pairwise(points):
            heading = (end - start) / np.linalg.norm(end - start)
            for step in np.arange(0.5, np.linalg.norm(end - start), 1.0):
                place = start + heading * step
                u, v = (place - origin) @ facing, (place - origin) @ left
                if ahead[0] <= u <= ahead[1] and lateral[0] <= v <= lateral[1]:
                    clear_m += all(is_seen(model, data, place, heading, board) for board in boards)
    assert clear_m >= 10


def face_frame(board: dict[str, list[float]]) -> tuple[Array, Array, Array]:
    """A board's origin on the ground, where it faces, and its left."""
    yaw = np.radians(float(board["facing_deg"]))  # type: ignore[arg-type]
    facing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    return np.array(board["position_m"]), facing, np.array([-facing[1], facing[0], 0.0])


def is_seen(
    model: mujoco.MjModel, data: mujoco.MjData, place: Array, heading: Array, board: dict[str, list[float]]
) -> bool:
    """Whether a level camera on a car with a field of view of 90 degrees has most of a face before it."""
    flat = np.array([heading[0], heading[1], 0.0]) / np.hypot(heading[0], heading[1])
    camera = place + flat * CAMERA_M[0] + (0.0, 0.0, CAMERA_M[1])
    origin, facing, left = face_frame(board)
    centre = origin + np.array([0.0, 0.0, FACE_Z_M])
    right = np.array([flat[1], -flat[0], 0.0])
    corners = centre + np.array([left * u + (0, 0, v) for u in (-3.7, 3.7) for v in (-1.85, 1.85)]) - camera
    depth = corners @ flat
    if depth.min() < 2 or (np.abs(corners @ right) / depth).max() > 1 or (np.abs(corners[:, 2]) / depth).max() > 0.5:
        return False
    if facing @ (camera - centre) / np.linalg.norm(camera - centre) < 0.3:
        return False
    unblocked = 0
    for u in (-0.8, 0.0, 0.8):
        for v in (-0.7, 0.7):
            target = centre + left * u * FACE_M[0] / 2 + facing * 0.05 + (0.0, 0.0, v * FACE_M[1] / 2)
            away = float(np.linalg.norm(target - camera))
            distance, _ = cast(model, data, camera, (target - camera) / away, VISIBLE)
            unblocked += distance < 0 or distance > away - 0.3
    return unblocked >= 5


def test_regenerating_gives_the_same_bytes(tmp_path: Path) -> None:
    authoring = importlib.import_module("authoring.towns.assemble")
    for package in ("shapely", "mapbox_earcut"):
        importlib.import_module(package)
    authoring.write_town10(tmp_path)
    committed = sorted(path.name for path in (TOWN.parent / "town10").iterdir())
    assert sorted(path.name for path in (tmp_path / "town10").iterdir()) == committed
    assert (tmp_path / "town10.xml").read_bytes() == TOWN.read_bytes()
    _, different, errors = filecmp.cmpfiles(tmp_path / "town10", TOWN.parent / "town10", committed, shallow=False)
    assert not different and not errors
