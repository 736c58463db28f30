"""What a frame costs: milliseconds by renderer, quality, pass and picture size. By hand: python benchmarks/render.py

Wall time depends on who else uses the machine, so the processor time of all threads is printed beside it: on n idle
cores a software-rendered frame takes about processor time / n.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path

import mujoco

from gear.camera import Response, response_for
from gear.contracts.rendering import Quality, Renderer, Stage
from gear.render import RENDERERS, open_renderer
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Intrinsics, RigidTransform
from gear.values.resources import data_dir
from gear.values.scene import CameraRecord, Pose
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.weather.presets import PRESETS, apply_weather

RIGS = {"semseg": (2048, 1024, 1), "detect2d": (1333, 800, 1), "stereo3d": (1224, 370, 2), "depth": (1224, 370, 1)}
QUALITIES: tuple[Quality, ...] = ("film", "fast")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--town", type=Path, default=data_dir("mjcf") / "towns" / "town10.xml", help="or .mjb")
    parser.add_argument("--weather", default="ClearNoon", choices=sorted(PRESETS))
    parser.add_argument("--at", default="-81,198,0", help="x,y,yaw of the ego car: metres, metres, degrees")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--renderers", nargs="+", default=RENDERERS, choices=RENDERERS)
    given = parser.parse_args()
    x_m, y_m, yaw_deg = (float(value) for value in given.at.split(","))
    world_from_ego = RigidTransform.from_yaw("world", "ego", (x_m, y_m, 0.0), math.radians(yaw_deg))
    model = compiled(given.town, given.weather)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    stage = Stage(model=model, data=data)
    print(f"{given.town.name}: {model.ngeom} geoms, {model.nmeshface} triangles in {model.nmesh} meshes\n")
    print(f"{'renderer':10}{'quality':9}{'rig':10}{'size':12}{'pass':18}{'wall ms':>9}{'cpu ms':>9}")
    for name in given.renderers:
        for quality in QUALITIES:
            renderer = open_renderer(name, model, quality=quality)
            response = response_for(name, PRESETS[given.weather])
            for rig, (width, height, count) in RIGS.items():
                cameras = rig_cameras(world_from_ego, width, height, count)
                for label, run in passes(renderer, stage, cameras, response).items():
                    wall, cpu = cost_ms(run, given.frames)
                    size = f"{width}x{height}x{count}"
                    print(f"{name:10}{quality:9}{rig:10}{size:12}{label:18}{wall:9.0f}{cpu:9.0f}", flush=True)
            renderer.close()


def passes(
    renderer: Renderer, stage: Stage, cameras: tuple[CameraRecord, ...], response: Response
) -> dict[str, Callable[[], object]]:
    shapes = renderer.render(stage, cameras)
    frame = shapes[0].linear_rgb
    assert frame is not None
    return {
        "all": lambda: renderer.render(stage, cameras),
        "colour": lambda: renderer.render(stage, cameras, shapes=shapes),
        "ids + depth": lambda: renderer.render(stage, cameras, colour=False),
        "camera response": lambda: response.apply(frame),
    }


def compiled(town: Path, weather: str) -> mujoco.MjModel:
    if town.suffix == ".mjb":
        return mujoco.MjModel.from_binary_path(str(town))
    root = mjcf.from_path(str(town))
    apply_weather(root, PRESETS[weather])
    return mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def rig_cameras(world_from_ego: RigidTransform, width: int, height: int, count: int) -> tuple[CameraRecord, ...]:
    intrinsics = Intrinsics.from_hfov(width, height, math.radians(90))
    places = [
        RigidTransform.from_parts("ego", "camera", CAMERA_FROM_ACTOR_AXES.T, (1.5, -0.54 * i, 1.65))
        for i in range(count)
    ]
    return tuple(
        CameraRecord(
            name=str(i),
            width_px=width,
            height_px=height,
            focal_px=intrinsics.focal_px,
            world_from_camera=Pose.from_transform(world_from_ego @ place),
        )
        for i, place in enumerate(places)
    )


def cost_ms(run: Callable[[], object], times: int) -> tuple[float, float]:
    """The quickest of several runs, in wall time and in processor time."""
    costs = []
    for _ in range(times):
        wall, cpu = time.perf_counter(), time.process_time()
        run()
        costs.append((time.perf_counter() - wall, time.process_time() - cpu))
    return 1000 * min(wall for wall, _ in costs), 1000 * min(cpu for _, cpu in costs)


if __name__ == "__main__":
    main()
