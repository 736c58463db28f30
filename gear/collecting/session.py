"""A worker's session: a compiled world and a renderer, with which it makes one sample after another."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from gear.camera.pipeline import CameraPipeline
from gear.camera.reflection import MirrorView, Reflection
from gear.collecting.devices import device_of, refuse_other_renderer
from gear.collecting.flow_files import flow_files
from gear.collecting.job import Job, versions
from gear.collecting.probes import ProbeShot, compute_probes, shoot_probes
from gear.collecting.scan_files import scan_files
from gear.contracts.rendering import RawView, Renderer
from gear.contracts.tasks import Encoded, Sample, Task
from gear.dataset.checks.output_checks import check_encoded
from gear.dataset.probe_files import AuxiliaryFiles, probe_files
from gear.groundtruth.laser_scan import scan_cameras, scan_points
from gear.groundtruth.optical_flow import FlowView, object_ids, optical_flow
from gear.plugins.build import blamed, build, find
from gear.plugins.catalogue import PluginEntry
from gear.render.registry import open_renderer
from gear.values.frames import Frame, GeomTable, SceneObject
from gear.values.scene import SceneRecord
from gear.world.compilation.memory import map_large_buffers, release_memory, release_render_arrays
from gear.world.compilation.world_cache import load_or_compile
from gear.world.planner import ScenePlanner
from gear.world.weather.air import camera_pipeline
from gear.world.weather.mirror_view import render_mirror_view
from gear.world.weather.night import night_of
from gear.world.world import World


class Planner(Protocol):
    """Decides the contents of each sample: its weather, actors, surfaces and cameras."""

    def plan(self, index: int) -> SceneRecord:
        """The scene record of the sample `index`, which depends only on the index."""
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LaterFrame:
    """The next frame of a driving sequence, rendered without colour to compute optical flow.

    Attributes:
        record: scene record of the next frame.
        view: depth, and ids of the road users, as the first camera sees them without its lens.
    """

    record: SceneRecord
    view: FlowView


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Shot:
    """The renders of one scene.

    Attributes:
        record: the scene record.
        raw: one raw view per camera, in the order of the record.
        below: mirrored view for the reflections of wet ground, one per camera; None for dry ground.
        geoms, objects: tables of the geoms and of the objects in the scene, for the ground truth.
        probes: renders with black and white patch surfaces; None unless probes are collected.
        scan: depth views of a laser scan; empty unless scans are collected.
        later: the next frame of the driving sequence, as the first camera sees it; None unless flow is collected, and
            for the last frame of a sequence.
    """

    record: SceneRecord
    raw: tuple[RawView, ...]
    below: tuple[MirrorView | None, ...]
    geoms: GeomTable
    objects: Mapping[int, SceneObject]
    probes: ProbeShot | None = None
    scan: tuple[RawView, ...] = ()
    later: LaterFrame | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Session:
    """Everything that one worker needs to make samples of a job.

    Attributes:
        job: the collection job.
        plugin, task: plugin of the task, and the task built from it.
        world: the compiled world of the scene.
        planner: decides the scene record of each sample.
        renderer: renderer of the world.
        pipeline: camera pipeline, which turns renders into pictures.
        device: names of device, driver and processor for the samples' sidecars; empty unless the split has mixed
            devices.
    """

    job: Job
    plugin: PluginEntry
    task: Task[Any, Any]
    world: World
    planner: Planner
    renderer: Renderer
    pipeline: CameraPipeline
    device: Mapping[str, str]

    def record(self, index: int) -> SceneRecord:
        """The scene record of the sample `index` (actors, surfaces and cameras); it depends only on the job and the
        index.
        """
        return self.pipeline.with_effects(self.planner.plan(index))

    def shoot(self, record: SceneRecord) -> Shot:
        """Places the actors of a scene in the world, with the job's patches, and renders all cameras; also the probes,
        scans and flow that the job collects.

        Args:
            record: the scene record.
        """
        names = tuple(surface.name for surface in record.surfaces)
        placed = self.world.place(record, self.job.patch.by_surface(names))
        raw = self.renderer.render(placed.stage, record.cameras)
        below = render_mirror_view(self.world, self.renderer, placed, record, self.pipeline)
        is_probed = self.job.config.probes
        probes = shoot_probes(self.world, self.renderer, placed, record, raw) if is_probed else None
        scan: tuple[RawView, ...] = ()
        if self.job.config.scans:
            scan = self.renderer.render(placed.stage, scan_cameras(record.cameras[0]), colour=False)
        later = self._later(record) if self.job.config.flow else None  # it moves the actors, so it comes last
        return Shot(
            record=record,
            raw=raw,
            below=below,
            geoms=placed.geoms,
            objects=placed.objects,
            probes=probes,
            scan=scan,
            later=later,
        )

    def _later(self, record: SceneRecord) -> LaterFrame | None:
        """Renders depth and ids of the next frame of a sequence; None for the last frame of a sequence."""
        if record.frame == self.job.split.frames - 1:
            return None
        later = self.record(record.index + 1)
        placed = self.world.place(later)
        (raw,) = self.renderer.render(placed.stage, later.cameras[:1], colour=False)
        return LaterFrame(record=later, view=_flow_view(later, raw, placed.geoms))

    def to_frame(self, shot: Shot) -> Frame:
        """Turns raw renders into pictures by the camera pipeline.

        It uses neither world nor renderer, so it can run while the next scene is rendered.

        Args:
            shot: renders of one scene.
        """
        return self._frame(shot, self._reflections(shot))

    def _reflections(self, shot: Shot) -> list[Reflection | None]:
        return [self.pipeline.reflection(below, shot.record) for below in shot.below]

    def _frame(self, shot: Shot, reflections: Sequence[Reflection | None]) -> Frame:
        views = {
            camera.name: self.pipeline.view(view, camera, shot.record, shot.geoms, reflection=reflection)
            for camera, view, reflection in zip(shot.record.cameras, shot.raw, reflections, strict=True)
        }
        return Frame(views=views, geoms=shot.geoms, objects=shot.objects)

    def finish(self, shot: Shot) -> tuple[Sample, Encoded, AuxiliaryFiles]:
        """Computes pictures, ground truth and files of one sample from its renders; it can run while the next scene is
        rendered.

        Args:
            shot: renders of one scene.

        Returns:
            The sample with its ground truth; its files in the format of the task; and its auxiliary files (probes,
            scans, flow).
        """
        reflections = self._reflections(shot)
        frame = self._frame(shot, reflections)
        with blamed(self.plugin, f"sample {shot.record.index}"):
            sample = self.task.ground_truth(frame, shot.record)
            encoded = check_encoded(self.task.encode(sample, self.job.plan.info), "encode")
        return sample, encoded, self._further_files(shot, reflections)

    def _further_files(self, shot: Shot, reflections: Sequence[Reflection | None]) -> AuxiliaryFiles:
        """Probes, laser scan and optical flow, where the job asks for them."""
        split, index = self.job.plan.info.split, shot.record.index
        found: AuxiliaryFiles = {}
        if shot.probes is not None:
            probes = compute_probes(self.pipeline, shot.probes, shot.record, shot.geoms, reflections)
            found = probe_files(probes, split, index)
        if shot.scan:
            found = {**found, **scan_files(scan_points([view.depth_m for view in shot.scan]), split, index)}
        if shot.later is not None:
            now = _flow_view(shot.record, shot.raw[0], shot.geoms)
            flow = optical_flow(now, shot.later.view, shot.record, shot.later.record)
            found = {**found, **flow_files(flow, now.camera.name, split, index)}
        return found


def _flow_view(record: SceneRecord, raw: RawView, geoms: GeomTable) -> FlowView:
    """The first camera's view of a scene, for optical flow."""
    return FlowView(camera=record.cameras[0], depth_m=raw.depth_m, object_id=object_ids(raw.geom_id, geoms.object_id))


@contextlib.contextmanager
def open_session(job: Job) -> Iterator[Session]:
    """Opens a worker's world and renderer, and closes the renderer at the end.

    Args:
        job: the collection job.

    Raises:
        BackendError: the renderer cannot start here, or it or a package is not the one that the plan names.
    """
    map_large_buffers()
    plugin = find("task", job.config.task)
    task: Task[Any, Any] = build(plugin, job.config.options)
    with blamed(plugin, "rig"):
        rig = task.rig()
    world = load_or_compile(town=job.config.town, scene_name=job.config.scene, scene=job.scene, weather=job.weather)
    night = night_of(world, job.weather, job.config.renderer)
    renderer = open_renderer(job.config.renderer, world.model, quality=job.config.quality, shelf=world.shelf)
    try:
        here = versions()
        refuse_other_renderer(job.plan.content, renderer.info, here)
        release_render_arrays(world.model)
        release_memory()
        planner = ScenePlanner(world, rig, job.split, split_name=job.config.split)
        pipeline = camera_pipeline(
            job.weather, job.config.renderer, world.town_name, job.config.camera, night, world.shapes
        )
        yield Session(
            job=job,
            plugin=plugin,
            task=task,
            world=world,
            planner=planner,
            renderer=renderer,
            pipeline=pipeline,
            device=device_of(job.plan.content, renderer.info, here),
        )
    finally:
        renderer.close()
