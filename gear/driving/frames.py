"""Frames of closed-loop drives as a dataset with probes, on which attacks with gradients optimise patches.

The pictures show no patch and are taken at the poses of drives, which may have been made with a patch. A frame is drawn
with a probability proportional to its weight, so that the mean over the dataset is the weighted mean over the drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gear.collecting.job import Job, resolve
from gear.collecting.patch_sources import PatchSet
from gear.collecting.pipeline import collect_samples
from gear.contracts.executors import Outcome
from gear.dataset.plan import manifest_facts
from gear.dataset.store import Store
from gear.driving.drives import DriveRun
from gear.driving.simulation import Situation
from gear.driving.worker import DriveWorker, drive_once, with_pool
from gear.plugins.build import blamed
from gear.values.errors import GearError
from gear.values.progress import Progress
from gear.values.scene import SceneRecord
from gear.values.serial import Json

SPLIT = "train"
"""Name of the split that frames of drives form."""

LEAST_WEIGHT = 0.1
"""Smallest weight of a frame: early frames decide when braking begins."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class WeightedFrame:
    """One frame of a drive.

    Attributes:
        record: the scene at that time.
        weight: how much the frame matters (`frame_weight`), `LEAST_WEIGHT` to 1.
    """

    record: SceneRecord
    weight: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecordedScenes:
    """Scene records that were made before, in place of a planner that draws them.

    Attributes:
        records: the records; the number of a sample is its index in them.
    """

    records: Sequence[SceneRecord]

    def plan(self, index: int) -> SceneRecord:
        """The scene record of the sample `index`."""
        return self.records[index]


def frame_weight(situation: Situation, conflict_s_m: float) -> float:
    """How much a frame matters for a crash: the deceleration with which the car would have to stop before the conflict,
    as a share of its strongest braking. It is 1 within the braking distance, and on a free road.

    Args:
        situation: the state of the drive.
        conflict_s_m: arc length of the conflict on the route; infinite on a free road.
    """
    if not np.isfinite(conflict_s_m):
        return 1.0
    distance_m = max(0.1, conflict_s_m - situation.position.s_m)
    needed_mps2 = situation.ego.speed_mps**2 / (2 * distance_m)
    return float(np.clip(needed_mps2 / situation.car.most_braking_mps2, LEAST_WEIGHT, 1.0))


def frames_of(worker: DriveWorker, run: DriveRun, patch: PatchSet) -> tuple[list[WeightedFrame], list[Json]]:
    """Makes one drive and keeps the scene of each frame.

    Args:
        worker: the open place and network.
        run: the drive.
        patch: the patch that the scene shows during the drive.

    Returns:
        The frames, and the log of the drive.
    """
    place = worker.place_of(run)
    assert place.session is not None, "only drivers with cameras have pictures"
    simulation, rig = place.simulation, place.session.task.rig()
    frames: list[WeightedFrame] = []

    def watch(situation: Situation, *_: Any) -> None:
        weight = frame_weight(situation, simulation.start.conflict_s_m)
        frames.append(WeightedFrame(record=simulation.record(rig, situation.frame), weight=weight))

    log = drive_once(worker, run, patch, watch).log
    return frames, log


def drawn_frames(frames: Sequence[WeightedFrame], count: int, rng: np.random.Generator) -> list[SceneRecord]:
    """Draws frames with probabilities proportional to their weights, each at most once, in their order.

    Args:
        frames: the frames of all drives.
        count: number of drawn frames; all frames if there are no more.
        rng: random generator.
    """
    if len(frames) <= count:
        return [frame.record for frame in frames]
    weights = np.array([frame.weight for frame in frames])
    chosen = rng.choice(len(frames), count, replace=False, p=weights / weights.sum())
    return [frames[index].record for index in sorted(chosen)]


def write_frames(
    worker: DriveWorker, run: DriveRun, records: Sequence[SceneRecord], root: Path, origin: Json, on_progress: Progress
) -> None:
    """Renders scenes without a patch, with probes, and writes them as the split `SPLIT` of a dataset. Finished samples
    of an interrupted run are kept.

    Args:
        worker: the open place.
        run: a drive in the same place.
        records: the scenes.
        root: folder of the dataset.
        origin: everything that decides the scenes, as JSON; it becomes part of the dataset's plan.
        on_progress: called with the finished and all samples.

    Raises:
        GearError: a sample cannot be made, or a file cannot be written.
    """
    session = worker.place_of(run).session
    assert session is not None, "only drivers with cameras have pictures"
    job = _job(worker, run, root, len(records), origin)
    numbered = [
        replace(one, split=SPLIT, seed=job.split.seed, index=index, sequence=index, frame=0, time_s=0.0)
        for index, one in enumerate(records)
    ]
    session = replace(session, job=job, planner=RecordedScenes(records=numbered))
    store, total = Store(job.root, job.plan), len(numbered)
    problems: list[str] = []
    with store.begun({}):
        missing = store.missing()
        done = total - len(missing)

        def report(outcome: Outcome) -> None:
            nonlocal done
            done += 1
            if outcome.kind == "failed":
                problems.append(outcome.error)
            on_progress(done, total)

        on_progress(done, total)
        collect_samples(session, store, missing, report)
        if problems:
            raise GearError(f"{root}: a frame of {run.title} could not be made ({problems[0]})")
        with blamed(session.plugin, "finalise"):
            store.close(session.task, manifest_facts(store.plan))


def _job(worker: DriveWorker, run: DriveRun, root: Path, samples: int, origin: Json) -> Job:
    """The collection job of the frames; its plan has no recipe, because the frames follow from drives."""
    collection = replace(
        worker.drives.collection(run), probes=True, root=str(root), split=SPLIT, samples=samples, patch="none"
    )
    job = resolve(collection)
    plan = replace(job.plan, content={**job.plan.content, "drives": origin}, recipe=None)
    return replace(job, scene=with_pool(job.scene), plan=plan)
