"""Records of a car that drives along a circle, whose motion is known in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from gear.contracts.tasks import Sidecar
from gear.formats.exports.layout import ExportSplit
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import INFO
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json

RADIUS_M, RATE_RADPS, INTERVAL_S = 20.0, 0.4, 0.1
LEFT = CameraMount(name="left", width_px=32, height_px=16)
RIGHT = CameraMount(name="right", width_px=32, height_px=16, position_m=(1.5, -0.54, 1.65))


def circle(
    frames: int = 9, *, sequence: int = 0, start: int = 0, interval_s: float = INTERVAL_S, is_stereo: bool = False
) -> tuple[SceneRecord, ...]:
    """One sequence: the ego car drives along a circle about the world's origin, counter-clockwise."""
    rig = Rig(cameras=(LEFT, RIGHT) if is_stereo else (LEFT,), follows_road=True)
    records = []
    for frame in range(frames):
        angle_rad = RATE_RADPS * frame * interval_s
        place_m = (RADIUS_M * math.cos(angle_rad), RADIUS_M * math.sin(angle_rad), 0.5)
        pose = RigidTransform.from_yaw("world", "ego", place_m, angle_rad + math.pi / 2)
        _, record = synthetic_frame(rig, [], index=start + frame, world_from_ego=pose)
        records.append(replace(record, sequence=sequence, frame=frame, time_s=round(frame * interval_s, 9)))
    return tuple(records)


def split_with(
    records: Sequence[SceneRecord], task: str, split: str = "video", facts: Sequence[Json] | None = None
) -> ExportSplit:
    """A split without files; `facts` are those of the task, by sample."""
    given = [{"objects": []} for _ in records] if facts is None else facts
    sidecars = tuple(
        Sidecar(record=record, surfaces=(), facts=one, files={}) for record, one in zip(records, given, strict=True)
    )
    return ExportSplit(info=replace(INFO, split=split), task=task, sidecars=sidecars)
