"""`gear.to_rerun`: opens a dataset in Rerun, a viewer of pictures, poses and boxes over time.

Needs the package rerun-sdk (extra `mujoco-gear[rerun]`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gear.contracts.tasks import Sample
from gear.dataset.files import named_alone
from gear.dataset.reading import Dataset
from gear.plugins.datasets import open_dataset
from gear.values.errors import GearError
from gear.values.scene import CameraRecord, SceneRecord
from gear.view.channels import PreviewError, previews

TIMELINE = "sample"
"""Name of Rerun's timeline, whose times are the indices of the samples."""


def to_rerun(
    dataset: str | Path | Dataset[Any],
    out: str | Path | None = None,
    *,
    split: str | None = None,
    samples: int | None = None,
) -> Any:
    """Opens a dataset in Rerun's viewer, or writes it as a recording (`.rrd`).

    The recording has the pictures of the cameras and the task's previews (`<camera>/image`, `preview/<name>`), the
    cameras with their poses and intrinsics, the actors as points with labels, and the patch surfaces as outlines. World
    coordinates are gear's: x east, y north, z up, metres.

    Args:
        dataset: root of a dataset of any task, or an open dataset.
        out: file to write; None opens the viewer.
        split: split of the dataset; optional if there is only one.
        samples: number of samples, counted from the first; all by default.

    Returns:
        Rerun's `RecordingStream`, to which further data may be logged.

    Raises:
        GearError: rerun-sdk is not installed.
        DatasetError: there is no finished split, or `out` is a folder.
    """
    try:
        import rerun
    except ImportError as error:
        raise GearError("rerun is not installed; pip install 'mujoco-gear[rerun]'") from error
    opened = dataset if isinstance(dataset, Dataset) else open_dataset(dataset, split)
    recording = rerun.RecordingStream(f"gear {opened.root.resolve().name}")
    if out is None:
        recording.spawn()
        _log(rerun, recording, opened, samples)
        return recording
    with named_alone(Path(out)) as unfinished:
        recording.save(str(unfinished))
        _log(rerun, recording, opened, samples)
    return recording


def _log(rerun: Any, recording: Any, opened: Dataset[Any], samples: int | None) -> None:
    """Logs the first `samples` samples of a dataset, or all of them, and waits until they are written."""
    recording.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for index in range(len(opened) if samples is None else min(samples, len(opened))):
        recording.set_time(TIMELINE, sequence=index)
        _log_sample(rerun, recording, opened, opened[index])
    recording.flush()


def _log_sample(rerun: Any, recording: Any, dataset: Dataset[Any], sample: Sample) -> None:
    record = sample.record
    for camera in record.cameras:
        _log_camera(rerun, recording, camera, sample)
    try:
        for channel, shown in previews(dataset.task, sample).items():
            recording.log(f"preview/{channel.name}", rerun.Image(shown.pixels).compress())
    except PreviewError as error:
        recording.log("preview", rerun.TextLog(str(error)))
    positions = [actor.world_from_actor.position_m for actor in record.actors]
    names = [f"{actor.asset} {actor.role} {actor.id}" for actor in record.actors]
    recording.log("world/actors", rerun.Points3D(positions, labels=names, radii=0.5))
    recording.log("world/surfaces", rerun.LineStrips3D(_outlines(record), colors=[255, 106, 224]))


def _log_camera(rerun: Any, recording: Any, camera: CameraRecord, sample: Sample) -> None:
    """Logs pose (x right, y down, z forward), intrinsics and picture of a camera."""
    pose, pinhole = camera.world_from_camera_transform, camera.intrinsics
    place = f"world/{camera.name}"
    recording.log(place, rerun.Transform3D(translation=pose.translation_m, mat3x3=pose.rotation))
    focal = [pinhole.fx_px, pinhole.fy_px]
    principal = [pinhole.cx_px + 0.5, pinhole.cy_px + 0.5]  # Rerun counts from the corner of the first pixel
    size = [camera.width_px, camera.height_px]
    recording.log(f"{place}/image", rerun.Pinhole(focal_length=focal, principal_point=principal, resolution=size))
    if camera.name in sample.images:
        recording.log(f"{place}/image", rerun.Image(sample.images[camera.name]).compress())


def _outlines(record: SceneRecord) -> list[Any]:
    """Returns the closed outline of each patch surface, (5, 3) world coordinates in metres."""
    outlines = []
    for surface in record.surfaces:
        world_from_surface = record.world_from_surface(surface)
        right = world_from_surface.rotation[:, 0] * surface.width_m / 2
        down = world_from_surface.rotation[:, 1] * surface.height_m / 2
        middle = world_from_surface.translation_m
        corners = [middle - right - down, middle + right - down, middle + right + down, middle - right + down]
        outlines.append(np.array([*corners, corners[0]]))
    return outlines
