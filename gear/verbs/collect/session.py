"""One worker's world: compiled once, then one sample after another."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from gear.camera.develop import Darkroom
from gear.contracts.rendering import Renderer
from gear.contracts.tasks import Encoded, Sample, Task
from gear.plugins.build import blamed, build, find
from gear.plugins.catalogue import Found
from gear.render.opening import open_renderer
from gear.values.frames import Frame
from gear.values.scene import SceneRecord
from gear.verbs.collect.job import Job
from gear.world.air import darkroom_of
from gear.world.memory import release_memory
from gear.world.planner import ScenePlanner
from gear.world.world import World


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Session:
    """Everything that makes samples of one job."""

    job: Job
    plugin: Found
    task: Task[Any, Any]
    world: World
    planner: ScenePlanner
    renderer: Renderer
    darkroom: Darkroom

    def record(self, index: int) -> SceneRecord:
        """The scene of one sample: a pure function of the job and the index."""
        return self.darkroom.recorded(self.planner.plan(index))

    def frame(self, record: SceneRecord) -> Frame:
        """Places the scene with the run's patch in it and takes its pictures."""
        names = tuple(surface.name for surface in record.surfaces)
        placed = self.world.place(record, self.job.patch.by_surface(names))
        raw = self.renderer.render(placed.stage, record.cameras)
        views = {
            camera.name: self.darkroom.view(view, camera, record, placed.geoms)
            for camera, view in zip(record.cameras, raw, strict=True)
        }
        return Frame(views=views, geoms=placed.geoms, objects=placed.objects)

    def finish(self, frame: Frame, record: SceneRecord) -> tuple[Sample, Encoded]:
        """Measures the frame and turns it into files; needs neither world nor renderer, so it can run beside them."""
        with blamed(self.plugin, f"sample {record.index}"):
            sample = self.task.ground_truth(frame, record)
            return sample, self.task.encode(sample, self.job.plan.info)


@contextlib.contextmanager
def open_session(job: Job) -> Iterator[Session]:
    """Builds a worker's world and renderer, and closes the renderer at the end."""
    plugin = find("task", job.config.task)
    task: Task[Any, Any] = build(plugin, job.config.options)
    with blamed(plugin, "rig"):
        rig = task.rig()
    world = World.build(town=job.config.town, scene_name=job.config.scene, scene=job.scene, weather=job.weather)
    renderer = open_renderer(job.config.renderer, world.model, quality=job.config.quality)
    release_memory()
    try:
        planner = ScenePlanner(world, rig, job.split, split_name=job.config.split)
        darkroom = darkroom_of(job.weather, job.config.renderer, world.town_name, job.config.camera)
        yield Session(
            job=job,
            plugin=plugin,
            task=task,
            world=world,
            planner=planner,
            renderer=renderer,
            darkroom=darkroom,
        )
    finally:
        renderer.close()
