"""What each worker of a study does: opens places and networks, drives, and writes the folder of each drive."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gear.collecting.job import Job, resolve
from gear.collecting.lookup import look_up
from gear.collecting.patch_sources import PatchSet
from gear.collecting.session import Session, open_session
from gear.contracts.controllers import Action
from gear.contracts.executors import MOST_FAILURES, Outcome, Report
from gear.contracts.rendering import RendererInfo
from gear.contracts.specs import TaskSpec
from gear.dataset.claims import Claims
from gear.dataset.executors.calibrations import CalibrationReports
from gear.dataset.files import explained, read_bytes, write_alone
from gear.dataset.guarded_paths import owned, remove_tree
from gear.dataset.json_text import dump_json, parse_json
from gear.dataset.sealed_json import DamagedError, load_sealed, sealed_json
from gear.dataset.whole_tree import whole_tree
from gear.driving.drives import Cast, DriveRun, Drives
from gear.driving.log import log_bytes, log_hash
from gear.driving.loop import Sight, Watch, Wheel, drive
from gear.driving.measures import Measures, measure
from gear.driving.simulation import FRAME_S, DriveSimulation, Situation
from gear.driving.start import Draw
from gear.driving.video import Video
from gear.measuring.calibration import NOTHING, opened_calibration
from gear.measuring.guard import OpenedGuard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.metric_json import known_json
from gear.plugins.build import build
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, GearError, PlacementError
from gear.values.frames import UInt8Image
from gear.values.progress import NO_CALLBACKS, Callbacks, Progress
from gear.values.serial import Json, from_json, to_json
from gear.world.compilation.world_cache import load_or_compile
from gear.world.scene_spec import SceneSpec
from gear.world.world import World

LEAST_POOL = 4
"""Smallest number of other vehicles and of people that a world can show, so that scenarios find their actors."""

RESULT, LOG, VIDEO = "result.json", "log.jsonl", "video.mp4"
"""Names of the files in the folder of a drive."""

DAMAGED = "is damaged; delete its folder and drive again"
UNREADABLE = (LookupError, TypeError, ValueError, RecursionError)
"""Errors of reading JSON that gear did not write."""

FIRST = "frames of the first drive"
"""Title under which the frames of a worker's first drive are counted."""

CLAIMS = "drives"
"""Name under which workers claim drives."""

NOT_OF_A_DRIVE = (DatasetError, OSError, MemoryError)
"""Errors of the disk and of the machine's limits, which end the study because they do not concern a single drive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveResult:
    """The result of one drive.

    Attributes:
        run: the drive.
        measures: its measures.
        log_sha256: hash of its log; equal drives have equal hashes.
        patch: label of the patch that the scene showed.
        patch_sha256: hash of the patch's pictures; empty without a patch.
        weights_sha256: hash of the network's weights; None without a network.
        renderer: the renderer with its driver and device; None where nothing was rendered.
        open_loop: metrics of the predictions in all frames of the drive, by name; empty if they were not evaluated.
        open_loop_metric: name of the task's main metric among them; "" for none.
    """

    run: DriveRun
    measures: Measures
    log_sha256: str
    patch: str
    patch_sha256: str = ""
    weights_sha256: str | None = None
    renderer: RendererInfo | None = None
    open_loop: dict[str, float | None] = field(default_factory=dict)
    open_loop_metric: str = ""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Place:
    """A place in which drives of one driver take place."""

    simulation: DriveSimulation
    session: Session | None
    job: Job | None


@dataclass(slots=True, eq=False, kw_only=True)
class DriveWorker:
    """The place and the network that were opened last; runs are ordered so that they rarely change.

    Attributes:
        drives: the study.
        place_key, place: what decides the open place, and the place; None before the first drive.
        open_places: closes the open place.
        model_key, model: driver whose network is loaded, and the network with its defense; None without one.
        callbacks: callbacks that receive the progress of calibrations, and of the first drive.
        has_driven: whether a drive is finished, so that the rate of drives is known.
    """

    drives: Drives
    place_key: tuple[str, str, str] | None = None
    place: _Place | None = None
    open_places: contextlib.ExitStack = field(default_factory=contextlib.ExitStack)
    model_key: str = ""
    model: GuardedModel | None = None
    callbacks: Callbacks = NO_CALLBACKS
    has_driven: bool = False

    def place_of(self, run: DriveRun) -> _Place:
        """World, simulation and renderer of a drive."""
        cast = self.drives.casts[run.driver]
        key = (f"{cast.task} {cast.driver.options}" if cast.task else "", run.town, run.scene)
        if key != self.place_key:
            self.place_key, self.place = None, None  # if opening fails, no later drive gets a closed place
            self.open_places.close()
            self.place = self._opened(run, cast)
            self.place_key = key
        assert self.place is not None
        return self.place

    def _opened(self, run: DriveRun, cast: Cast) -> _Place:
        config = self.drives.collection(run)
        if not cast.task:
            named = look_up(config)
            scene = named.scene
            world = load_or_compile(
                town=config.town, scene_name=config.scene, scene=with_pool(scene), weather=named.weather
            )
            return _Place(simulation=self._simulation(world, scene), session=None, job=None)
        job = resolve(config)
        session = self.open_places.enter_context(open_session(replace(job, scene=with_pool(job.scene))))
        return _Place(simulation=self._simulation(session.world, job.scene), session=session, job=job)

    def _simulation(self, world: World, scene: SceneSpec) -> DriveSimulation:
        return DriveSimulation(world, with_any_number(scene), self.drives.config.dynamics)

    def model_of(self, cast: Cast) -> GuardedModel | None:
        """The network of a driver, with its defense; None without one."""
        if cast.model is None:
            return None
        if self.model is None or self.model_key != cast.label:
            self.model = GuardedModel(cast.model, guard_of_cast(cast, self.callbacks), seed=self.drives.config.seed)
            self.model_key = cast.label
        return self.model


def with_pool(scene: SceneSpec) -> SceneSpec:
    """The scene `scene` with a larger allowed number of road users, so the compiled world has enough actors for
    scripted ones.
    """
    return replace(
        scene,
        npc_vehicles=replace(scene.npc_vehicles, count=(0, max(LEAST_POOL, scene.npc_vehicles.count[1]))),
        pedestrians=replace(scene.pedestrians, count=(0, max(LEAST_POOL, scene.pedestrians.count[1]))),
    )


def with_any_number(scene: SceneSpec) -> SceneSpec:
    """The scene `scene` without smallest numbers of road users, because a drive keeps the lane of the ego car free."""
    return replace(
        scene,
        npc_vehicles=replace(scene.npc_vehicles, count=(0, scene.npc_vehicles.count[1])),
        pedestrians=replace(scene.pedestrians, count=(0, scene.pedestrians.count[1])),
    )


def guard_of_cast(cast: Cast, callbacks: Callbacks = NO_CALLBACKS) -> OpenedGuard:
    """The defense of a driver with its calibration data; an empty guard without a defense.

    Args:
        cast: the driver.
        callbacks: callbacks that receive the progress of the calibration.
    """
    if cast.defense is None or cast.model is None:
        return OpenedGuard()
    driver = cast.driver
    calibration = NOTHING
    if driver.calibration:
        patched = driver.calibration_patched or None
        calibration = opened_calibration(driver.calibration, patched, [cast.model], driver.defense, callbacks=callbacks)
    return OpenedGuard(defense=cast.defense, calibration=calibration)


def drive_all(drives: Drives, indices: Iterator[int], report: Report) -> None:
    """Runs in one worker: makes drives one after another, and reports the outcome of each.

    Args:
        drives: the study.
        indices: indices of the drives; those that another run has made or claimed are not made.
        report: called with the outcome of each drive, and with the progress of calibrations.

    Raises:
        GearError: a file cannot be written.
    """
    calibrations = CalibrationReports(report=report)
    worker = DriveWorker(drives=drives, callbacks=calibrations.callbacks())
    in_row = 0
    with worker.open_places, Claims(drives.root, CLAIMS) as claims, single_thread(drives):
        for index in indices:
            if not claims.take(index):
                report(Outcome(index=index, kind="elsewhere"))
                continue
            calibrations.index = index
            outcome = _outcome(worker, index)
            claims.release(index)
            in_row = in_row + 1 if outcome.kind == "failed" and not outcome.is_final else 0
            report(outcome)
            if in_row >= MOST_FAILURES:
                return


def _outcome(worker: DriveWorker, index: int) -> Outcome:
    """Makes one drive, unless it is there.

    Raises:
        DatasetError, OSError, MemoryError: a file cannot be written, or a limit of the machine is reached.
    """
    try:
        return Outcome(index=index, kind="made" if _made(worker, worker.drives.runs[index]) else "elsewhere")
    except NOT_OF_A_DRIVE:
        raise
    except Exception as error:
        text = str(error) if isinstance(error, GearError) else one_line(error)
        trace = "".join(traceback.format_exception(error))
        is_final = isinstance(error, PlacementError)
        return Outcome(index=index, kind="failed", error=text, trace=trace, is_final=is_final)


def _made(worker: DriveWorker, run: DriveRun) -> bool:
    """Makes a drive and writes its folder; returns False if it is there already."""
    drives = worker.drives
    place = worker.place_of(run)
    patch = drives.patch(run, 0 if place.session is None else len(place.session.world.faces))
    folder = drives.folder(run, patch)
    identity = drives.identity(run, patch)
    if read_result(drives.root, folder, identity, with_video=drives.has_video(run)) is not None:
        return False
    video = Video(run.caption) if drives.has_video(run) else None
    watch: Watch | None = None if video is None else video.watch
    if not worker.has_driven:
        watch = _counting(round(drives.scenario(run).duration_s / FRAME_S), worker.callbacks.part(FIRST), watch)
    done = drive_once(worker, run, patch, watch)
    worker.has_driven = True
    data = log_bytes(done.log)
    result = DriveResult(
        run=run,
        measures=measure(done.log),
        log_sha256=log_hash(data),
        patch=patch.label,
        patch_sha256=patch.digest,
        weights_sha256=None if done.model is None else done.model.weights_sha256,
        renderer=None if place.job is None else place.job.renderer,
        open_loop=done.open_loop,
        open_loop_metric=_main_metric(place.session),
    )
    content = sealed_json({"identity": identity, "result": to_json(result)})
    shown = {} if video is None else {VIDEO: video.mp4()}
    _write(drives.root, folder, {LOG: data, **shown, RESULT: content})
    return True


def _counting(frames: int, on_progress: Progress, watch: Watch | None) -> Watch:
    """A function that counts the frames of a drive of at most `frames` frames, and calls another one in each."""

    def counted(situation: Situation, views: Mapping[str, UInt8Image], seen: Any, action: Action | None) -> None:
        if watch is not None:
            watch(situation, views, seen, action)
        on_progress(min(situation.frame + 1, frames), frames)

    return counted


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DoneDrive:
    """A drive that has just been made.

    Attributes:
        log: its log, as `gear.driving.loop.drive` returns it.
        model: the network with its defense; None without one.
        open_loop: metrics of the predictions in all frames, by name; empty if they were not evaluated.
    """

    log: list[Json]
    model: GuardedModel | None
    open_loop: dict[str, float | None]


def drive_once(worker: DriveWorker, run: DriveRun, patch: PatchSet, watch: Watch | None = None) -> DoneDrive:
    """Makes one drive and writes nothing.

    Args:
        worker: the open place and network; they are opened if another drive was made before.
        run: the drive.
        patch: the patch that its scene shows.
        watch: called in every frame with the state, the pictures, the prediction and the action; None for nothing.

    Raises:
        GearError: the place has no room for the scenario, or code of another package failed.
    """
    drives, cast = worker.drives, worker.drives.casts[run.driver]
    place, model = worker.place_of(run), worker.model_of(cast)
    sight = None
    if place.session is not None and place.job is not None:
        session = replace(place.session, job=replace(place.session.job, patch=patch))
        is_evaluated = drives.config.open_loop and model is not None
        evaluator = session.task.evaluator() if is_evaluated else None
        sight = Sight(session=session, rig=session.task.rig(), model=model, evaluator=evaluator)
    wheel = Wheel(plugin=cast.controller.found, controller=build(cast.controller.found, cast.controller.options))
    draw = Draw(name=run.scenario, scenario=drives.scenario(run), speed_mps=run.speed_kmh / 3.6, seed=run.seed)
    log = drive(place.simulation, draw, wheel, sight, watch)
    open_loop = {} if sight is None or sight.evaluator is None else known_json(sight.evaluator.result())
    return DoneDrive(log=log, model=model, open_loop=open_loop)


def _main_metric(session: Session | None) -> str:
    spec = None if session is None else session.plugin.spec
    return spec.metric if isinstance(spec, TaskSpec) else ""


def _write(root: Path, folder: str, files: Mapping[str, bytes]) -> None:
    """Writes the folder of a drive, which appears whole; a damaged one is replaced.

    Raises:
        DatasetError: a file cannot be written.
    """
    target = owned(root, folder)
    if target.exists():
        remove_tree(root, folder)
    with explained(target):
        target.parent.mkdir(parents=True, exist_ok=True)
    with whole_tree(target, "drive", is_continued=False) as unfinished:
        for name, data in files.items():
            write_alone(unfinished / name, data)


def read_result(root: Path, folder: str, identity: Json, *, with_video: bool = False) -> DriveResult | None:
    """The result of a drive; None if it is not there, is of another drive, or its log does not have the hash that the
    result names.

    Args:
        root: folder of the study.
        folder: folder of the drive, relative to the root.
        identity: everything that decides the drive (`Drives.identity`).
        with_video: whether a drive without a video counts as missing.

    Raises:
        DatasetError: the result is damaged, or cannot be read.
    """
    path = root / folder / RESULT
    if not path.is_file() or (with_video and not (root / folder / VIDEO).is_file()):
        return None
    try:
        content: Json = load_sealed(path)
        is_same = dump_json(content["identity"]) == dump_json(identity)
        result = from_json(DriveResult, content["result"], "result")
    except (DamagedError, *UNREADABLE) as error:
        raise DatasetError(path, DAMAGED) from error
    log = root / folder / LOG
    if not is_same or not log.is_file() or log_hash(read_bytes(log)) != result.log_sha256:
        return None
    return result


def read_log(root: Path, folder: str) -> list[Json]:
    """Reads the log of a finished drive.

    Args:
        root: folder of all results.
        folder: folder of the drive, relative to the root.

    Returns:
        The lines of the log: the head, one entry per frame, and the end.

    Raises:
        DatasetError: the file is damaged, or cannot be read.
    """
    path = root / folder / LOG
    try:
        lines = [parse_json(line) for line in read_bytes(path).splitlines()]
    except UNREADABLE as error:
        raise DatasetError(path, DAMAGED) from error
    if len(lines) < 3 or not all(isinstance(line, dict) for line in lines):
        raise DatasetError(path, DAMAGED)
    return lines


@contextlib.contextmanager
def single_thread(drives: Drives) -> Iterator[None]:
    """A context in which torch uses one thread, so that a network's numbers do not depend on the number of cores. Does
    nothing if no driver has a network.
    """
    if all(cast.model is None for cast in drives.casts.values()):
        yield
        return
    import torch

    from gear.networks.runtime import prepare

    prepare()
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
