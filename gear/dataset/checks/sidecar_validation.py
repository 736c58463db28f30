"""Checks the values of a sidecar (the JSON file of a sample) beyond their types.

Files on disk may be damaged, edited or written by other programs. Impossible values, such as a picture without width or
a quaternion whose length is not 1, are refused here, so later code does not fail on them.
"""

from __future__ import annotations

import math

from gear.contracts.tasks import Sidecar
from gear.dataset.layout import is_reserved
from gear.values.errors import FieldError
from gear.values.ground_truth import SurfaceTruth
from gear.values.run_lengths import run_lengths
from gear.values.scene import CameraRecord, Pose, SceneRecord
from gear.values.serial import Json

MOST_SIDE_PX = 8192
LARGEST = 1e12
"""Largest accepted number, far above all metres, pixels, degrees and seconds in scenes."""

SEED = "seed"
"""Key of the seed, the only number in a sidecar without an upper limit."""

QUATERNION_TOLERANCE = 1e-3


def check_numbers(content: Json, name: str) -> None:
    """Checks that no number in a sidecar's record or surfaces is larger than `LARGEST`.

    Args:
        content: the JSON value that is checked.
        name: name of the value in the error, such as `record`.

    Raises:
        FieldError: a number is too large; the error names its key path.
    """
    where = _absurd(content)
    if where is not None:
        raise FieldError(name + where, f"is larger than {LARGEST:g}")


def check_sidecar(sidecar: Sidecar) -> None:
    """Checks the scene record, the surfaces and the names of files of a sidecar for impossible values.

    The task's own metadata (`facts`) are not checked here, but by the task when it reads them.

    Raises:
        FieldError: a value is impossible; the error names its key path.
    """
    record = sidecar.record
    _check_record(record)
    for place, truth in enumerate(sidecar.surfaces):
        _check_surface(truth, record, f"surfaces[{place}]")
    for name in sidecar.files:
        if is_reserved(name, record.split):
            raise FieldError("files", f"names {name}, which is no file of a sample")


def _check_record(record: SceneRecord) -> None:
    for field in ("index", "sequence", "frame"):
        if getattr(record, field) < 0:
            raise FieldError(f"record.{field}", f"must be at least 0, got {getattr(record, field)}")
    ids = [actor.id for actor in record.actors]
    for key, names in (
        ("actors", ids),
        ("surfaces", [surface.name for surface in record.surfaces]),
        ("cameras", [camera.name for camera in record.cameras]),
    ):
        if len(set(names)) < len(names):
            raise FieldError(f"record.{key}", "one is named twice")
    if "ego" not in [actor.role for actor in record.actors]:
        raise FieldError("record.actors", "there is no ego car")
    if not record.cameras:
        raise FieldError("record.cameras", "there is none")
    for place, actor in enumerate(record.actors):
        _check_pose(actor.world_from_actor, f"record.actors[{place}].world_from_actor")
    for place, surface in enumerate(record.surfaces):
        where = f"record.surfaces[{place}]"
        _check_pose(surface.parent_from_surface, f"{where}.parent_from_surface")
        if surface.actor_id is not None and surface.actor_id not in ids:
            raise FieldError(f"{where}.actor_id", f"there is no actor {surface.actor_id}")
        if min(surface.width_m, surface.height_m) <= 0:
            raise FieldError(where, f"must have a size, got {surface.width_m:g} x {surface.height_m:g} m")
    for place, camera in enumerate(record.cameras):
        _check_camera(camera, f"record.cameras[{place}]")


def _check_camera(camera: CameraRecord, where: str) -> None:
    _check_pose(camera.world_from_camera, f"{where}.world_from_camera")
    if not all(1 <= side <= MOST_SIDE_PX for side in (camera.width_px, camera.height_px)):
        size = f"{camera.width_px} x {camera.height_px}"
        raise FieldError(where, f"pictures are 1 to {MOST_SIDE_PX} px a side, got {size}")
    if min(camera.focal_px, 1.0 if camera.lens is None else camera.lens.focal_px) <= 0:
        raise FieldError(where, "the focal length must be above 0 px")


def _check_pose(pose: Pose, where: str) -> None:
    if abs(math.hypot(*pose.quat_wxyz) - 1) > QUATERNION_TOLERANCE:
        raise FieldError(f"{where}.quat_wxyz", "must have length 1")


def _check_surface(truth: SurfaceTruth, record: SceneRecord, where: str) -> None:
    camera = next((camera for camera in record.cameras if camera.name == truth.camera), None)
    if camera is None:
        raise FieldError(f"{where}.camera", "is none of the record's")
    if truth.name not in [surface.name for surface in record.surfaces]:
        raise FieldError(f"{where}.name", "is none of the record's")
    for field, length in (("camera_from_surface", 16), ("corners_px", 4), ("image_from_unit", 9)):
        values = getattr(truth, field)
        if values is not None and len(values) != length:
            raise FieldError(f"{where}.{field}", f"expected {length} items, got {len(values)}")
    pixels = camera.width_px * camera.height_px
    if not (0 <= truth.visible_px <= pixels and 0 <= truth.visible_fraction <= 1):
        raise FieldError(where, f"cannot show {truth.visible_px} px, {truth.visible_fraction:g} of it, in {pixels} px")
    if truth.distance_m < 0 or not 0 <= truth.incidence_deg <= 180:
        raise FieldError(where, f"cannot be {truth.distance_m:g} m away, {truth.incidence_deg:g} degrees aslant")
    try:
        filled = int(run_lengths(truth.mask_rle).sum())
    except ValueError as error:
        raise FieldError(f"{where}.mask_rle", str(error)) from error
    if filled != pixels:
        raise FieldError(f"{where}.mask_rle", f"fills {filled} pixels, not {camera.width_px} x {camera.height_px}")


def _absurd(value: Json) -> str | None:
    """The place of the first number above `LARGEST` in a JSON value, or None."""
    if isinstance(value, (int, float)):
        return "" if abs(value) > LARGEST else None
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in inner:
        below = _absurd(item) if key != SEED else None
        if below is not None:
            return (f".{key}" if isinstance(key, str) else f"[{key}]") + below
    return None
