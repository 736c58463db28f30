"""`camera_billboard_info.json`: poses of cameras and billboards for the loaders of CARLA-GeAR.

World frame: x forward, y left, z up, in metres and radians. The origin of a billboard lies on its face at half height,
0.1 m to the left of the middle; its x axis points into the board, y to the viewer's left, z up. The loaders compute the
position of the patch from this origin. They ignore roll and pitch, so records of tilted cameras or billboards have
`level: false`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence

import numpy as np

from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Array, RigidTransform
from gear.values.scene import CameraRecord, SceneRecord
from gear.values.serial import Json

LEFT_OF_MIDDLE_M = 0.1
FLU_FROM_SURFACE = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation from a surface's axes (x right, y down, z into the board) to the billboard's (x into the board, y left, z
up).
"""

LEVEL_RAD = 1e-4


def billboard_info(
    records: Iterable[SceneRecord],
    *,
    task: str,
    patch_label: str,
    reference: str,
    second: str | None = None,
    before: bytes | None = None,
) -> Json:
    """The JSON content of `camera_billboard_info.json` for one split: camera and billboard poses of all samples.

    Args:
        records: scene records of the samples, in the loader's order. The iterable is read once, and one record at a
            time is in memory.
        task: CARLA-GeAR's name of the task: `ss`, `2dod`, `3dod`, `depth`.
        patch_label: `none`, `random`, or the patch's name and hash.
        reference: name of the camera whose pictures the loader reads.
        second: name of the second camera of a stereo pair. Without a second camera, the file repeats the reference
            camera.
        before: bytes of the file for the samples before `records`; None if `records` are all samples.
    """
    second = second or reference
    is_patched = patch_label != "none"
    entries: list[Json] = []
    boards, is_level, is_symmetric = 0, True, True
    params: dict[str, Json] = {reference: {}, second: {}}
    if before is not None:
        there = json.loads(before)
        entries, info = there["camera_billboard_positions"], there["info"]
        boards, is_level, is_symmetric = info["num_billboards"], info["level"], info["symmetric"]
        params = {second: there["camera_dx_params"], reference: there["camera_params"]}
    for index, record in enumerate(records, len(entries)):
        entries.append(_entry(index, record, reference, second))
        boards = max(boards, len(record.surfaces))
        is_level &= _is_level(record, (reference, second))
        is_symmetric &= all(record.camera(name).intrinsics.is_symmetric for name in params)
        if not index:
            params = {name: _params(record, name) for name in params}
    info = {
        "task": task,
        "num_billboards": boards,
        "is_patched": is_patched,
        "patch_folder": patch_label if is_patched else None,
        "patch_type": ("random" if patch_label == "random" else "adversarial") if is_patched else "none",
        "net": None,
        "creator": "gear",
        "level": is_level,
        "symmetric": is_symmetric,
    }
    return {
        "info": info,
        "camera_billboard_positions": entries,
        "patch_mask_corners": {},
        "camera_params": params[reference],
        "camera_dx_params": params[second],
    }


def xyzrpy(world_from_frame: RigidTransform) -> list[float]:
    """A pose as six numbers: x, y, z in metres, and roll, pitch, yaw in radians for Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        world_from_frame: the pose.
    """
    r = world_from_frame.rotation
    roll = math.atan2(r[2, 1], r[2, 2])
    pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    yaw = math.atan2(r[1, 0], r[0, 0])
    numbers = (*world_from_frame.translation_m, roll, pitch, yaw)
    return [round(float(v), 7) + 0.0 for v in numbers]


def world_from_board(record: SceneRecord, index: int) -> RigidTransform:
    """The pose in the world of a billboard, in CARLA-GeAR's billboard frame.

    The origin of that frame lies on the face at half height, 0.1 m to the left of the middle. x points into the board,
    y to the viewer's left, z up.

    Args:
        record: the scene.
        index: number of the surface in `record.surfaces`.
    """
    world_from_surface = record.world_from_surface(record.surfaces[index])
    rotation: Array = world_from_surface.rotation @ FLU_FROM_SURFACE.T
    origin = world_from_surface.apply([-LEFT_OF_MIDDLE_M, 0.0, 0.0])
    return RigidTransform.from_parts("world", "board", rotation, origin)


def world_from_flu_camera(camera: CameraRecord) -> RigidTransform:
    """The pose of a camera in the world, in a camera frame with x forward, y left and z up.

    Args:
        camera: the camera with its pose.
    """
    placed = camera.world_from_camera_transform
    rotation: Array = placed.rotation @ CAMERA_FROM_ACTOR_AXES
    return RigidTransform.from_parts("world", "camera", rotation, placed.translation_m)


def _entry(index: int, record: SceneRecord, reference: str, second: str) -> Json:
    entry: dict[str, Json] = {"id": index}
    # A loader reads the first board of every entry, boards or not, and stops at null; the second one may be null.
    entry["billboard_xyzrpy"] = xyzrpy(world_from_board(record, 0)) if record.surfaces else [0.0] * 6
    entry["billboard2_xyzrpy"] = xyzrpy(world_from_board(record, 1)) if len(record.surfaces) > 1 else [None] * 6
    for number in range(2, len(record.surfaces)):
        entry[f"billboard{number + 1}_xyzrpy"] = xyzrpy(world_from_board(record, number))
    entry["camera_xyzrpy"] = xyzrpy(world_from_flu_camera(record.camera(reference)))
    entry["camera_dx_xyzrpy"] = xyzrpy(world_from_flu_camera(record.camera(second)))
    return entry


def _params(record: SceneRecord, name: str) -> Json:
    camera = record.camera(name)
    return {
        "height": camera.height_px,
        "width": camera.width_px,
        "fov": camera.intrinsics.hfov_rad,
        "focal": camera.focal_px,
    }


def _is_level(record: SceneRecord, cameras: Sequence[str]) -> bool:
    frames = [world_from_flu_camera(record.camera(name)) for name in cameras]
    frames += [world_from_board(record, index) for index in range(len(record.surfaces))]
    return all(float(frame.rotation[2, 2]) >= math.cos(LEVEL_RAD) for frame in frames)
