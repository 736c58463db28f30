"""Plans: pure, in view, on the road, on the ground, and without overlaps."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from gear.config.collection import SplitConfig
from gear.testing.tiny_town import CLEAR, SMALL_RIG, TINY_TOWN, tiny_scenes, tiny_world
from gear.values.errors import PlacementError
from gear.values.geometry import wrap_angle_rad
from gear.values.rig import Rig
from gear.values.scene import ActorRecord, SceneRecord
from gear.values.serial import from_json, to_json
from gear.world.planner import ScenePlanner
from gear.world.scene_spec import EgoLimits, NpcLimits, SceneSpec, VehicleLimits
from gear.world.traffic import spawn
from gear.world.traffic.crowd import RoadUsers
from gear.world.traffic.sequence import SequenceSimulator
from gear.world.world import World

SCENES = ("board", "double", "truck", "no_billboard")
STILL = SplitConfig(seed=7, samples=50)
DRIVE = SplitConfig(seed=3, samples=2, frames=60, interval_s=0.1)


def planner(scene: str, split: SplitConfig = STILL, name: str = "test") -> ScenePlanner:
    return ScenePlanner(tiny_world(scene), SMALL_RIG, split, split_name=name)


def records(scene: str, count: int = 12) -> list[SceneRecord]:
    plans = planner(scene)
    return [plans.plan(index) for index in range(count)]


def yaw_rad(actor: ActorRecord) -> float:
    return actor.world_from_actor.transform("world", "actor").yaw_rad


def distances(record: SceneRecord) -> list[tuple[float, ActorRecord, ActorRecord]]:
    """Between the boxes of all pairs of actors, by MuJoCo's distance function on a model made here."""
    types = tiny_world(record.scene).types
    spec = mujoco.MjSpec()
    for actor in record.actors:
        shape = types[actor.asset].shape
        body = spec.worldbody.add_body(pos=actor.world_from_actor.position_m, quat=actor.world_from_actor.quat_wxyz)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=shape.box_size_m / 2, pos=shape.box_centre_m)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return [
        (mujoco.mj_geomDistance(model, data, i, j, 50.0, None), record.actors[i], record.actors[j])
        for i, j in itertools.combinations(range(model.ngeom), 2)
    ]


@pytest.mark.parametrize("scene", SCENES)
def test_a_plan_depends_on_nothing_but_its_index(scene: str) -> None:
    forward = [planner(scene).plan(index) for index in range(4)]
    plans = planner(scene)
    backward = [plans.plan(index) for index in (3, 2, 1, 0)][::-1]
    assert forward == backward
    other = World.build(town=TINY_TOWN, scene_name=scene, scene=tiny_scenes().scenes[scene], weather=CLEAR)
    assert ScenePlanner(other, SMALL_RIG, STILL, split_name="test").plan(2) == forward[2]
    assert len({record.actors for record in forward}) == 4, "samples differ"


def test_records_survive_json() -> None:
    for scene in SCENES:
        record = planner(scene).plan(1)
        assert from_json(SceneRecord, to_json(record)) == record


def test_the_seed_changes_the_scene_and_the_name_of_the_split_does_not() -> None:
    here = planner("board").plan(0)
    night = planner("board", name="test_night").plan(0)
    assert night == dataclasses.replace(here, split="test_night")
    assert planner("board", SplitConfig(seed=8, samples=1)).plan(0).actors != here.actors


@pytest.mark.parametrize("scene", SCENES)
def test_no_two_actors_overlap(scene: str) -> None:
    for record in records(scene):
        for distance_m, first, second in distances(record):
            assert distance_m > 0.1, (record.index, first, second)


@pytest.mark.parametrize("scene", SCENES)
def test_everybody_is_where_such_people_are(scene: str) -> None:
    world = tiny_world(scene)
    seen = set()
    for record in records(scene):
        assert [actor.id for actor in record.actors] == list(range(1, len(record.actors) + 1))
        assert record.actors[0].role == "ego"
        for actor in record.actors:
            place = np.array(actor.world_from_actor.position_m)
            seen.add(actor.role)
            if actor.role == "pedestrian":
                off_m = min(
                    max(0.0, abs(lateral) - walk.width_m / 2) + max(0.0, distance - walk.width_m)
                    for walk in world.lanes.walks.values()
                    for _, lateral, distance in [walk.line.project(place)]
                )
                assert off_m < 0.05, actor
                assert np.linalg.norm(actor.velocity_world_mps) < 2
            elif actor.role == "parked":
                bay = min(world.lanes.bays, key=lambda bay: np.linalg.norm(place - bay.position_m))
                assert np.linalg.norm(place - bay.position_m) < 0.4, actor
                assert abs(math.sin(yaw_rad(actor) - bay.yaw_rad)) < 0.06
                assert actor.velocity_world_mps == (0, 0, 0)
            else:
                nearest = world.lanes.project(place)
                assert abs(nearest.lateral_m) < 1.75, actor
                heading_rad = world.lanes.lanes[nearest.lane].line.at(nearest.s_m)[1]
                if not world.lanes.lanes[nearest.lane].is_junction:
                    assert abs(wrap_angle_rad(yaw_rad(actor) - heading_rad)) < 0.2, actor
    assert {"ego", "npc", "pedestrian"} <= seen


def test_the_ground_carries_them() -> None:
    on_hill = 0
    for scene in SCENES:
        for record in records(scene, 25):
            for actor in record.actors:
                x, y, z = actor.world_from_actor.position_m
                pose = actor.world_from_actor.transform("world", "actor")
                if actor.role == "pedestrian":
                    on_kerb = abs(y) > 3.5 and abs(x - 30) > 3.5
                    assert z == pytest.approx(0.15 if on_kerb else 0, abs=1e-6), actor
                    assert pose.rotation[2, 2] == 1
                elif y > 24 and abs(x - 30) < 3.5:
                    on_hill += 1
                    assert z == pytest.approx((y - 20) / 10, abs=0.005), actor
                    climb = math.degrees(math.asin(pose.rotation[2, 0]))
                    assert climb == pytest.approx(math.copysign(5.71, math.sin(pose.yaw_rad)), abs=0.15)
                elif y < 15:
                    assert z == pytest.approx(0, abs=1e-6), actor
    assert on_hill > 3


def lowered(folder: Path, depth_m: float) -> Path:
    """The tiny town with all that is in it so much further down."""
    tree = ElementTree.parse(TINY_TOWN)
    numbers = [(element, "pos", 0, 3) for element in tree.findall("worldbody/*")]
    for name, leading, step in (("lane", 2, 3), ("sidewalk", 1, 3), ("crosswalk", 1, 3), ("parking", 2, 4)):
        numbers += [(element, "data", leading, step) for element in tree.findall("custom/numeric")
                    if element.get("name", "").startswith(f"{name}.")]  # fmt: skip
    for element, key, leading, step in numbers:
        values = [float(word) for word in element.get(key, "").split()]
        values[leading + 2 :: step] = [z_m - depth_m for z_m in values[leading + 2 :: step]]
        element.set(key, " ".join(map(str, values)))
    town = folder / "towns" / "tiny.xml"
    town.parent.mkdir()
    tree.write(town)
    for actor_type in ("vehicles", "pedestrians", "surfaces"):
        (folder / actor_type).symlink_to(TINY_TOWN.parents[1] / actor_type)
    return town


@pytest.mark.parametrize("depth_m", [60.0, 100.0])
def test_a_town_may_lie_far_below_its_origin(tmp_path: Path, depth_m: float) -> None:
    """Whoever does not take part waits below it, not in its streets or its sky."""
    scene = tiny_scenes().scenes["no_billboard"]
    world = World.build(town=lowered(tmp_path, depth_m), scene_name="no_billboard", scene=scene, weather=CLEAR)
    plans = ScenePlanner(world, SMALL_RIG, STILL, split_name="test")
    for index, usual in enumerate(records("no_billboard")):
        record = plans.plan(index)
        assert [actor.asset for actor in record.actors] == [actor.asset for actor in usual.actors]
        for actor, other in zip(record.actors, usual.actors, strict=True):
            x_m, y_m, z_m = other.world_from_actor.position_m
            assert actor.world_from_actor.position_m == pytest.approx((x_m, y_m, z_m - depth_m), abs=1e-3)
        heights_m = world.place(record).stage.data.mocap_pos[:, 2]
        assert (heights_m > -depth_m - 1).sum() == len(record.actors)
        assert (heights_m < -depth_m - 50).sum() == len(heights_m) - len(record.actors)


@pytest.mark.parametrize("scene", ["truck", "no_billboard"])
def test_no_vehicle_stands_with_half_of_its_wheels_over_an_edge(tmp_path: Path, scene: str) -> None:
    """The lane to the east leads along a drop; four feet on two levels lie in one plane, and that is no ground."""
    town = lowered(tmp_path, 0.0)
    text = town.read_text()
    for old, new in (("0.0 0.0 -0.55", "0 0 -1.8"), ("0.0 0.0 -0.25", "0 1.75 -0.25")):
        assert f'class="collision" pos="{old}"' in text
        text = text.replace(f'class="collision" pos="{old}"', f'class="collision" pos="{new}"')
    town.write_text(text)
    world = World.build(town=town, scene_name=scene, scene=tiny_scenes().scenes[scene], weather=CLEAR)
    plans = ScenePlanner(world, SMALL_RIG, STILL, split_name="test")
    for index in range(12):
        for actor in plans.plan(index).actors:
            assert actor.world_from_actor.transform("world", "actor").rotation[2, 2] > 0.9


@pytest.mark.parametrize("scene", ["board", "double", "truck"])
def test_the_reference_camera_has_every_face_in_view(scene: str) -> None:
    world = tiny_world(scene)
    for record in records(scene):
        camera = record.cameras[0]
        placed = world.place(record)
        camera_from_world = camera.world_from_camera_transform.inverse()
        eye_m = camera.world_from_camera_transform.translation_m
        assert len(record.surfaces) == len(world.faces)
        for surface, face in zip(record.surfaces, world.faces, strict=True):
            frame = record.world_from_surface(surface)
            u, v = camera.intrinsics.project(camera_from_world.apply(frame.translation_m))
            assert 10 < u < camera.width_px - 10
            assert 5 < v < camera.height_px - 5
            ray = eye_m - frame.translation_m
            cosine = -frame.rotation[:, 2] @ ray / np.linalg.norm(ray)
            assert cosine > math.cos(math.radians(75)), "the front, and not too obliquely"
            hits = 0
            for right, down in itertools.product(np.linspace(-0.45, 0.45, 7), repeat=2):
                target = frame.apply([right * surface.width_m, down * surface.height_m, 0.0])
                geom = np.zeros(1, np.int32)
                mujoco.mj_ray(placed.stage.model, placed.stage.data, eye_m, target - eye_m, None, 1, -1, geom)
                hits += int(geom[0]) == face.geom_id
            assert hits >= 0.3 * 49, record.index


@pytest.mark.parametrize("scene", ["board", "truck"])
def test_a_rig_that_follows_the_road_has_every_face_in_view(scene: str) -> None:
    follows = dataclasses.replace(SMALL_RIG, follows_road=True)
    for index in range(4):
        record = ScenePlanner(tiny_world(scene), follows, STILL, split_name="test").plan(index)
        assert record.cameras == follows.place(record.ego.world_from_actor.transform("world", "ego"))
        assert record.actors == planner(scene).plan(index).actors, "the road is level where the boards and trucks are"


def test_the_ego_car_keeps_its_limits() -> None:
    places = np.array([record.ego.world_from_actor.position_m for record in records("board", 30)])
    facing = math.radians(175)
    offset = places[:, :2] - np.array([55.0, -8.5])
    ahead_m = offset @ np.array([math.cos(facing), math.sin(facing)])
    left_m = offset @ np.array([-math.sin(facing), math.cos(facing)])
    assert (ahead_m > 11.4).all()
    assert (ahead_m < 45.6).all()
    assert (np.abs(left_m) < 12.5).all()
    assert np.ptp(ahead_m) > 15, "they spread"


def test_the_truck_is_ahead_in_the_same_lane() -> None:
    world = tiny_world("truck")
    gaps_m = []
    for record in records("truck", 25):
        ego, truck = record.actors[:2]
        assert truck.role == "carrier"
        assert record.surfaces[0].actor_id == truck.id
        ego_from_truck = ego.world_from_actor.transform("world", "ego").inverse()
        face_m = ego_from_truck.apply(record.world_from_surface(record.surfaces[0]).translation_m)
        gaps_m.append(face_m[0] - world.types[ego.asset].front_m)
        for other in record.actors[2:]:
            x, y, _ = ego_from_truck.apply(other.world_from_actor.position_m)
            assert not (0 < x < face_m[0] and abs(y) < 1), "nobody between"
    assert min(gaps_m) > 2.5
    assert max(gaps_m) < 20.5
    assert np.ptp(gaps_m) > 5


def test_counts_and_regions_are_kept() -> None:
    for record in records("no_billboard", 30):
        ego = np.array(record.ego.world_from_actor.position_m)
        vehicles = [actor for actor in record.actors if actor.role in ("npc", "parked")]
        people = [actor for actor in record.actors if actor.role == "pedestrian"]
        assert 2 <= len(vehicles) <= 5
        assert 2 <= len(people) <= 6
        assert all(np.linalg.norm(ego - actor.world_from_actor.position_m) < 61.5 for actor in vehicles + people)


def test_no_bicycle_is_on_a_motorway(monkeypatch: pytest.MonkeyPatch) -> None:
    def kinds() -> set[str]:
        types = tiny_world("no_billboard").types
        return {types[a.asset].facts.kind for r in records("no_billboard", 20) for a in r.actors if a.role == "npc"}

    assert "bicycle" in kinds()
    monkeypatch.setattr(spawn, "MOTORWAY_MPS", 6.5)  # every lane of the tiny town is faster
    assert "car" in kinds()
    assert "bicycle" not in kinds()


def test_colours_come_from_the_palette() -> None:
    palette = {colour for colour, _ in tiny_world("board").types["car_saloon"].facts.palette}
    painted = {a.paint_rgb for record in records("board") for a in record.actors}
    assert painted <= palette
    assert len(painted) > 1


def test_road_users_never_share_a_number_with_things_of_the_town(monkeypatch: pytest.MonkeyPatch) -> None:
    (record, *_) = records("board", 1)
    monkeypatch.setattr("gear.world.planner.STATIC_OBJECT_BASE", len(record.actors))
    with pytest.raises(PlacementError, match=f"{len(record.actors)} road users, {len(record.actors) - 1} at most"):
        planner("board").plan(0)


def plan_scene(scene: SceneSpec) -> SceneRecord:
    world = World.build(town=TINY_TOWN, scene_name="odd", scene=scene, weather=CLEAR)
    return ScenePlanner(world, SMALL_RIG, STILL, split_name="test").plan(0)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"ego": EgoLimits(ahead_m=(500.0, 600.0), lateral_m=(0.0, 1.0))}, "no lane lies within ego.ahead_m"),
        ({"ego": EgoLimits(ahead_m=(0.0, 3.0), lateral_m=(-20.0, 20.0))}, "have a face out of the picture"),
        (
            {"npc_vehicles": VehicleLimits(count=(30, 30), ahead_m=(0.0, 20.0), lateral_m=(-9.0, 0.0))},
            "npc_vehicles.count asks for at least 30",
        ),
        (
            {"pedestrians": NpcLimits(count=(3, 3), ahead_m=(900.0, 999.0))},
            "pedestrians.count asks for at least 3, but only 0",
        ),
    ],
)
def test_limits_that_are_too_tight_are_named(change: dict[str, object], told: str) -> None:
    scene = dataclasses.replace(tiny_scenes().scenes["board"], **change)  # type: ignore[arg-type]
    with pytest.raises(PlacementError, match=told):
        plan_scene(scene)


def test_a_hidden_board_is_refused() -> None:
    scene = tiny_scenes().scenes["board"]
    behind_house = dataclasses.replace(scene.boards[0], position_m=(-20.0, 27.0, 0.0), facing_deg=270.0)
    ego = EgoLimits(ahead_m=(5.0, 60.0), lateral_m=(-50.0, 50.0), max_incidence_deg=89.0)
    with pytest.raises(PlacementError, match="have a face hidden"):
        plan_scene(dataclasses.replace(scene, boards=(behind_house,), ego=ego))


@pytest.mark.parametrize("scene", ["board", "truck", "no_billboard"])
def test_sequences_drive_without_overlaps(scene: str) -> None:
    plans = planner(scene, DRIVE, "video")
    frames = [plans.plan(index) for index in range(DRIVE.frames)]
    assert [frame.frame for frame in frames] == list(range(DRIVE.frames))
    assert {frame.sequence for frame in frames} == {0}
    assert frames[10].time_s == 1.0
    for before, after in itertools.pairwise(frames):
        assert [(a.id, a.asset, a.paint_rgb, a.role) for a in before.actors] == [
            (a.id, a.asset, a.paint_rgb, a.role) for a in after.actors
        ]
        for a, b in zip(before.actors, after.actors, strict=True):
            step_m = np.subtract(b.world_from_actor.position_m, a.world_from_actor.position_m)
            expected_m = np.add(a.velocity_world_mps, b.velocity_world_mps) / 2 * DRIVE.interval_s
            axes = 2 if b.role == "pedestrian" else 3  # people step up and down kerbs
            assert np.linalg.norm((step_m - expected_m)[:axes]) < 0.1 + 0.02 * np.linalg.norm(expected_m), (b, step_m)
            assert abs(wrap_angle_rad(yaw_rad(b) - yaw_rad(a))) < 0.25
    for record in frames[::6]:
        for distance_m, first, second in distances(record):
            assert distance_m > 0, (record.frame, first, second)
    went_m = np.subtract(frames[-1].ego.world_from_actor.position_m, frames[0].ego.world_from_actor.position_m)
    assert np.linalg.norm(went_m) > 1
    if scene == "board":
        camera = frames[0].cameras[0]
        centre_m = camera.world_from_camera_transform.inverse().apply((55.0, -8.5, 2.6))
        u, v = camera.intrinsics.project(centre_m)
        assert centre_m[2] > 0
        assert 0 < u < camera.width_px
        assert 0 < v < camera.height_px


def test_a_busy_sequence_is_simulated_until_no_actors_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the eighth who was in the way, it was the ego car that could not drive."""
    rehearse, clashes = SequenceSimulator._simulate_once, 0

    def clash(self: SequenceSimulator, road_users: RoadUsers, *rest: Any) -> Any:
        nonlocal clashes
        others = [body for body in road_users.spawns if body not in road_users.protected]
        if len(others) == 1:
            return rehearse(self, road_users, *rest)
        clashes += 1
        return [], others[-1]

    scene = tiny_scenes().scenes["no_billboard"]
    busy = dataclasses.replace(
        scene, npc_vehicles=VehicleLimits(count=(5, 5)), pedestrians=NpcLimits(count=(12, 12), radius_m=(0.0, 60.0))
    )
    world = World.build(town=TINY_TOWN, scene_name="busy", scene=busy, weather=CLEAR)
    monkeypatch.setattr(SequenceSimulator, "_simulate_once", clash)
    assert len(ScenePlanner(world, SMALL_RIG, DRIVE, split_name="video").plan(59).actors) == 2
    assert clashes == 16
    monkeypatch.setattr(
        SequenceSimulator, "_simulate_once", lambda self, road_users, *_: ([], next(iter(road_users.protected)))
    )
    with pytest.raises(PlacementError, match="sequence 0: the ego car cannot drive 60 frames without an overlap"):
        ScenePlanner(world, SMALL_RIG, DRIVE, split_name="video").plan(0)


def test_who_drives_beside_the_middle_of_a_lane_drives_evenly() -> None:
    """A bicycle, for one, where the pieces of a turn meet on its own side."""
    plans = planner("board", dataclasses.replace(DRIVE, seed=0, frames=40), "video")
    for before, after in itertools.pairwise(plans.plan(index) for index in range(40, 80)):
        for a, b in zip(before.actors, after.actors, strict=True):
            step_m = np.subtract(b.world_from_actor.position_m, a.world_from_actor.position_m)[:2]
            expected_m = (np.add(a.velocity_world_mps, b.velocity_world_mps) / 2 * DRIVE.interval_s)[:2]
            assert np.linalg.norm(step_m - expected_m) < 0.1 + 0.02 * np.linalg.norm(expected_m), (b, step_m)


def test_a_frame_alone_is_the_frame_in_its_sequence() -> None:
    plans = planner("board", DRIVE, "video")
    frames = [plans.plan(index) for index in (0, 59, 60, 75)]
    assert [frame.sequence for frame in frames] == [0, 0, 1, 1]
    assert frames[3].frame == 15
    assert planner("board", DRIVE, "video").plan(75) == frames[3]
    assert planner("board", DRIVE, "video").plan(59) == frames[1]


@pytest.mark.parametrize("scene", ["board", "truck"])
@pytest.mark.parametrize("camera", [{"pitch_deg": 60.0}, {"hfov_deg": 1.0}])
def test_cameras_that_see_no_face_are_blamed_and_not_the_scene(scene: str, camera: dict[str, float]) -> None:
    mount = dataclasses.replace(SMALL_RIG.cameras[0], **camera)
    plans = ScenePlanner(tiny_world(scene), Rig(cameras=(mount,)), STILL, split_name="test")
    with pytest.raises(PlacementError, match=r"change options.pitch_deg, options.roll_deg, options.hfov_deg") as caught:
        plans.plan(0)
    assert "widen" not in str(caught.value)
