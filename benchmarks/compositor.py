"""Digital against rendered patches over all scenes of a town, and what composing costs.

By hand: python benchmarks/compositor.py --samples 3 --size 1024x512. A scene's world is built once; each renderer and
quality makes a split with probes and its twin, with random patches: white noise, the hardest that there are.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from gear.camera.pipeline import CameraPipeline
from gear.collecting.job import Job, resolve
from gear.collecting.lookup import scene_library
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import Session
from gear.compositor.registry import COMPOSITORS, open_compositor
from gear.config.load import load_collection
from gear.dataset.plan import manifest_facts
from gear.dataset.reading import Dataset
from gear.dataset.store import Store
from gear.measuring.gap.picture_gap import picture_gap, visible_mask
from gear.plugins.build import build, find
from gear.plugins.datasets import open_dataset
from gear.render import RENDERERS, open_renderer
from gear.world.planner import ScenePlanner
from gear.world.weather.air import camera_pipeline
from gear.world.world import World


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--town", default="town10")
    parser.add_argument("--scenes", nargs="+", help="all of the town's that have a surface, unless given")
    parser.add_argument("--task", default="semseg")
    parser.add_argument("--samples", type=int, default=3)
    parser.add_argument("--size", default="1024x512")
    parser.add_argument("--weather", default="ClearNoon")
    parser.add_argument("--renderers", nargs="+", default=RENDERERS, choices=RENDERERS)
    parser.add_argument("--qualities", nargs="+", default=("film", "fast"), choices=("film", "fast"))
    parser.add_argument("--patch", default="random")
    parser.add_argument("--set", action="append", default=[], dest="settings")
    given = parser.parse_args()
    torch.set_num_threads(1)
    library = scene_library(given.town).scenes
    scenes = given.scenes or [name for name, scene in library.items() if scene.boards or scene.truck]
    print(f"{'scene':13}{'renderer':10}{'quality':9}{'pictures':>9}{'slant':>7}{'':2}", end="")
    print("".join(f"{name + ' dB (least)':>24}" for name in COMPOSITORS), f"{'outside':>9}{'ms':>8}{'kB':>7}")
    everything: dict[str, list[float]] = {}
    for scene in scenes:
        for renderer, quality, rows in scene_rows(given, scene):
            for name in COMPOSITORS:
                everything.setdefault(f"{name} {renderer} {quality}", []).extend(rows.psnr_db[name])
            print(f"{scene:13}{renderer:10}{quality:9}{rows}", flush=True)
    for name, values in everything.items():
        print(f"{name:32} median {np.median(values):5.1f} dB, least {min(values):5.1f}, of {len(values)} pictures")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rows:
    """Figures of one split, by compositor."""

    psnr_db: dict[str, list[float]]
    slant_deg: float
    outside_worst: int
    compose_ms: float
    probe_kb: float

    def __str__(self) -> str:
        shown = [f"{np.median(v):15.1f} ({min(v):5.1f}) " if v else f"{'-':>24}" for v in self.psnr_db.values()]
        pictures = len(self.psnr_db[COMPOSITORS[0]])
        return (
            f"{pictures:9}{self.slant_deg:7.0f}  {''.join(shown)} {self.outside_worst:9}"
            f"{self.compose_ms:8.1f}{self.probe_kb:7.0f}"
        )


def scene_rows(given: argparse.Namespace, scene: str) -> Iterator[tuple[str, str, Rows]]:
    """One row a renderer and quality."""
    world = None
    for renderer in given.renderers:
        for quality in given.qualities:
            with tempfile.TemporaryDirectory() as folder:
                clean = job(given, scene, renderer, quality, "none", Path(folder) / "clean")
                twin = job(given, scene, renderer, quality, given.patch, Path(folder) / "twin")
                world = world or World.build(
                    town=clean.config.town, scene_name=scene, scene=clean.scene, weather=clean.weather
                )
                collect_both(world, clean, twin)
                yield renderer, quality, rows_of(open_dataset(clean.root), open_dataset(twin.root), twin)


def job(given: argparse.Namespace, scene: str, renderer: str, quality: str, patch: str, root: Path) -> Job:
    """A small split of a scene."""
    width, height = given.size.split("x")
    flags = {
        "task": given.task, "town": given.town, "scene": scene, "split": "train", "samples": str(given.samples),
        "weather": given.weather, "renderer": renderer, "quality": quality, "patch": patch, "root": str(root),
        "probes": "true" if patch == "none" else "false",
    }  # fmt: skip
    settings = [f"options.width_px={width}", f"options.height_px={height}", *given.settings]
    return resolve(load_collection(None, flags, settings))


def collect_both(world: World, clean: Job, twin: Job) -> None:
    """As `gear.collect` does, with one world and one renderer for both."""
    plugin = find("task", clean.config.task)
    task: Any = build(plugin, clean.config.options)
    pipeline: CameraPipeline = camera_pipeline(
        clean.weather, clean.config.renderer, world.town_name, clean.config.camera, shapes=world.shapes
    )
    renderer = open_renderer(clean.config.renderer, world.model, quality=clean.config.quality)
    try:
        planner = ScenePlanner(world, task.rig(), clean.split, split_name=clean.config.split)
        session = Session(
            job=clean,
            plugin=plugin,
            task=task,
            world=world,
            planner=planner,
            renderer=renderer,
            pipeline=pipeline,
            device={},
        )
        for one in (clean, twin):
            store = Store(one.root, one.plan)
            one.root.mkdir(parents=True)
            store.open(one.patch.files)
            collect_samples(replace(session, job=one), store, store.missing(), lambda _: None)
            store.close(task, manifest_facts(one.plan))
    finally:
        renderer.close()


def rows_of(clean: Dataset[Any], twin: Dataset[Any], job: Job) -> Rows:
    """Composes every picture that shows a patch, and compares."""
    patches = [torch.from_numpy(image.copy()).permute(2, 0, 1).float() / 255 for image in job.patch.images]
    found: dict[str, list[float]] = {name: [] for name in COMPOSITORS}
    slants, worst, seconds = [0.0], [0], [0.0]
    for name in COMPOSITORS:
        compositor = open_compositor(name, clean, rounding=True)
        for index in range(len(clean)):
            rendered = twin[index]
            for view, picture in rendered.images.items():
                mask = visible_mask(rendered.surfaces, view, *picture.shape[:2])
                if not mask.any():
                    continue
                compositor.compose(patches, [index], view)
                begun = time.process_time()
                digital = compositor.compose(patches, [index], view)[0].permute(1, 2, 0).numpy()
                spent = time.process_time() - begun
                gap = picture_gap(np.rint(digital * 255).astype(np.uint8), picture, mask)
                found[name].append(gap.psnr_db)
                if name == COMPOSITORS[0]:
                    slants += [s.incidence_deg for s in rendered.surfaces if s.camera == view and s.visible_px]
                    worst.append(gap.outside_worst)
                    seconds.append(spent)
    kilobytes = sum(path.stat().st_size for path in clean.root.glob("gear/*/probes/*")) / 1000 / len(clean)
    return Rows(
        psnr_db=found,
        slant_deg=max(slants),
        outside_worst=max(worst),
        compose_ms=1000 * float(np.median(seconds[1:] or [0.0])),
        probe_kb=kilobytes,
    )


if __name__ == "__main__":
    main()
