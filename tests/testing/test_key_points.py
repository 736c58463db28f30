"""Key points of people reach a task: a third party's COCO key-point task, whole in this file."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from gear.collecting.job import resolve
from gear.collecting.session import open_session
from gear.config.collection import SplitConfig
from gear.config.load import load_collection
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, Sample, Sidecar, SplitInfo
from gear.formats.png import encode_rgb
from gear.groundtruth.optical_flow import object_ids
from gear.plugins.tasks.common import CameraOptions, images_of, read_rgb, surfaces_of
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import TaskContract
from gear.testing.things import CAR, PERSON, Thing, street
from gear.testing.tiny_town import SMALL_RIG, TINY_SCENES, TINY_TOWN, tiny_world
from gear.values.errors import TownError
from gear.values.frames import Frame, UInt8Image, View
from gear.values.resources import data_dir
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.world.assets.library import AssetLibrary, read_actor_facts
from gear.world.planner import ScenePlanner

NAMES = ("nose", "left_hip", "right_hip")
JOINTS = {"nose": (0.25, 0.0, 1.6), "left_hip": (0.25, 0.1, 0.9), "right_hip": (0.25, -0.1, 0.9)}
NEAR_M = 0.3
"""How far behind the visible surface a joint lies at most when it counts as visible."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseConfig(CameraOptions):
    """Options of the task."""

    width_px: int = 320
    height_px: int = 160


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PoseSample(Sample):
    """A picture with its people: by object id, x, y and visibility (2 visible, 1 hidden) of each of `NAMES`."""

    people: Mapping[int, tuple[tuple[float, float, int], ...]]


def people_of(view: View, frame: Frame) -> dict[int, tuple[tuple[float, float, int], ...]]:
    """Every person with all key points in the picture, by object id."""
    found = {}
    camera = view.camera
    for thing in frame.objects.values():
        points = thing.key_points_m
        if not set(points) >= set(NAMES):
            continue
        seen_m = camera.world_from_camera_transform.inverse().apply([points[name] for name in NAMES])
        if seen_m[:, 2].min() < 0.1:
            continue
        pixels = camera.intrinsics.project(seen_m)
        columns, rows = np.rint(pixels).astype(int).T
        if columns.min() < 0 or rows.min() < 0 or columns.max() >= camera.width_px or rows.max() >= camera.height_px:
            continue
        is_seen = seen_m[:, 2] <= view.depth_m[rows, columns] + NEAR_M
        found[thing.id] = tuple(
            (round(float(x), 2), round(float(y), 2), 1 + int(seen))
            for (x, y), seen in zip(pixels, is_seen, strict=True)
        )
    return found


class Similarity:
    """Share of key points within three pixels."""

    def __init__(self) -> None:
        self.near: list[bool] = []

    def update(self, sample: PoseSample, prediction: Mapping[int, Any]) -> Mapping[str, float]:
        for number, points in sample.people.items():
            found = prediction.get(number, [(-99.0, -99.0, 0)] * len(points))
            self.near += [bool(np.hypot(a[0] - b[0], a[1] - b[1]) < 3) for a, b in zip(points, found, strict=True)]
        return {}

    def merge(self, other: Any) -> None:
        self.near += other.near

    def result(self) -> Mapping[str, float]:
        return {"near": float(np.mean(self.near)) if self.near else float("nan")}


class PoseTask:
    """COCO key points."""

    def __init__(self, config: PoseConfig) -> None:
        self.config = config

    def rig(self) -> Rig:
        return Rig(cameras=(self.config.mount("left"),))

    def ground_truth(self, frame: Frame, record: SceneRecord) -> PoseSample:
        people = people_of(frame.views["left"], frame)
        return PoseSample(record=record, images=images_of(frame), surfaces=surfaces_of(frame, record), people=people)

    def encode(self, sample: PoseSample, info: SplitInfo) -> Encoded:
        path = f"images/{info.split}/{sample.record.index:06d}.png"
        people = {str(number): [list(point) for point in points] for number, points in sample.people.items()}
        return Encoded(files={path: encode_rgb(sample.images["left"])}, facts={"people": people})

    def finalise(self, sidecars: Sequence[Sidecar], info: SplitInfo) -> Mapping[str, bytes]:
        images: list[Any] = []
        annotations: list[Any] = []
        for sidecar in sidecars:
            camera, number = sidecar.record.cameras[0], sidecar.record.index + 1
            images.append({"id": number, "width": camera.width_px, "height": camera.height_px})
            for points in sidecar.facts["people"].values():
                x, y, _ = np.array(points).T
                box = [float(x.min()), float(y.min()), float(np.ptp(x)) + 1, float(np.ptp(y)) + 1]
                annotations.append(
                    {
                        "id": len(annotations) + 1, "image_id": number, "category_id": 1, "iscrowd": 0,
                        "bbox": box, "area": box[2] * box[3], "num_keypoints": len(points),
                        "keypoints": [value for point in points for value in point],
                    }
                )  # fmt: skip
        categories = [{"id": 1, "name": "person", "keypoints": list(NAMES), "skeleton": []}]
        table = {"images": images, "annotations": annotations, "categories": categories}
        return {f"annotations/person_keypoints_{info.split}.json": json.dumps(table).encode()}

    def decode(self, root: Path, sidecar: Sidecar, info: SplitInfo) -> PoseSample:
        path = f"images/{info.split}/{sidecar.record.index:06d}.png"
        people = {
            int(number): tuple((float(x), float(y), int(v)) for x, y, v in points)
            for number, points in sidecar.facts["people"].items()
        }
        images = {"left": read_rgb(root, path)}
        return PoseSample(record=sidecar.record, images=images, surfaces=sidecar.surfaces, people=people)

    def as_prediction(self, sample: PoseSample) -> Mapping[int, Any]:
        return sample.people

    def evaluator(self) -> Similarity:
        return Similarity()

    def preview(self, sample: PoseSample) -> Mapping[str, UInt8Image]:
        return dict(sample.images)


def people(index: int = 0) -> list[Thing]:
    """The synthetic street with key points on its people, and one more of them, who faces the camera behind a car."""
    things = [replace(one, key_points=JOINTS) if one.parts is PERSON else one for one in street(2, index)]
    hidden = Thing(
        parts=PERSON, position_m=(15.0, 0.0, 0.0), yaw_rad=np.pi, object_id=50, role="pedestrian", key_points=JOINTS
    )
    return [*things, hidden, Thing(parts=CAR, position_m=(12.0, 0.0, 0.0), yaw_rad=1.57, object_id=51, role="npc")]


class TestPose(TaskContract):
    spec = TaskSpec(
        name="pose", summary="COCO key points.", config=PoseConfig, build=PoseTask, views=("left",),
        layout="images/<split>/%06d.png, annotations/person_keypoints_<split>.json",
    )  # fmt: skip
    options: ClassVar = {}
    headline = "near"

    def frame(self, index: int = 0) -> tuple[Frame, SceneRecord]:
        return synthetic_frame(self.task().rig(), people(index), index=index)

    def spoil(self, prediction: Any) -> Any:
        return {number: tuple((x + 9, y, v) for x, y, v in points) for number, points in prediction.items()}

    @pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
    def test_pycocotools_finds_ground_truth_perfect(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        with contextlib.redirect_stdout(io.StringIO()):
            truth = COCO(str(tmp_path / "annotations/person_keypoints_val.json"))
            found = [
                {k: one[k] for k in ("image_id", "category_id", "keypoints", "bbox", "area")} | {"score": 1.0}
                for one in truth.anns.values()
            ]
            evaluation = COCOeval(truth, truth.loadRes(found), "keypoints")
            evaluation.params.kpt_oks_sigmas = np.full(len(NAMES), 0.1)
            evaluation.params.areaRng, evaluation.params.areaRngLbl = [[0, 1e10]], ["all"]
            evaluation.evaluate()
            evaluation.accumulate()
        assert len(found) >= 4
        assert evaluation.eval["precision"][evaluation.eval["precision"] > -1].min() == pytest.approx(1.0)

    def test_a_joint_behind_something_is_hidden(self) -> None:
        pair = [one for one in people() if one.object_id in (50, 51)]
        found = self.task().ground_truth(*synthetic_frame(self.task().rig(), pair)).people
        assert [point[2] for point in found[50]] == [2, 1, 1], "the head shows over the car, the hips do not"


def test_key_points_of_assets_stand_where_the_actors_do() -> None:
    """From the `<custom>` section of the tiny town's people to the world, for every person of a sample."""
    world = tiny_world("no_billboard")
    record = ScenePlanner(world, SMALL_RIG, SplitConfig(seed=1, samples=1), split_name="debug").plan(0)
    placed = world.place(record)
    walking = [actor for actor in record.actors if actor.role == "pedestrian"]
    assert walking
    for actor in walking:
        thing = placed.objects[actor.id]
        assert set(thing.key_points) == set(NAMES)
        nose, left, right = (np.array(thing.key_points_m[name]) for name in NAMES)
        pose = actor.world_from_actor.transform("world", "object")
        assert nose == pytest.approx(pose.apply([0.12, 0.0, 1.66]))
        assert left - right == pytest.approx(pose.rotation @ [0, 0.18, 0])


def test_key_points_of_gears_own_people_reach_a_task(tmp_path: Path) -> None:
    """From gear's MJCF through planning, placing and rendering to the labels of a task: COCO's joints of the girl."""
    shutil.copytree(TINY_TOWN.parents[1], tmp_path / "mjcf")
    people = tmp_path / "mjcf/pedestrians"
    shutil.rmtree(people)
    people.mkdir()
    for name in ("girl_stand.xml", "girl_walk_a.xml"):
        shutil.copy(data_dir("mjcf") / "pedestrians" / name, people)
    shutil.copytree(data_dir("mjcf") / "pedestrians/girl", people / "girl")
    flags = {
        "task": "depth", "town": str(tmp_path / "mjcf/towns/tiny.xml"), "scene": "no_billboard", "split": "debug",
        "renderer": "classic", "quality": "fast", "root": str(tmp_path / "data"),
    }  # fmt: skip
    settings = [f"scenes={TINY_SCENES}", "options.width_px=320", "options.height_px=160", "crowd=5"]
    task = PoseTask(PoseConfig())
    found = 0
    with open_session(resolve(load_collection(None, flags, settings))) as session:
        for index in range(4):
            record = session.record(index)
            frame = session.to_frame(session.shoot(record))
            view = frame.views["left"]
            for number, points in task.ground_truth(frame, record).people.items():
                rows, _ = np.nonzero(object_ids(view.geom_id, frame.geoms.object_id) == number)
                if len(rows) > 20:
                    (_, nose, _), (_, left, _), (_, right, _) = points
                    assert rows.min() <= nose < left and nose < right <= rows.max()
                    found += 1
    assert found >= 3


@pytest.mark.parametrize("data", ["0 1", "0 1 2 3", "1e9 0 0", "a b c"])
def test_a_key_point_is_three_numbers(tmp_path: Path, data: str) -> None:
    text = (AssetLibrary(TINY_TOWN).folder("pedestrian") / "adult_stand.xml").read_text()
    (tmp_path / "adult.xml").write_text(text.replace('data="0.12 0 1.66"', f'data="{data}"'))
    with pytest.raises(TownError, match=r"key_point\.nose must be"):
        read_actor_facts(tmp_path / "adult.xml")
