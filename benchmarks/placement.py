"""How long a world takes to build, a sample to plan and to place: `python benchmarks/placement.py [--town NAME]`.

Planning must hide behind rendering (about 0.6 s a sample): at most 60 ms each is the target.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from gear.config.collection import SplitConfig
from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.values.errors import GearError
from gear.values.resources import data_dir
from gear.values.rig import CameraMount, Rig
from gear.values.scene import Weather
from gear.world.planner import ScenePlanner
from gear.world.scene_spec import SceneLibrary, SceneSpec
from gear.world.world import World

RIG = Rig(cameras=(CameraMount(name="rgb", width_px=2048, height_px=1024),))


def measure(town: str, name: str, scene: SceneSpec, samples: int, frames: int) -> str:
    start = time.perf_counter()
    world = World.build(town=town, scene_name=name, scene=scene, weather=Weather(name="ClearNoon"))
    built = time.perf_counter()
    still = ScenePlanner(world, RIG, SplitConfig(seed=363, samples=samples), split_name="test")
    plan_ms, place_ms = [], []
    for index in range(samples):
        before = time.perf_counter()
        record = still.plan(index)
        planned = time.perf_counter()
        world.place(record)
        plan_ms.append(1e3 * (planned - before))
        place_ms.append(1e3 * (time.perf_counter() - planned))
    drive = ScenePlanner(world, RIG, SplitConfig(seed=60, samples=1, frames=frames), split_name="video")
    before = time.perf_counter()
    drive.plan(0)
    drive_ms = 1e3 * (time.perf_counter() - before) / frames
    return (
        f"{name:14s} build {built - start:5.2f} s   plan first {plan_ms[0]:6.1f} mean {np.mean(plan_ms[1:]):5.1f}"
        f" max {max(plan_ms[1:]):6.1f} ms   place {np.mean(place_ms):5.2f} ms   drive {drive_ms:5.1f} ms a frame"
        f"   {world.model.ngeom} geoms, {len(world.slots)} actors in the pool"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--town", default="town10", help="a town's name, or the path of its MJCF")
    parser.add_argument("--scenes", type=Path, help="a scene library (default: the town's own)")
    parser.add_argument("--scene", nargs="*", help="scenes to measure (default: all)")
    parser.add_argument("--samples", type=int, default=50)
    parser.add_argument("--frames", type=int, default=105)
    options = parser.parse_args()
    library = read_node(
        SceneLibrary, parse_file(options.scenes or data_dir("configs") / "scenes" / f"{options.town}.yml")
    )
    for name in options.scene or library.scenes:
        try:
            print(measure(options.town, name, library.scenes[name], options.samples, options.frames))
        except GearError as error:
            print(f"{name:14s} {error}")


if __name__ == "__main__":
    main()
