"""One table of ratios: gear's samples beside a bare loop and MuJoCo's own renderer, attacks and evaluation beside the
bare network.

    python benchmarks/run.py
    python benchmarks/run.py --data data/detect2d --task detect2d --model fasterrcnn_r50_fpn

Each ratio is the median over rounds. In each round both sides run in turns, and are measured in processor time of all
threads of this process, because other work on the machine disturbs the time by the clock more.

- *sample / bare loop*: planning, rendering, measuring, encoding and writing, divided by placing, rendering and camera.
- *raster / mujoco.Renderer*: colour, ids and depth of one view by gear's renderer, divided by the three passes (colour,
  segmentation, depth) of `mujoco.Renderer` at the same size, from the same place, in the same world.
- *attack step* and *evaluation*: as `attack.py` and `evaluate.py` print them; only with `--data`, a dataset of gear.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from gear.collecting.job import Job, resolve
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import Session, open_session
from gear.config.load import load_collection
from gear.dataset.store import Store
from gear.render.pinhole import Frustum
from gear.values.scene import CameraRecord
from gear.world.compilation.world_cache import load_or_compile

HERE = Path(__file__).parent
HEAD = "| measured | gear | beside it | ratio |\n|---|---|---|---|"


def main() -> None:
    """Prints the machine and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--qualities", nargs="+", default=["fast", "film"])
    parser.add_argument("--scene", default="billboard04")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--block", type=int, default=2, help="samples in each round")
    parser.add_argument("--size", nargs=2, type=int, default=(2048, 1024), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--data", help="dataset for the attack's step and for evaluation")
    parser.add_argument("--task", default="semseg", help="task of the dataset")
    parser.add_argument("--model", default="ddrnet23_slim")
    parser.add_argument("--set", action="append", default=[], dest="settings", help="option of the network")
    args = parser.parse_args()
    print(f"{machine()}\n\n{HEAD}", flush=True)
    for quality in args.qualities:
        with tempfile.TemporaryDirectory() as folder:
            flags = {
                "task": "semseg",
                "quality": quality,
                "patch": "random",
                "scene": args.scene,
                "samples": str(1 + args.rounds * args.block),
                "root": folder,
            }
            size = [f"options.{side}_px={pixels}" for side, pixels in zip(("width", "height"), args.size, strict=True)]
            job = resolve(load_collection(None, flags, size))
            for row in of_samples(job, Path(folder), args.rounds, args.block):
                print(row, flush=True)
    if args.data:
        for row in of_networks(args.data, args.task, args.model, args.settings, args.rounds):
            print(row, flush=True)


def machine() -> str:
    """One line on processor, load, system and versions."""
    facts = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.*)", facts.read_text()) if facts.exists() else []
    packages = ", ".join(f"{name} {metadata.version(name)}" for name in ("mujoco", "numpy", "opencv-python-headless"))
    load = f"{os.getloadavg()[0]:.1f}"
    return f"{os.cpu_count()} cores ({names[0] if names else platform.machine()}), load {load}, {packages}"


def of_samples(job: Job, folder: Path, rounds: int, block: int) -> Iterator[str]:
    """Measures whole samples, the bare loop and MuJoCo's renderer in turns; yields rows of the table."""
    # A model of its own: the session frees the arrays of its model that only renderers need.
    own = load_or_compile(town=job.config.town, scene_name=job.config.scene, scene=job.scene, weather=job.weather)
    with open_session(job) as session:
        store = Store(folder / "made", job.plan)
        store.open(job.patch.files)
        record = session.record(0)
        (camera,) = record.cameras
        posed = session.world.place(record).stage.data
        data = mujoco.MjData(own.model)
        data.mocap_pos[:], data.mocap_quat[:] = posed.mocap_pos, posed.mocap_quat
        mujoco.mj_forward(own.model, data)
        theirs = passes_of_mujoco(own.model, data, camera)
        spent: list[tuple[float, ...]] = []
        collect_samples(session, store, range(1), lambda _: None)
        for index in range(1, 1 + rounds * block):  # what is computed once per asset belongs to neither side
            session.to_frame(session.shoot(session.record(index)))
        for number in range(rounds):
            part = range(1 + number * block, 1 + (number + 1) * block)
            records = [session.record(i) for i in part]
            whole = seconds(lambda part=part: collect_samples(session, store, part, lambda _: None))  # type: ignore[misc]
            bare = seconds(lambda records=records: [session.to_frame(session.shoot(one)) for one in records])  # type: ignore[misc]
            view = seconds(one_view(session))
            spent.append((whole / block, bare / block, view, seconds(theirs)))
    whole, bare, view, other = (statistics.median(of) for of in zip(*spent, strict=True))
    ratio = statistics.median(one[0] / one[1] for one in spent)
    yield f"| sample / bare loop, `{job.config.quality}` | {whole:.2f} s | {bare:.2f} s | {ratio:.2f} |"
    ratio = statistics.median(one[2] / one[3] for one in spent)
    yield f"| raster / `mujoco.Renderer`, `{job.config.quality}` | {view:.2f} s | {other:.2f} s | {ratio:.2f} |"


def one_view(session: Session) -> Callable[[], object]:
    """Renders colour, ids and depth of the first sample's view; the world is placed at once."""
    record = session.record(0)
    stage = session.world.place(record).stage
    return lambda: session.renderer.render(stage, record.cameras)


def passes_of_mujoco(model: mujoco.MjModel, data: mujoco.MjData, camera: CameraRecord) -> Callable[[], object]:
    """Renders the three passes of `mujoco.Renderer` from a camera's place, which looks level along its axis."""
    model.vis.global_.offwidth, model.vis.global_.offheight = camera.width_px, camera.height_px
    model.vis.global_.fovy = np.degrees(2 * np.arctan(camera.height_px / 2 / camera.focal_px))
    frustum = Frustum.of(camera)
    free = mujoco.MjvCamera()
    free.type, free.distance = mujoco.mjtCamera.mjCAMERA_FREE, 1.0
    free.lookat[:] = frustum.position_world_m + frustum.forward_world
    free.azimuth = float(np.degrees(np.arctan2(frustum.forward_world[1], frustum.forward_world[0])))
    free.elevation = float(np.degrees(np.arcsin(frustum.forward_world[2])))
    renderer = mujoco.Renderer(model, camera.height_px, camera.width_px, max_geom=model.ngeom + 100)

    def render() -> None:
        for enable, disable in (
            (lambda: None, lambda: None),
            (renderer.enable_segmentation_rendering, renderer.disable_segmentation_rendering),
            (renderer.enable_depth_rendering, renderer.disable_depth_rendering),
        ):
            enable()
            renderer.update_scene(data, free)
            renderer.render()
            disable()

    render()
    return render


def seconds(run: Callable[[], object]) -> float:
    """Processor time of one call."""
    begun = time.process_time()
    run()
    return time.process_time() - begun


def of_networks(data: str, task: str, model: str, settings: list[str], rounds: int) -> Iterator[str]:
    """Runs `attack.py` and `evaluate.py`; yields rows of the table."""
    options = ["--data", data, "--model", model, *(part for setting in settings for part in ("--set", setting))]
    step: dict[str, Any] = json.loads(script("attack.py", *options, "--task", task, "--steps", str(rounds)))
    yield f"| attack step / bare passes, `{model}` | {step['attack_s']} s | {step['bare_s']} s | {step['ratio']:.2f} |"
    said = script("evaluate.py", *options, "--rounds", str(rounds), "--samples", "4")
    found = re.search(r"evaluate / bare: median ([\d.]+)", said)
    yield f"| evaluation / bare passes, `{model}` | | | {float(found[1]) if found else float('nan'):.2f} |"


def script(name: str, *options: str) -> str:
    """Standard output of another benchmark.

    Raises:
        SystemExit: the benchmark failed; its own message is on standard error.
    """
    ended = subprocess.run([sys.executable, str(HERE / name), *options], stdout=subprocess.PIPE, text=True, check=False)
    if ended.returncode:
        raise SystemExit(f"{name} ended with {ended.returncode}")
    return ended.stdout


if __name__ == "__main__":
    main()
