"""Every scene of town10 can be planned, for the rigs of all tasks, and the ego car is never in its own picture."""

from __future__ import annotations

import itertools
from functools import lru_cache

import mujoco
import numpy as np
import pytest

from gear.config.collection import SplitConfig
from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.testing.tiny_town import CLEAR
from gear.values.resources import data_dir
from gear.values.rig import CameraMount, Rig
from gear.world.planner import ScenePlanner
from gear.world.scene_spec import SceneLibrary
from gear.world.world import World

LIBRARY = read_node(SceneLibrary, parse_file(data_dir("configs") / "scenes" / "town10.yml"))
SIZES = ((2048, 1024), (1333, 800), (1224, 370))


@lru_cache(maxsize=1)
def world_of(scene: str) -> World:
    """The world of a scene; the last one is kept, for the next test of the same scene."""
    return World.build(town="town10", scene_name=scene, scene=LIBRARY.scenes[scene], weather=CLEAR)


@pytest.mark.slow
def test_a_sequence_drives_towards_the_board() -> None:
    scene = LIBRARY.scenes["billboard01"]
    world = world_of("billboard01")
    rig = Rig(cameras=(CameraMount(name="rgb", width_px=1024, height_px=512),))
    planner = ScenePlanner(world, rig, SplitConfig(seed=60, samples=1, frames=105), split_name="video")
    first, last = planner.plan(0), planner.plan(104)
    board = np.array(scene.boards[0].position_m)
    far_m, near_m = (float(np.linalg.norm(board - r.ego.world_from_actor.position_m)) for r in (first, last))
    assert near_m < far_m - 5


@pytest.mark.slow
@pytest.mark.parametrize("scene", LIBRARY.scenes)
def test_the_scene_can_be_planned(scene: str) -> None:
    world = world_of(scene)
    for width_px, height_px in SIZES:
        rig = Rig(cameras=(CameraMount(name="rgb", width_px=width_px, height_px=height_px),))
        planner = ScenePlanner(world, rig, SplitConfig(seed=363, samples=50), split_name="test")
        records = [planner.plan(index) for index in range(4)]
        assert len({record.ego for record in records}) == 4
        placed = world.place(records[0])
        camera = records[0].cameras[0]
        pose = camera.world_from_camera_transform
        for u, v in itertools.product(np.linspace(0, width_px - 1, 16), np.linspace(0, height_px - 1, 9)):
            ray = pose.rotation @ camera.intrinsics.unproject([u, v], 1.0)
            geom = np.zeros(1, np.int32)
            mujoco.mj_ray(placed.stage.model, placed.stage.data, pose.translation_m, ray, None, 1, -1, geom)
            assert geom[0] < 0 or placed.geoms.object_id[geom[0]] != records[0].ego.id
